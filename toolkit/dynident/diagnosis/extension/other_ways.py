"""Other ways to extend a model, where the straight one leaves a residual beyond the noise."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from dynident.diagnosis.extension.extending import (
    extend,
    joins,
    rank_stage,
    tried,
    with_one_more,
)
from dynident.diagnosis.extension.reversals import left_out
from dynident.diagnosis.extension.stage import DiagnosisTask, Stage
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.search.global_search import global_search, may_be_elsewhere
from dynident.diagnosis.search.ranking import Ranking, unresolved
from dynident.diagnosis.search.refusal import newly_impossible
from dynident.diagnosis.search.selection import AddedEffect
from dynident.diagnosis.search.shaped_fit import sought_about
from dynident.diagnosis.verdict import within_noise
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import on_recordings

_MUCH_LESS = 0.5
"""Of what a model leaves, beyond the noise, that another must not leave to take its place."""
_MOST_OF_IT = 0.25
"""Part of what one effect leaves that another has to explain, with a shape of its grid, to be
looked at more closely: with its best shape it would have to explain nearly all. What lies far
between the shapes of its grid, a ripple that does not come a whole number of times a turn, is not
found so."""
_WAYS = 4  # that are gone at most, each from another effect of the first round


def by_other_ways(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Return the model that other shapes, or another beginning, extend further; or the same.

    Parameters
    ----------
    start : the model as given.
    extended : with what the straight way has added.
    task : what is asked.
    """
    for way in (_with_other_shapes, _searched_globally, _by_another_beginning, _by_two_at_once):
        extended = way(start, extended, task)
    return extended


def _with_other_shapes(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Seek what was added about its shape, where a residual is left, and extend the model again."""
    if start.loop.runs:  # simulated motions are renewed as the model grows
        return extended
    evidence, fitted = extended.evidence, extended.fitted
    for label in [one.score.effect.label for one in extended.found]:
        effect = fitted.model.effect(label)
        if may_be_elsewhere(evidence, fitted, effect):
            task.progress(f"{label}, at other shapes")
            other = with_friction_width(evidence, sought_about(evidence, fitted, effect))
            why = newly_impossible(evidence, extended.fitted, other)
            fitted = fitted if why or unresolved(evidence, other, label) else other
    if not fitted.misfit(start.start) < extended.fitted.misfit(start.start):
        return extended
    better = replace(extended, fitted=fitted, rounds=extended.rounds[:-1])
    return extend(rank_stage(better, task), task)


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
    base = extended if missed.fitted is extended.fitted else first
    headed = replace(base, rounds=(*base.rounds[:-1], missed.ranking))
    other = extend(headed, task)
    better = other.fitted.misfit(start.start) < extended.fitted.misfit(start.start)
    return other if better and set(other.doubtful) == set(extended.doubtful) else extended


def _by_another_beginning(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Begin with another effect where a residual remains, and extend the model from there.

    Which of several that pass is there, and which imitates a sum of others, the first round may not
    tell. What is left beside it, and what else then explains that, does: a spring is first seen as
    the offset in it, and beside an offset its joint's rotor is not.
    """
    if not _leaves_a_residual(start, extended):
        return extended
    best, latest, refused, visited = extended, extended, {}, extended.visited
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
        latest = extend(_from(start, ranking), task, visited)
        if joins(latest, visited):  # from there it ends where the other way has ended
            continue
        visited = (*visited, *latest.visited)
        left = latest.fitted.misfit(start.start)
        if left < most and set(latest.doubtful) == set(extended.doubtful):
            best, most = latest, left
            if _is_enough(best):
                break
    return _with_first_round(best, extended)


def _by_two_at_once(start: Stage, extended: Stage, task: DiagnosisTask) -> Stage:
    """Begin with what is not significant alone, and see whether it is beside what comes next.

    What one of two missing effects leaves is noise to the other: neither may be seen without it.
    What came first is taken out again, and the model extended the straight way from what came after
    it. That counts if nothing is left then, of the test recordings neither.
    """
    if task.most < 2 or not _leaves_a_residual(start, extended):
        return extended
    first, doubtful = extended.rounds[0], set(extended.doubtful)
    straight = {one.score.effect.label for one in extended.found[:1]}
    passing = {one.effect.label for one in first.passing}
    alone = [one for one in first.scores if one.effect.label not in passing and one.drop > 0.0]
    begun = [one for one in alone if not one.not_identifiable][:_WAYS]
    for number, one in enumerate(begun, 1):
        task.progress(f"beginning with {one.effect.label}, whatever its significance")
        pair = _beside_another(_from(start, first), AddedEffect(one, 1.0, ()), straight, task)
        if pair is None or set(pair.doubtful) != doubtful or not _is_enough(pair):
            continue
        both = _without_its_first(pair, task)
        alike = set(both.doubtful) == doubtful and _is_relevant(both)
        if alike and _is_enough(both) and _is_enough_for_others(both):
            # As many beginnings are as many searches.
            found = (replace(f, p_value=min(1.0, number * f.p_value)) for f in both.found)
            return _with_first_round(replace(both, found=tuple(found)), extended)
    return extended


def _beside_another(
    start: Stage, begun: AddedEffect, straight: Set[str], task: DiagnosisTask
) -> Stage | None:
    """Return the model with an effect, and what is significant beside it.

    None where nothing is, or only that from which the straight way went already, by its label.
    """
    with_it, refused = tried(start, begun, task)
    if refused:
        return None
    ranked = rank_stage(with_it, task, worth=_MOST_OF_IT)
    if all(one.effect.label in straight for one in ranked.rounds[-1].passing):
        return None
    pair = with_one_more(ranked, task)
    new = {one.score.effect.label for one in pair.found} - {begun.score.effect.label}
    return pair if pair.proposals == 2 and not new & straight else None


def _from(start: Stage, ranking: Ranking) -> Stage:
    """The model as given with another first round."""
    return replace(start, rounds=(ranking,))


def _with_first_round(stage: Stage, extended: Stage) -> Stage:
    """A stage with the first round as it was: what was refused for another way was not, there."""
    return replace(stage, rounds=(extended.rounds[0], *stage.rounds[1:]))


def _without_its_first(stage: Stage, task: DiagnosisTask) -> Stage:
    """Take out what was added first, and extend the model from what came after it."""
    first, *others = stage.found
    label = first.score.effect.label
    effect = stage.fitted.model.effect(label)
    rest = fit_evidence(stage.evidence, stage.fitted.model - effect, stage.fitted)
    without = replace(stage, fitted=rest, found=tuple(others), refused={})
    return extend(rank_stage(without, task), task)


def _is_relevant(stage: Stage) -> bool:
    """Whether the effect that comes first explains what a first one has to."""
    least = stage.evidence.criteria.gates.first_share
    return bool(stage.found) and stage.found[0].score.share >= least


def _leaves_a_residual(start: Stage, extended: Stage) -> bool:
    """Whether more than a known noise is left, and models can be compared from the start."""
    return extended.fitted.noise_known and not start.loop.runs and not _is_enough(extended)


def _is_enough_for_others(stage: Stage) -> bool:
    """Whether nothing but noise is left of the test recordings, where there are any."""
    judging = stage.judging
    return judging is None or _leaves_noise(judging, stage)


def _is_enough(stage: Stage) -> bool:
    """Whether nothing but noise is left of the training recordings."""
    return _leaves_noise(stage.evidence, stage)


def _leaves_noise(evidence: Evidence, stage: Stage) -> bool:
    return within_noise(on_recordings(evidence, stage.fitted), evidence.criteria.verdict)
