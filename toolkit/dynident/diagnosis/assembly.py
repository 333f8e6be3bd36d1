"""A search assembled into words and numbers: the `Diagnosis`.

In: what the search did (`Search`). Out: errors on held-out data before and after, the verdict, each
effect with the experiment that would show it or distinguish it, residual maps, estimates.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dynident.diagnosis.advice.experiments import Adviser
from dynident.diagnosis.answer import Verdict
from dynident.diagnosis.candidate_gains import candidate_gains
from dynident.diagnosis.dependence.bursts import beyond_reversals, burst_notes, bursts_in
from dynident.diagnosis.details import (
    Candidate,
    JointResult,
    Status,
    Step,
    TestError,
    Trace,
)
from dynident.diagnosis.detection_limits import DetectionLimit, detection_limits
from dynident.diagnosis.nuisances.contacts import Disturbance, contact_candidates
from dynident.diagnosis.nuisances.drifting_noise import drift_notes, drifts_in
from dynident.diagnosis.nuisances.quantisation import rounding_notes, with_rounding
from dynident.diagnosis.nuisances.sampling_time import sampling_time
from dynident.diagnosis.nuisances.stated_noise import stated_noise_notes
from dynident.diagnosis.nuisances.sticking import shares_left_out
from dynident.diagnosis.nuisances.unlike_recordings import training_notes, unlike_notes
from dynident.diagnosis.nuisances.unseen_rows import unseen_notes
from dynident.diagnosis.nuisances.width_notes import found_widths
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.search.paired_falls import fall_standard_error, largest_fall
from dynident.diagnosis.search.path import Path
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.refusal import impossible_joints_of
from dynident.diagnosis.verdict import (
    beyond_noise,
    notes_on,
    notes_on_steps,
    verdict_of,
    within_noise,
)
from dynident.evidence.evidence import Evidence, noise_source
from dynident.evidence.evidence_estimate import estimate_of
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut, on_recordings
from dynident.evidence.maps import residual_maps
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import rows_of_recordings, sources_of
from dynident.model import Model
from dynident.moments.repetition_drift import Drift
from dynident.recording import Dataset, RowCount
from dynident.recording.dataset import NoiseSource

_SHOWN = 10
"""Candidates in a table."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """What a search did: the evidence, the effects added, their fits, the ranking of each round.

    Attributes
    ----------
    disturbances : contacts, left out of the evidence.
    doubtful : joints whose reversals are left out as their dry friction may follow another law.
    notes : on its instruments, where they come from a simulation or could not.
    limit : effects that were allowed, where more of them pass every gate; None elsewhere.
    """

    evidence: Evidence
    path: Path
    rounds: tuple[Ranking, ...]
    disturbances: tuple[Disturbance, ...] = ()
    doubtful: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    limit: int | None = None


def assemble(
    search: Search, train: Dataset, test: Dataset | None, held: Evidence | None
) -> Diagnosis:
    """Put what a search found into words and numbers.

    Parameters
    ----------
    search : the search.
    train, test : the recordings, for their provenance.
    held : evidence of the test recordings; None where blocks of time are held out.

    Returns
    -------
    What is known of the model, effect by effect and joint by joint, and the verdict.
    """
    evidence, rounds, path = search.evidence, search.rounds, search.path
    judged, start, last = path.judged, path.stages[0], path.stages[-1]
    given = start.model
    rounded = test if test is not None and held is not None else train
    before = with_rounding(judged[0], start, rounded)
    after = with_rounding(judged[-1], last, rounded) if path.found else before
    helping = [one for one in search.disturbances if one.error_after <= one.error_before]
    contacts = [one.step(given) for one in helping]
    first_error = contacts[0].test_error_before if contacts else before.error
    steps = (*contacts, *_advised(_steps_of(path, evidence), Adviser.of(evidence, last)))
    source = noise_source(evidence, held)
    trained = with_rounding(on_recordings(evidence, last), last, train)
    names, units, judging = given.robot.names, given.robot.torque_units, evidence.criteria.verdict
    bursts = bursts_in(beyond_reversals(trained, last.model, last.values), names, units, judging)
    verdict = verdict_of(before, after, trained, steps, rounds[-1], judging, bursts)
    final = estimate_of(evidence, last, train)
    impossible = _impossible(verdict, evidence, final)
    verdict = "unexplained" if impossible else verdict
    widths, drifts = found_widths(evidence, last), drifts_in(evidence, last)
    # Where a law is missing, a delay may be no more than a part of it.
    most_of_it = judging.most_explained if verdict == "unexplained" else 0.0
    pushed = contact_candidates(given, evidence, search.disturbances)
    gains, last_gains = _gains(search, held, before.error, after.error)
    first = _merged(_candidates(rounds[0], gains), pushed)
    return Diagnosis(
        verdict=verdict,
        noise_source=source,
        joints=_joint_results(given, before, after),
        test_error=TestError(before=first_error, after=after.error, noise_floor=after.floor),
        steps=steps,
        candidates=_revealed(first, evidence, start),
        remaining=_candidates(rounds[-1], last_gains),
        before=estimate_of(evidence, start, train),
        after=final,
        maps=residual_maps(given, before, after, evidence.criteria),
        traces=_traces(given, before, after),
        notes=(
            *(one.sentence(given) for one in helping),
            *notes_on(evidence, held, last, source, search.doubtful),
            *widths.notes,
            *_differing_recordings(trained, after, evidence, held, last),
            *_noise_doubts(evidence, source, rounded, after, drifts),
            *burst_notes(bursts_in(trained, names, units, judging), bursts),
            *rounding_notes(after, given.robot.names, judging),
            *notes_on_steps(steps, held),
            *unseen_notes(evidence, last, tuple(step.effect.label for step in steps)),
            *path.notes,
            *search.notes,
        ),
        test_sources=sources_of(test) if test is not None else (),
        criteria=evidence.criteria,
        impossible=impossible,
        withdrawn=path.withdrawn,
        rows=sum(map(rows_of_recordings, filter(None, (train, test))), RowCount()),
        limit=search.limit,
        detection_limits=_limits(search, held, trained, verdict),
        sampled=sampling_time(evidence, last, rounds[-1], least_share=most_of_it),
        training_only=_training_only(verdict, trained, after, evidence),
        bursts=tuple(bursts),
        drifting=tuple(one.joint for one in drifts),
        friction_widths=widths.to_state,
        reversals_left_out=_shares(search, search.doubtful),
        stops_left_out=_shares(search, set(given.robot.names) - set(search.doubtful)),
    )


def _impossible(verdict: Verdict, evidence: Evidence, final: Estimate) -> tuple[str, ...]:
    """What no robot can have, where the verdict would be that the model is complete."""
    if verdict == "unexplained":
        return ()
    return impossible_joints_of(evidence, final.model, final.values, final.covariance)


def _limits(
    search: Search, held: Evidence | None, trained: HeldOut, verdict: Verdict
) -> tuple[DetectionLimit, ...]:
    """How large effects could have been unseen; what was found, and withdrawn, is no limit."""
    if search.path.withdrawn or verdict != "nothing_missing":
        return ()
    return detection_limits(search.evidence, held, search.path.final, search.rounds[-1], trained)


def _shares(search: Search, joints: Collection[str]) -> dict[str, float]:
    """Shares of the rows of some joints that are left out around their reversals."""
    every = shares_left_out(search.evidence).items()
    return {joint: share for joint, share in every if joint in joints}


def _steps_of(path: Path, evidence: Evidence) -> tuple[Step, ...]:
    """The effects of a path, each with the fall of the error that it brings."""
    names, together = path.final.model.robot.names, evidence.criteria.search.set_block
    return tuple(
        Step(
            effect=path.final.model.effect(one.score.effect.label),
            values=tuple(stage.values[stage.model.slices[one.score.effect.label]]),
            test_error_before=old.error,
            test_error_after=new.error,
            indistinguishable=one.indistinguishable,
            p_value=one.p_value,
            fall_standard_error=fall_standard_error(old, new, together),
            at_joint=largest_fall(names, old, new, together),
        )
        for one, stage, (old, new) in zip(
            path.found, path.stages[1:], pairwise(path.judged), strict=True
        )
    )


def _gains(
    search: Search, held: Evidence | None, before: float, after: float
) -> tuple[dict[str, float], dict[str, float]]:
    """What candidates take off the errors of the model as given, and of the final one."""
    evidence, rounds, stages = search.evidence, search.rounds, search.path.stages
    known = _of_the_first_step(search)
    first = candidate_gains(rounds[0], evidence, held, stages[0], before, _SHOWN, known=known)
    known = first if len(rounds) == len(stages) == 1 else {}  # asked of the same fit
    last = candidate_gains(rounds[-1], evidence, held, stages[-1], after, 0, known=known)
    return first, last


def _of_the_first_step(search: Search) -> dict[str, float]:
    """What the first step takes off, where it adds no more than the candidate that was ranked."""
    path = search.path
    if not path.found:
        return {}
    label, (start, after, *_) = path.found[0].score.effect.label, path.stages
    ranked = next((one for one in search.rounds[0].scores if one.effect.label == label), None)
    same_widths = np.array_equal(start.model.friction_widths, after.model.friction_widths)
    if ranked is None or not same_widths or ranked.effect.is_dynamic_response:
        return {}
    if after.model.effect(label).shape != ranked.effect.shape:
        return {}
    before, error = (one.error for one in path.judged[:2])
    return {label: before - error}


def _differing_recordings(
    trained: HeldOut, after: HeldOut, evidence: Evidence, held: Evidence | None, final: EvidenceFit
) -> tuple[str, ...]:
    """Say what only the test recordings show, and what only those do that were fitted."""
    if held is None:
        return ()
    names, criteria = evidence.model.robot.names, evidence.criteria.verdict
    unlike = unlike_notes(evidence, held, final)
    return (*unlike, *training_notes(trained, after, names, criteria))


def _training_only(
    verdict: Verdict, trained: HeldOut, after: HeldOut, evidence: Evidence
) -> tuple[str, ...]:
    """Joints for which alone the verdict is that something is left; none for other verdicts."""
    criteria = evidence.criteria.verdict
    if verdict != "unexplained" or after.least_ratio is None or not within_noise(after, criteria):
        return ()
    there = beyond_noise(trained, criteria)
    return tuple(
        name for name, is_there in zip(evidence.model.robot.names, there, strict=True) if is_there
    )


def _noise_doubts(
    evidence: Evidence,
    source: NoiseSource,
    recordings: Dataset,
    after: HeldOut,
    drifts: tuple[Drift, ...],
) -> tuple[str, ...]:
    """Say what drifts in it; hold it, where it is stated, against the recordings judged by it."""
    if source != "given":
        return drift_notes(drifts)
    units = evidence.model.robot.torque_units
    return stated_noise_notes(after, recordings, units, evidence.criteria.verdict.most_left)


def _advised(steps: tuple[Step, ...], adviser: Adviser) -> tuple[Step, ...]:
    """Say which experiment would distinguish an effect from those that explain the same."""
    return tuple(
        replace(one, advice=adviser.separating((one.effect, *one.indistinguishable), one.values))
        if one.indistinguishable
        else one
        for one in steps
    )


def _revealed(
    candidates: tuple[Candidate, ...], evidence: Evidence, fitted: EvidenceFit
) -> tuple[Candidate, ...]:
    """Say which experiment would show what is not identifiable."""
    if not any(one.status == "absorbed" for one in candidates):
        return candidates
    adviser = Adviser.of(evidence, fitted)
    return tuple(
        replace(one, remark=adviser.revealing(one.effect)) if one.status == "absorbed" else one
        for one in candidates
    )


def _merged(found: tuple[Candidate, ...], pushed: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """Contacts that were found first, those that were not after everything else."""
    first = tuple(one for one in pushed if one.status == "material")
    return (*first, *found, *(one for one in pushed if one.status != "material"))


def _joint_results(given: Model, before: HeldOut, after: HeldOut) -> tuple[JointResult, ...]:
    def at(values: np.ndarray | None, j: int) -> float | None:
        return None if values is None else float(values[j])

    return tuple(
        JointResult(
            name=name,
            torque_unit=unit,
            error_before=float(before.joint_errors[j]),
            error_after=float(after.joint_errors[j]),
            torque_rms=float(before.torque_rms[j]),
            noise_rms=at(after.noise_std, j),
            ratio_before=at(before.ratio, j),
            ratio_after=at(after.ratio, j),
        )
        for j, (name, unit) in enumerate(
            zip(given.robot.names, given.robot.torque_units, strict=True)
        )
    )


def _candidates(ranking: Ranking, gains: Mapping[str, float]) -> tuple[Candidate, ...]:
    found = []
    for score, refusal in zip(ranking.scores, ranking.refusals, strict=True):
        status: Status = (
            "absorbed" if score.not_identifiable else "not_material" if refusal else "material"
        )
        found.append(
            Candidate(
                effect=score.effect,
                status=status,
                p_value=None if score.not_identifiable else ranking.corrected(score),
                test_gain=gains.get(score.effect.label),
                values=score.values,
                remark=refusal,
            )
        )
    return tuple(found)


def _traces(given: Model, before: HeldOut, after: HeldOut) -> tuple[Trace, ...]:
    robot = given.robot
    return tuple(
        Trace(
            recording=old.name,
            joint=name,
            torque_unit=unit,
            t=old.t,
            measured=old.measured[:, j],
            before=old.predicted[:, j],
            after=new.predicted[:, j],
        )
        for old, new in zip(before.runs, after.runs, strict=True)
        for j, (name, unit) in enumerate(zip(robot.names, robot.torque_units, strict=True))
    )
