"""A diagnosis with what its residual depends on, and its verdict where noise alone cannot be left.

Where nothing repeats, nothing tells the noise of what is left. But noise of the torque does not
come again at the same position and velocity, nor at the same speeds of all joints, and it does not
go with what errors of the measured positions would make: a residual that functions of these
predict, on blocks of time that they were not fitted to, is no noise, whatever its size. Asked is
the residual of the fit itself, of which its own columns leave nothing: what errors of the
parameters make of a test recording is a function of the motion too. Nothing is said where what is
left hangs together for longer than a small part of the recordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dynident.diagnosis.dependence.motion_blocks import FEWEST_BLOCKS, independent_stretches
from dynident.diagnosis.dependence.residual_dependence import (
    MOTION,
    MOTION_FIRST,
    JointDependence,
    residual_dependence,
)
from dynident.diagnosis.dependence.residual_record import (
    ResidualRecord,
    joined,
    residual_records,
)
from dynident.diagnosis.nuisances.friction_width import at_best_widths
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.search.path import Path
from dynident.diagnosis.search.payload_recordings import marked
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import HeldOut, on_blocks, on_recordings


def with_dependence(
    found: Diagnosis,
    evidence: Evidence,
    held: Evidence | None,
    path: Path,
) -> Diagnosis:
    """Return a diagnosis that says what its residual depends on.

    Without a noise floor that is the residual, and the regression, by which `doubted` judges.

    Parameters
    ----------
    found : the diagnosis so far.
    evidence, held : of the training and of the test recordings; `held` may be None.
    path : to the model that was reached.

    Returns
    -------
    With `residual_dependence`.
    """
    if found.noise_source == "unknown":
        return replace(found, residual_dependence=_of_fit(evidence, path.final))
    judged, fitted = path.judged[-1], path.final
    records = residual_records(judged, (held or evidence).runs, fitted)
    if held is not None:
        # Of the training recordings blocks of time that the model was not fitted to.
        blocks = on_blocks(evidence, fitted)
        records = (*records, *residual_records(blocks, evidence.runs, fitted))
    names, criteria = fitted.model.robot.names, evidence.criteria.verdict
    shares = residual_dependence(judged, joined(records), names, criteria)
    return replace(found, residual_dependence=shares)


def doubted(
    found: Diagnosis, evidence: Evidence, narrow: Sequence[Evidence], path: Path
) -> Diagnosis:
    """Return a diagnosis that explains nothing where what it took for noise follows the motion.

    Parameters
    ----------
    found : the diagnosis so far, without a noise floor.
    evidence : of the training recordings, marked with those that carry a payload.
    narrow : the same behind lower cut-offs, where noise in the columns is unknown: with biased
        parameters the residual follows the motion too, but not behind every filter.
    path : to the model that was reached.

    Returns
    -------
    As it is, unless the verdict is another; one that explains nothing stays, with its reason.
    """
    if found.verdict == "unexplained":
        return found
    follow = _following(evidence, path.final)
    if follow:
        # Dry friction that reverses over another width than stated is nothing that is missing.
        other = at_best_widths(evidence, path.final, follow)
        follow = _both(follow, _following(evidence, other)) if other is not path.final else follow
    payloads = [run.recording.payload for run in evidence.runs]
    for one in narrow:
        if follow:
            lower = marked(one, payloads)
            follow = _both(follow, _following(lower, fit_evidence(lower, path.final.model)))
    if not follow:
        return found
    return replace(
        found, verdict="unexplained", following_motion=tuple(follow), detection_limits=()
    )


def _both(one: dict[str, set[str]], other: dict[str, set[str]]) -> dict[str, set[str]]:
    """Inputs at each joint that are in both."""
    found = {joint: inputs & other.get(joint, set()) for joint, inputs in one.items()}
    return {joint: inputs for joint, inputs in found.items() if inputs}


def _following(evidence: Evidence, fitted: EvidenceFit) -> dict[str, set[str]]:
    """Which inputs of the motion predict what a fit leaves, of joints where any does."""
    judged, criteria = on_recordings(evidence, fitted), evidence.criteria.verdict
    records, names = _along(judged, evidence, fitted), fitted.model.robot.names
    found = {
        one.joint: set(one.of_the_motion(criteria))
        for one in residual_dependence(judged, records, names, criteria, MOTION)
        if independent_stretches(records, names.index(one.joint)) >= FEWEST_BLOCKS
    }
    return {joint: inputs for joint, inputs in found.items() if inputs}


def _of_fit(evidence: Evidence, fitted: EvidenceFit) -> tuple[JointDependence, ...]:
    """What a fit leaves of the data that it was fitted to, by what it depends on."""
    judged, criteria = on_recordings(evidence, fitted), evidence.criteria.verdict
    records, names = _along(judged, evidence, fitted), fitted.model.robot.names
    return residual_dependence(judged, records, names, criteria, MOTION_FIRST)


def _along(judged: HeldOut, evidence: Evidence, fitted: EvidenceFit) -> tuple[ResidualRecord, ...]:
    """What a fit leaves of the data that it was fitted to, along its recordings."""
    return joined(residual_records(judged, evidence.runs, fitted))
