"""Whether what is measured as noise drifts from repetition to repetition.

Noise makes any two repetitions differ alike. What changes in the course of a recording, friction
that warms up or the zero of a sensor, makes those differ most that lie farthest apart, and counts
as noise all the same: what is said to be within the noise is then within that.

Source: the linear contrast of ordered groups in the analysis of variance, N. R. Draper and
H. Smith, "Applied Regression Analysis" (1998), with the correlation of consecutive rows accounted
for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from dynident.tables import listed, number

_LEVEL = 1e-3
"""At which a joint's noise drifts, over all joints."""
_MOST = 0.5
"""Share of the noise's variance that drifts from which on it is told: the greater part."""
_LAGS = 20  # rows up to which noise is correlated


@dataclass(frozen=True, eq=False, kw_only=True)
class DriftSums:
    """What repetitions of recordings do not share, in proportion to the time and else, summed.

    Attributes
    ----------
    trend, rest : (n,) sums of squares of each joint's residual, (N m)^2 or N^2.
    rows, many : (n,) degrees of freedom of the two, were rows independent.
    lagged : (lags, n) products of the rest with itself so many rows later.
    """

    trend: np.ndarray
    rest: np.ndarray
    rows: np.ndarray
    many: np.ndarray
    lagged: np.ndarray

    @classmethod
    def of(cls, folded: np.ndarray, counting: np.ndarray) -> DriftSums | None:
        """Return the sums of one recording.

        Parameters
        ----------
        folded : residuals (P, S, n) of its repetitions, N m or N.
        counting : (S, n) rows that count in every repetition.

        Returns
        -------
        None of two repetitions, whose difference is all that there is.
        """
        repetitions, length, n = folded.shape
        if repetitions < 3:
            return None
        place = np.linspace(-1.0, 1.0, repetitions)
        place /= np.linalg.norm(place)
        centred = (folded - folded.mean(axis=0)) * counting
        slope = np.einsum("p,psj->sj", place, centred)
        left = centred - place[:, None, None] * slope
        lagged = np.zeros((_LAGS, n))
        for lag in range(1, min(_LAGS, length - 1) + 1):
            lagged[lag - 1] = np.sum(left[:, :-lag] * left[:, lag:], axis=(0, 1))
        rows = counting.sum(axis=0)
        return cls(
            trend=np.sum(slope**2, axis=0),
            rest=np.sum(left**2, axis=(0, 1)),
            rows=rows,
            many=(repetitions - 2) * rows,
            lagged=lagged,
        )

    def __add__(self, other: DriftSums) -> DriftSums:
        """The sums of more recordings."""
        return DriftSums(
            trend=self.trend + other.trend,
            rest=self.rest + other.rest,
            rows=self.rows + other.rows,
            many=self.many + other.many,
            lagged=self.lagged + other.lagged,
        )

    def drifts(self, joints: Sequence[str], units: Sequence[str]) -> tuple[Drift, ...]:
        """Return what drifts beyond chance, and is the greater part of a joint's noise.

        Parameters
        ----------
        joints, units : n names, and units of their torques.
        """
        found = []
        for j, (joint, unit) in enumerate(zip(joints, units, strict=True)):
            if not (self.rest[j] > 0 and self.rows[j] > 0):
                continue
            noise = (self.trend[j] + self.rest[j]) / (self.rows[j] + self.many[j])
            steady = self.rest[j] / self.many[j]
            # Products of correlated noise are correlated, too: as the square.
            alike = max(1.0, 1.0 + 2.0 * float(np.sum((self.lagged[:, j] / self.rest[j]) ** 2)))
            ratio = self.trend[j] / self.rows[j] / steady
            chance = fdtrc(self.rows[j] / alike, self.many[j] / alike, ratio)
            if chance * len(joints) < _LEVEL and noise - steady > _MOST * noise:
                sizes = {"noise": float(noise**0.5), "steady": float(steady**0.5)}
                found.append(Drift(joint=joint, unit=unit, **sizes))
        return tuple(found)


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


def drift_in_words(drifts: Sequence[Drift]) -> str:
    """What drifts, two sentences; empty for none."""
    if not drifts:
        return ""
    each = [
        f"{number(one.noise, 2)} {one.unit} at {one.joint} ({number(one.steady, 2)} without)"
        for one in drifts
    ]
    return (
        "Repetitions differ the more, the longer they lie apart: something drifts in the course of "
        "a recording, such as friction that warms up or the zero of a sensor, or noise is slow "
        f"beside a repetition. It counts as noise: {listed(each)}."
    )
