"""B-splines as reference motions: local where Fourier series are global."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline as Spline

from dynident.closed_loop.trajectories import Fourier
from dynident.errors import SimulationError

DEGREE = 5
"""So that acceleration and jerk are continuous within a period."""
RESTING = 3
"""Points at either end that are equal: position, speed and acceleration are those at rest."""


def spline_basis(t: np.ndarray, period: float, intervals: int) -> tuple[np.ndarray, ...]:
    """Return the B-splines of a period, and their first three derivatives.

    Parameters
    ----------
    t : (T,) s; whole periods are taken off.
    period : s.
    intervals : of the period, evenly long.

    Returns
    -------
    Four arrays (T, intervals + 5).
    """
    return _along(t, period, np.eye(intervals + DEGREE), 3)


def _along(t: np.ndarray, period: float, points: np.ndarray, most: int) -> tuple[np.ndarray, ...]:
    """Splines of points (k, m) and their derivatives, up to so many, (T, m) each."""
    inner = np.linspace(0.0, period, len(points) - DEGREE + 1)
    knots = np.concatenate([np.zeros(DEGREE), inner, np.full(DEGREE, period)])
    spline = Spline(knots, points, DEGREE)
    phase = np.remainder(np.asarray(t, dtype=float), period)
    return tuple(spline(phase, order) for order in range(most + 1))


@dataclass(frozen=True, eq=False)
class BSpline:
    """A B-spline of degree five for each joint, from rest to rest, that repeats with its period.

    Knots are evenly spaced and clamped at the ends of the period (de Boor, "A practical guide to
    splines", 1978).

    Attributes
    ----------
    period : s.
    points : (n, k) rad or m; the first three and the last three of a joint are equal.
    """

    period: float
    points: np.ndarray

    def __post_init__(self) -> None:
        array = np.array(self.points, dtype=float)
        if not np.isfinite(array).all():
            raise SimulationError("points is not finite", "trajectory")
        array.setflags(write=False)
        object.__setattr__(self, "points", array)
        if not (self.period > 0 and np.isfinite(self.period)):
            raise SimulationError(f"period = {self.period}", "trajectory", "choose it above 0")
        if array.ndim != 2 or array.shape[1] < 2 * RESTING + 1:
            remedy = f"give {2 * RESTING + 1} or more for each joint"
            raise SimulationError("too few points", "trajectory", remedy)
        ends = np.hstack([array[:, :RESTING], array[:, -RESTING:]])
        if np.any(ends != ends[:, :1]):
            what = "its points do not begin and end at rest"
            remedy = f"let the first {RESTING} and the last {RESTING} of a joint be equal"
            raise SimulationError(what, "trajectory", remedy)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.points)

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration at times t (T,) s, each (T, n)."""
        # About the position at rest, so that rounding does not move what rests.
        moved = self.points - self.points[:, :1]
        q, v, a = _along(t, self.period, moved.T, 2)
        return q + self.points[:, 0], v, a

    @property
    def coefficients(self) -> dict[str, list]:
        """What a file has of it, by the names of its keys."""
        return {"points": self.points.tolist()}


Trajectory = Fourier | BSpline
"""A motion that repeats with a period, and that a file can hold by its coefficients."""
