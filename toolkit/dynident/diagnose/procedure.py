"""The loop: compare, find what is missing, add it, fit again, compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.diagnose.diagnosis import (
    Candidate,
    Diagnosis,
    JointResult,
    NoiseSource,
    Status,
    Step,
    TestError,
    Trace,
    Verdict,
)
from dynident.diagnose.evidence import ColumnStore, Run, gather
from dynident.diagnose.held_out import HeldOut, on_blocks, on_recordings
from dynident.diagnose.maps import residual_maps
from dynident.diagnose.present import Present, fit_present, residuals
from dynident.diagnose.scoring import Score
from dynident.diagnose.search import (
    Ranking,
    candidates,
    indistinguishable,
    rank,
    refined,
    variants,
)
from dynident.effects import Effect
from dynident.fit.estimate import Estimate
from dynident.fit.least_squares import RANK_TOLERANCE, sources_of
from dynident.fit.sampling import flagged
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import base_parameters
from dynident.threads import single_threaded

MOST_EFFECTS = 8
"""Effects that are added at most."""

WITHIN_NOISE = 0.3
"""Systematic residual over noise that must be surpassed, with 99 % confidence, before anything is
said to be missing."""

_FIRST_SHARE = 0.75  # of an effect's drop that a simpler one in it explains, to be named first
_STANDS = 3.0  # standard deviations from zero of a parameter that stands on its own


@dataclass(frozen=True)
class _Found:
    """An effect that the search has added, with what was said of it then."""

    score: Score
    p_value: float
    indistinguishable: tuple[Effect, ...]


@single_threaded
def diagnose(
    model: Model | Estimate,
    train: Dataset,
    test: Dataset | None = None,
    *,
    most: int = MOST_EFFECTS,
    tell: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find where a model fails and which physical effects it lacks.

    Parameters
    ----------
    model : the model as given (or an estimate of it: it is fitted anew, with instruments where
        the motion repeats).
    train : recordings to fit.
    test : recordings to judge by; without any, blocks of the training recordings are held out.
    most : effects that are added at most.
    tell : told what is being done, for a progress display.

    Raises
    ------
    RecordingError
        If a recording is too short, or does not repeat with its period.
    """
    given = model.model if isinstance(model, Estimate) else model
    tell("reading the motion")
    store = ColumnStore(given, gather(train))
    held = ColumnStore(given, gather(test)) if test is not None and len(test) else None
    tell("evaluating every effect")
    everything = [v for effect in candidates(given) for v in variants(effect, given)]
    store.prepare([*given.effects, *everything])
    start = fit_present(store, given)
    rounds = [rank(store, start, 0, tell)]
    present, found = start, []
    while len(found) < most:
        chosen = _choose(rounds[-1])
        if chosen is None:
            break
        tell(f"adding {chosen.score.effect.label}")
        found.append(chosen)
        _carry(store, chosen.score)
        present = _refitted(store, present.model + chosen.score.effect)
        rounds.append(rank(store, present, len(found), tell))
        found[-1] = _alternatives_only(chosen, rounds[-1])
    present, found = _without_superfluous(store, given, present, found, tell)
    return _told(given, train, store, held, start, present, found, rounds)


def _choose(ranking: Ranking) -> _Found | None:
    """The best material effect; or the simpler one in it, where that does most of the work."""
    material = ranking.material
    if not material:
        return None
    best = material[0]
    simpler = [
        s
        for s in material
        if s.effect.name in best.effect.stands_in_for
        and s.effect.joint == best.effect.joint
        and s.drop >= _FIRST_SHARE * best.drop
    ]
    if simpler:
        # The column that they share is the same whoever it belongs to: both are named.
        return _Found(simpler[0], ranking.corrected(simpler[0]), (best.effect,))
    return _Found(best, ranking.corrected(best), indistinguishable(ranking, best))


def _alternatives_only(one: _Found, following: Ranking) -> _Found:
    """Leave out effects that stay material beside the one added: they are more, not instead."""
    still = {s.effect.label for s in following.material}
    alternatives = tuple(
        e
        for e in one.indistinguishable
        if e.label not in still or one.score.effect.name in e.contains
    )
    return replace(one, indistinguishable=alternatives)


def _carry(store: ColumnStore, score: Score) -> None:
    """Mark the runs that carry the payload, once that is known."""
    if score.carriers is not None:
        store.runs = tuple(
            _flagged(run, carries) for run, carries in zip(store.runs, score.carriers, strict=True)
        )


def _flagged(run: Run, carries: bool) -> Run:
    return replace(run, versions=tuple(flagged(v, carries) for v in run.versions))


def _refitted(store: ColumnStore, model: Model) -> Present:
    """Fit a model, each shape parameter refined with the others as they are."""
    present = fit_present(store, model)
    shaped = [e for e in model.effects if e.shape_parameters(model.robot)]
    if len(shaped) < 2:
        return present
    for effect in shaped:
        others = fit_present(store, present.model - effect)
        better = refined(store, others, Score(effect, None, absorbed=False, drop=1e-300))
        present = fit_present(store, present.model.with_shapes((better.effect,)))
    return present


def _without_superfluous(store, given: Model, present: Present, found: list[_Found], tell):
    """Drop every added effect that the others have made superfluous."""
    kept = list(found)
    for one in found:
        if len(kept) < 2 or _belongs(one.score.effect, kept):
            continue
        effect = next(e for e in present.model.effects if e.label == one.score.effect.label)
        rest = fit_present(store, present.model - effect)
        tell(f"doing without {effect.label}")
        if not rank(store, rest, len(kept) - 1, only=(effect,)).material:
            kept.remove(one)
            present = rest
    return present, kept


def _belongs(effect: Effect, found: list[_Found]) -> bool:
    """Whether an effect is part of another one: without it the other would bring it back."""
    others = (one.score.effect for one in found)
    return any(effect.name in o.contains and effect.joint == o.joint for o in others)


def _told(given, train, store, held, start, present, found, rounds) -> Diagnosis:
    """Put everything into words and numbers."""
    by_label = {e.label: e for e in present.model.effects}
    stages = [start]
    for one in found:
        stages.append(fit_present(store, stages[-1].model + by_label[one.score.effect.label]))
    if held is not None:
        held.prepare(present.model.effects)
        _decide_payload(held, stages[-1])
    judged = [on_recordings(held, s) if held else on_blocks(store, s) for s in stages]
    before, after = judged[0], judged[-1]
    steps = tuple(
        Step(
            by_label[one.score.effect.label],
            tuple(stage.values[stage.model.slices[one.score.effect.label]]),
            old.error,
            new.error,
            one.indistinguishable,
            one.p_value,
        )
        for one, stage, old, new in zip(found, stages[1:], judged[:-1], judged[1:], strict=True)
    )
    source = _noise_source(store)
    verdict = _verdict(before, after, steps, rounds[-1])
    return Diagnosis(
        verdict,
        source,
        _joint_results(given, before, after),
        TestError(before.error, after.error, after.floor),
        steps,
        _candidates(rounds[0], before.error, start),
        _candidates(rounds[-1], after.error, stages[-1]),
        _estimate(start, train, before),
        _estimate(stages[-1], train, after),
        residual_maps(given.robot, before, after),
        _traces(given, before, after),
        _notes(store, held, stages[-1], source),
    )


def _verdict(before: HeldOut, after: HeldOut, steps, last: Ranking) -> Verdict:
    if after.least_ratio is None:
        if last.material:
            return "unexplained"
        return "explained" if steps else "nothing_missing"
    if float(after.least_ratio.max()) <= WITHIN_NOISE:
        return "explained" if steps else "nothing_missing"
    return "unexplained"


def _noise_source(store: ColumnStore) -> NoiseSource:
    kinds = {run.kind for run in store.runs}
    if "repeated" in kinds:
        return "replicates"
    return "given" if "perturbed" in kinds else "unknown"


def _joint_results(given: Model, before: HeldOut, after: HeldOut) -> tuple[JointResult, ...]:
    def at(values: np.ndarray | None, j: int) -> float | None:
        return None if values is None else float(values[j])

    return tuple(
        JointResult(
            name,
            unit,
            float(before.joint_errors[j]),
            float(after.joint_errors[j]),
            float(before.torque_rms[j]),
            at(after.noise_std, j),
            at(before.ratio, j),
            at(after.ratio, j),
        )
        for j, (name, unit) in enumerate(
            zip(given.robot.names, given.robot.torque_units, strict=True)
        )
    )


def _candidates(ranking: Ranking, error: float, present: Present) -> tuple[Candidate, ...]:
    total = present.error_total
    found = []
    for score, refusal in zip(ranking.scores, ranking.refusals, strict=True):
        status: Status = "absorbed" if score.absorbed else "not_material" if refusal else "material"
        # Held out where it was cross-validated, else the drop less its price.
        gain = score.gains.sum() if score.gains is not None else score.penalised
        share = min(max(float(gain) / total, -1.0), 1.0) if np.isfinite(gain) else 0.0
        found.append(
            Candidate(
                score.effect,
                status,
                None if score.absorbed else ranking.corrected(score),
                error * (1.0 - float(np.sqrt(1.0 - share))),
                score.values,
                refusal,
            )
        )
    return tuple(found)


def _estimate(present: Present, train: Dataset, judged: HeldOut) -> Estimate:
    """The fit of the diagnosis as an `Estimate`."""
    total = present.moments.sums()[1][:-1, :-1]
    size, directions = np.linalg.eigh(total)
    root = np.sqrt(np.clip(size, 0.0, None))[:, None] * directions.T
    # A root of squares: half of the digits are gone.
    basis = base_parameters(root, present.model.names, max(RANK_TOLERANCE, 1e-6))
    kept = list(basis.independent)
    how = {
        "repeated": "instrumental variables from the repeated periods",
        "perturbed": "least squares corrected for the stated noise",
        "single": "least squares",
    }
    return Estimate(
        present.model,
        present.values,
        present.covariance,
        basis,
        judged.residual_rms,
        judged.joint_errors,
        judged.error,
        float(np.linalg.cond(root[:, kept])),
        present.rows,
        f"{how['repeated' if present.noise_known else 'single']}, noise whitened",
        "solved",
        (),
        sources_of(train),
    )


def _traces(given: Model, before: HeldOut, after: HeldOut) -> tuple[Trace, ...]:
    robot = given.robot
    return tuple(
        Trace(
            old.name,
            name,
            unit,
            old.t,
            old.measured[:, j],
            old.predicted[:, j],
            new.predicted[:, j],
        )
        for old, new in zip(before.runs, after.runs, strict=True)
        for j, (name, unit) in enumerate(zip(robot.names, robot.torque_units, strict=True))
    )


def _decide_payload(held: ColumnStore, present: Present) -> None:
    """Decide which test recordings carry a payload of known inertia, where the study is silent."""
    if not any("payload" in effect.needs for effect in present.model.effects):
        return
    stated = [run.recording.payload is not None for run in held.runs]
    sums = []
    for carries in (False, True):
        held.runs = tuple(
            run if said else _flagged(run, carries)
            for run, said in zip(held.runs, stated, strict=True)
        )
        misfits = residuals(held, present.model, present.values)
        sums.append([float(np.sum(e**2)) for e in misfits])
    held.runs = tuple(
        run if said else _flagged(run, with_load < without)
        for run, said, without, with_load in zip(held.runs, stated, *sums, strict=True)
    )


def _notes(store, held, present: Present, source: NoiseSource) -> tuple[str, ...]:
    notes = []
    if held is None:
        notes.append("No test recordings: errors are those of held-out blocks of time.")
    if source == "given":
        notes.append("The noise is the study's word, not measured: record a repeated motion.")
    if source == "unknown":
        notes.append(
            "Nothing repeats and no noise is stated: plain least squares, whose columns carry "
            "noise, and no noise floor. Small effects may be false; record a repeated motion."
        )
    if any("payload" in effect.needs for effect in present.model.effects):
        carriers = [r.recording.name for r in store.runs if r.recording.payload]
        carriers += [r.recording.name for r in (held.runs if held else ()) if r.recording.payload]
        notes.append(f"Payload carried in: {', '.join(carriers)}.")
    return tuple(notes)
