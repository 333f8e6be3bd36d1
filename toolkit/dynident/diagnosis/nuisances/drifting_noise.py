"""Whether what is measured as noise drifts from repetition to repetition.

Noise makes any two repetitions differ alike. What changes in the course of a recording, friction
that warms up or the zero of a sensor, makes those differ most that lie farthest apart, and counts
as noise all the same: what is said to be within the noise is then within that.

Source: the linear contrast of ordered groups in the analysis of variance, N. R. Draper and
H. Smith, "Applied Regression Analysis" (1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.evidence.noise_model import inflation
from dynident.tables import listed, number

_LEVEL = 1e-3
"""At which a joint's noise drifts, over all joints."""
_MOST = 0.5
"""Share of the noise's variance that drifts from which on it is told: the greater part."""


@dataclass(frozen=True, kw_only=True)
class Drift:
    """What drifts at one joint.

    Attributes
    ----------
    joint, unit : its name, and the unit of its torque.
    noise : standard deviation of what repetitions do not share, N m or N.
    steady : the same without what grows with their distance in time.
    """

    joint: str
    unit: str
    noise: float
    steady: float


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
    repeated = [
        (run, one)
        for run, one in zip(evidence.runs, left, strict=True)
        if run.kind == "repeated" and len(one) > 2
    ]
    found = []
    for j, (joint, unit) in enumerate(zip(robot.names, robot.torque_units, strict=True)):
        pairs = [_apart(one[:, run.certain(j), j]) for run, one in repeated]
        slopes, rest = [one for one, _ in pairs], [one for _, one in pairs]
        rows = sum(len(one) for one in slopes)
        many = sum((len(one) - 2) * len(one[0]) for one in rest)
        trend, others = (sum(float(np.sum(x**2)) for x in some) for some in (slopes, rest))
        if not others > 0:
            continue
        noise, steady = (trend + others) / (rows + many), others / many
        alike = inflation([x for one in rest for x in one], evidence.criteria.noise, power=2)
        chance = fdtrc(rows / alike, many / alike, trend / rows / steady)
        if chance * robot.n < _LEVEL and noise - steady > _MOST * noise:
            drift = Drift(joint=joint, unit=unit, noise=noise**0.5, steady=steady**0.5)
            found.append(drift)
    return tuple(found)


def drift_notes(drifts: Sequence[Drift]) -> tuple[str, ...]:
    """Say what drifts, in plain words.

    Parameters
    ----------
    drifts : as from `drifts_in`.

    Returns
    -------
    Two sentences, or none.
    """
    if not drifts:
        return ()
    each = (
        f"{number(one.noise, 2)} {one.unit} at {one.joint} ({number(one.steady, 2)} without)"
        for one in drifts
    )
    return (
        "Repetitions differ the more, the longer they lie apart: something drifts in the course of "
        "a recording, such as friction that warms up or the zero of a sensor, or noise is slower "
        f"than a repetition. It counts as noise: {listed(list(each))}. What is said to be within "
        "the noise may be smaller than that alone.",
    )


def _apart(folded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What repetitions (P, S) have in proportion to their place, (S,), and what else differs."""
    place = np.linspace(-1.0, 1.0, len(folded))
    place /= np.linalg.norm(place)
    centred = folded - folded.mean(axis=0)
    slope = place @ centred
    return slope, centred - np.outer(place, slope)
