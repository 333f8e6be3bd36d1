"""B-splines at rest where they begin and end, as linear functions of their variables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.closed_loop import BSpline
from dynident.closed_loop.splines import DEGREE, RESTING, spline_basis
from dynident.errors import DesignError
from dynident.experiment_design.motions.motion_family import MotionFamily


@dataclass(frozen=True, eq=False, kw_only=True)
class SplineMotions(MotionFamily):
    """B-splines of degree five whose first and last three points are the position at rest.

    What a point moves is local, in contrast to a harmonic: a motion may be slow for a while and
    fast for another. The amplitudes are the other points, less that position, in units of the
    largest speed times the length of an interval; the centre is the position at rest.

    Attributes
    ----------
    intervals : of the period, evenly long, 2 or more.
    """

    intervals: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2 <= self.intervals <= 200:
            raise DesignError(f"intervals = {self.intervals}", remedy="choose 2 to 200")

    @property
    def amplitudes(self) -> int:
        """Number of points that are free."""
        return self.intervals + DEGREE - 2 * RESTING

    @property
    def waves(self) -> int:
        """Of two intervals each: there and back."""
        return -(-self.intervals // 2)

    @property
    def unit(self) -> float:
        """Length of an interval, s."""
        return self.period / self.intervals

    def waveforms(self, t: np.ndarray) -> tuple[np.ndarray, ...]:
        """Position, speed, acceleration and jerk per amplitude, (T, k) each, for a speed of one.

        Parameters
        ----------
        t : (T,) s.
        """
        free = slice(RESTING, -RESTING)
        every = spline_basis(t, self.period, self.intervals)
        return tuple(self.unit * one[:, free] for one in every)

    def trajectory(self, variables: np.ndarray) -> BSpline:
        """Return the motion of some variables, (n, 1 + k)."""
        moved = variables[:, 1:] * (self.unit * self.limits.speed[:, None])
        points = np.pad(moved, ((0, 0), (RESTING, RESTING)))
        return BSpline(self.period, self.centre(variables)[:, None] + points)
