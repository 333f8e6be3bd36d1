"""Fourier series at rest where they begin and end, as linear functions of their variables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from dynident.closed_loop import Fourier
from dynident.errors import DesignError
from dynident.experiment_design.motions.motion_family import MotionFamily


@dataclass(frozen=True, eq=False, kw_only=True)
class FourierMotions(MotionFamily):
    """Fourier series whose speed and acceleration are zero at the ends of the period.

    The 2 H - 2 amplitudes of a joint are in units of the largest speed over the frequency of each
    harmonic.

    Attributes
    ----------
    harmonics : H, 2 or more.
    """

    harmonics: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2 <= self.harmonics <= 60:
            what = f"harmonics = {self.harmonics}"
            raise DesignError(what, remedy="choose 2 to 60: one cannot begin at rest")

    @property
    def amplitudes(self) -> int:
        """Number of amplitudes of each joint."""
        return 2 * self.harmonics - 2

    @property
    def waves(self) -> int:
        """Of the last harmonic."""
        return self.harmonics

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

    def waveforms(self, t: np.ndarray) -> tuple[np.ndarray, ...]:
        """Position, speed, acceleration and jerk per amplitude, (T, k) each, for a speed of one.

        Parameters
        ----------
        t : (T,) s.
        """
        phase = np.remainder(t, self.period)[:, None] * self.frequency
        s, c, w = np.sin(phase), np.cos(phase), self.frequency
        each = (
            np.hstack([s, c]),
            np.hstack([c * w, -s * w]),
            np.hstack([-s * w**2, -c * w**2]),
            np.hstack([-c * w**3, s * w**3]),
        )
        return tuple(one @ self.at_rest for one in each)

    def trajectory(self, variables: np.ndarray) -> Fourier:
        """Return the motion of some variables, (n, 2 H - 1)."""
        limits, amplitudes = self.limits, variables[:, 1:] @ self.at_rest.T
        amplitudes = amplitudes * limits.speed[:, None]
        sine, cosine = amplitudes[:, : self.harmonics], amplitudes[:, self.harmonics :]
        return Fourier(self.period, self.centre(variables), sine, cosine)
