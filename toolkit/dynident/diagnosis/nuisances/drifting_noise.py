"""Whether what the final model leaves, and counts as noise, drifts in the course of recordings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add

from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.moments.repetition_drift import Drift, DriftSums, drift_in_words


def drifts_in(evidence: Evidence, fitted: EvidenceFit) -> tuple[Drift, ...]:
    """Find the joints at which repetitions differ the more, the longer they lie apart.

    Parameters
    ----------
    evidence : the training recordings; those of three repetitions and more tell it.
    fitted : the final model.

    Returns
    -------
    Joints at which that is beyond chance, and the greater part of the noise.
    """
    robot = fitted.model.robot
    left = residuals(evidence, fitted.model, fitted.values)
    sums = [
        DriftSums.of(one, run.certain_instants)
        for run, one in zip(evidence.runs, left, strict=True)
        if run.kind == "repeated"
    ]
    found = [one for one in sums if one is not None]
    return reduce(add, found).drifts(robot.names, robot.torque_units) if found else ()


def drift_notes(drifts: Sequence[Drift]) -> tuple[str, ...]:
    """Say what drifts, in plain words.

    Parameters
    ----------
    drifts : as from `drifts_in`.

    Returns
    -------
    Some sentences, or none.
    """
    if not drifts:
        return ()
    more = "What is said to be within the noise may be smaller than that alone."
    return (f"{drift_in_words(drifts)} {more}",)
