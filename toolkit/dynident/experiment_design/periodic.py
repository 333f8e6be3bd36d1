"""Periodic motions at rest where they begin and end, as linear functions of their variables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from dynident.closed_loop import Fourier
from dynident.errors import DesignError
from dynident.experiment_design.motion_limits import MotionLimits

LONGEST = 3600.0
"""s, of one period."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PeriodicMotions:
    """Fourier series whose speed and acceleration are zero at the ends of the period.

    The variables of a joint are its centre, as a share of its range, and 2 H - 2 amplitudes, in
    units of the largest speed over the frequency of each harmonic.

    Attributes
    ----------
    limits : for the scales.
    period : s.
    harmonics : H, 2 or more.
    """

    limits: MotionLimits
    period: float
    harmonics: int

    def __post_init__(self) -> None:
        if not 0 < self.period <= LONGEST:
            remedy = f"choose it above 0, and at most {LONGEST:g}"
            raise DesignError(f"duration = {self.period:g} s", remedy=remedy)
        if not 2 <= self.harmonics <= 60:
            what = f"harmonics = {self.harmonics}"
            raise DesignError(what, remedy="choose 2 to 60: one cannot begin at rest")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.limits.lower)

    @property
    def size(self) -> int:
        """Number of variables of each joint."""
        return 2 * self.harmonics - 1

    @cached_property
    def frequency(self) -> np.ndarray:
        """Of each harmonic, (H,) rad/s."""
        return 2 * np.pi / self.period * np.arange(1, self.harmonics + 1)

    @cached_property
    def at_rest(self) -> np.ndarray:
        """Amplitudes (sines, then cosines) of each free variable, (2 H, 2 H - 2).

        In units of the largest speed: a sine of frequency w has amplitude 1/w.
        """
        w = self.frequency
        # Speed: sum of w * (s / w); acceleration: sum of w^2 * (c / w).
        ends = np.zeros((2, 2 * self.harmonics))
        ends[0, : self.harmonics] = 1.0
        ends[1, self.harmonics :] = w / w[0]
        return null_space(ends) / np.tile(w, 2)[:, None]

    def times(self, instants: int) -> np.ndarray:
        """Instants of a period, evenly spaced, (instants,) s."""
        return np.arange(instants) * (self.period / instants)

    def bases(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, speed and acceleration per variable, (T, 2 H - 1) each, for a speed of one.

        Of a joint: q = centre + speed * (bases @ variables), the first column of which is empty.
        """
        phase = np.remainder(t, self.period)[:, None] * self.frequency
        s, c, w = np.sin(phase), np.cos(phase), self.frequency
        each = (
            np.hstack([s, c]),
            np.hstack([c * w, -s * w]),
            np.hstack([-s * w**2, -c * w**2]),
        )
        empty = np.zeros((len(t), 1))
        q, v, a = (np.hstack([empty, one @ self.at_rest]) for one in each)
        return q, v, a

    def fourier(self, variables: np.ndarray) -> Fourier:
        """Return the motion of some variables, (n, 2 H - 1)."""
        limits, amplitudes = self.limits, variables[:, 1:] @ self.at_rest.T
        amplitudes = amplitudes * limits.speed[:, None]
        sine, cosine = amplitudes[:, : self.harmonics], amplitudes[:, self.harmonics :]
        return Fourier(self.period, self.centre(variables), sine, cosine)

    def centre(self, variables: np.ndarray) -> np.ndarray:
        """Centres of the series, (n,)."""
        half = (self.limits.upper - self.limits.lower) / 2
        return self.limits.lower + half * (1.0 + variables[:, 0])

    def random(self, seed: int) -> np.ndarray:
        """Return random variables (n, 2 H - 1), their speeds spread over the harmonics."""
        rng = np.random.default_rng(seed)
        found = rng.standard_normal((self.n, self.size))
        found[:, 0] = rng.uniform(-0.3, 0.3, self.n)
        return found
