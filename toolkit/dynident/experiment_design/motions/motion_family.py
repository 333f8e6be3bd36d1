"""What every family of motions offers: motions from rest to rest, linear in their variables."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from dynident.closed_loop import Trajectory
from dynident.errors import DesignError
from dynident.experiment_design.motion_limits import MotionLimits

LONGEST = 3600.0
"""s, of one period."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionFamily(ABC):
    """Motions that repeat with a period, at rest where it begins and ends.

    The variables of a joint are its centre, as a share of its range, and amplitudes, in units in
    which its largest speed is about one.

    Attributes
    ----------
    limits : for the scales.
    period : s.
    """

    limits: MotionLimits
    period: float

    def __post_init__(self) -> None:
        if not 0 < self.period <= LONGEST:
            remedy = f"choose it above 0, and at most {LONGEST:g}"
            raise DesignError(f"duration = {self.period:g} s", remedy=remedy)

    @property
    @abstractmethod
    def amplitudes(self) -> int:
        """Number of amplitudes of each joint."""

    @property
    @abstractmethod
    def waves(self) -> int:
        """Shortest waves of a motion that a period has: so finely it is to be looked at."""

    @abstractmethod
    def waveforms(self, t: np.ndarray) -> tuple[np.ndarray, ...]:
        """Position, speed, acceleration and jerk per amplitude, (T, k) each, for a speed of one.

        Parameters
        ----------
        t : (T,) s.
        """

    @abstractmethod
    def trajectory(self, variables: np.ndarray) -> Trajectory:
        """Return the motion of some variables, (n, 1 + k)."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.limits.lower)

    @property
    def size(self) -> int:
        """Number of variables of each joint, 1 + k."""
        return 1 + self.amplitudes

    def times(self, instants: int) -> np.ndarray:
        """Instants of a period, evenly spaced, (instants,) s."""
        return np.arange(instants) * (self.period / instants)

    def bases(self, t: np.ndarray) -> tuple[np.ndarray, ...]:
        """Position, speed, acceleration and jerk per variable, (T, 1 + k) each, for a speed of one.

        Of a joint: q = centre + speed * (bases @ variables), the first column of which is empty.

        Parameters
        ----------
        t : (T,) s.
        """
        empty = np.zeros((len(t), 1))
        return tuple(np.hstack([empty, one]) for one in self.waveforms(t))

    def to_the_end(self, instants: int) -> np.ndarray:
        """Instants of a period, evenly spaced, and the moment before its end, (instants + 1,) s.

        There the jerk may be another one than at the beginning.
        """
        return np.append(self.times(instants), np.nextafter(self.period, 0.0))

    def jerk(self, variables: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the jerk of a motion, (T, n) rad/s^3 or m/s^3.

        Parameters
        ----------
        variables : (n, 1 + k).
        t : (T,) s.
        """
        *_, jerk = self.waveforms(t)
        return (jerk @ variables[:, 1:].T) * self.limits.speed

    def centre(self, variables: np.ndarray) -> np.ndarray:
        """Positions about which a motion grows with its amplitudes, (n,)."""
        half = (self.limits.upper - self.limits.lower) / 2
        return self.limits.lower + half * (1.0 + variables[:, 0])

    def random(self, seed: int) -> np.ndarray:
        """Return random variables (n, 1 + k), of more speed than most limits allow."""
        rng = np.random.default_rng(seed)
        found = rng.standard_normal((self.n, self.size))
        found[:, 0] = rng.uniform(-0.3, 0.3, self.n)
        return found
