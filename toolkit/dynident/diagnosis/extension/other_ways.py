"""Other ways to extend a model, where the straight one leaves a residual beyond the noise."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis.extension.extending import extend, rank_stage
from dynident.diagnosis.extension.reversals import left_out
from dynident.diagnosis.extension.stage import DiagnosisTask, Stage
from dynident.diagnosis.search.global_search import global_search
from dynident.diagnosis.verdict import within_noise
from dynident.evidence.held_out import on_recordings

_MUCH_LESS = 0.5
"""Of what a model leaves, beyond the noise, that another must not leave to take its place."""
_WAYS = 4  # that are gone at most, each from another effect that passes the first round


def by_other_ways(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Return the model that the global search, or another beginning, extends further; or the same.

    Parameters
    ----------
    start : the model as given.
    extended : with what the straight way has added.
    task : what is asked.
    """
    return _by_another_beginning(start, _searched_globally(start, extended, task), task)


def _searched_globally(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Look through all shapes where a residual remains, and extend again with what was missed."""
    if not task.most or (start.loop.runs and extended.fitted.noise_known):
        return extended
    first = replace(start, rounds=extended.rounds[:1])
    if start.loop.runs:
        first = extended  # simulated motions are renewed as the model grows: there is no way back
    elif extended.doubtful:  # both branches are to be judged on the same rows
        start = left_out(start, extended.doubtful)
        first = rank_stage(replace(start, rounds=()), task)
    missed = global_search(first.ranked, extended.ranked, task.progress)
    if missed is None:
        return extended
    base = extended
    if missed.fitted is not extended.fitted:
        # What was kept of the first ranking belongs to the other branch.
        base = replace(first, evidence=start.evidence.looked_at_anew())
    other = extend(replace(base, rounds=(*base.rounds[:-1], missed.ranking)), task)
    better = other.fitted.misfit(start.start) < extended.fitted.misfit(start.start)
    return other if better and set(other.doubtful) == set(extended.doubtful) else extended


def _by_another_beginning(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Begin with another effect where a residual remains, and extend the model from there.

    Which of several that pass is there, and which imitates a sum of others, the first round may not
    tell. What is left beside it, and what else then explains that, does: a spring is first seen as
    the offset in it, and beside an offset its joint's rotor is not.
    """
    known = extended.fitted.noise_known and not start.loop.runs
    if not known or _is_enough(extended):
        return extended
    best, latest, refused = extended, extended, {}
    most = _MUCH_LESS * extended.fitted.misfit(start.start)
    for _ in range(_WAYS):
        if not latest.found:
            break
        begun = latest.found[0].score.effect.label
        refused[begun] = "asked again beside others, which leave less"
        ranking = extended.rounds[0].refusing(refused)
        if not ranking.passing:
            break
        task.progress(f"going another way than by {begun}")
        latest = extend(replace(start, rounds=(ranking,)), task)
        left = latest.fitted.misfit(start.start)
        if left < most and set(latest.doubtful) == set(extended.doubtful):
            best, most = latest, left
            if _is_enough(best):
                break
    return best


def _is_enough(stage: Stage) -> bool:
    """Whether nothing but noise is left of the training recordings."""
    trained = on_recordings(stage.evidence, stage.fitted)
    return within_noise(trained, stage.evidence.criteria.verdict)
