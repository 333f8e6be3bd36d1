"""What a simulation from sample to sample takes and makes, whoever makes the steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.closed_loop.mechanism import Past

_ROUNDING = 1e-6
"""Of a sample; a delay this near to a whole number of samples is one."""
_RUNAWAY = 100.0
"""A state this many times beyond the reference's has left the earth."""
WINDOW = 200
"""Samples between looks at the whole motion."""


@dataclass(frozen=True)
class Hold:
    """How commands act late: each from its delay on, until the next one does.

    Attributes
    ----------
    late : whole samples of the delay.
    rest : share of a sample by which it is more.
    """

    late: int
    rest: float

    @classmethod
    def of(cls, delay: float, rate: float) -> Hold:
        """Return that of a delay in s, at a number of samples per second."""
        samples = delay * rate
        late = int(np.floor(samples + _ROUNDING))
        rest = samples - late
        return cls(late, rest if rest > _ROUNDING else 0.0)

    def arrived(self, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return `SteppedMotion.acting` and `SteppedMotion.mean` of commands (T, N)."""
        if not (self.late or self.rest):
            return commands, commands
        rows = np.arange(len(commands)) - self.late
        now, before = commands[np.maximum(rows, 0)], commands[np.maximum(rows - 1, 0)]
        return before if self.rest else now, (1.0 - self.rest) * now + self.rest * before


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the encoders add to the positions of N joints.

    Attributes
    ----------
    noise : (T, N) rad or m.
    resolution : (N,) rad or m; 0 for none.
    """

    noise: np.ndarray
    resolution: np.ndarray

    def of(self, k: int, q: np.ndarray) -> np.ndarray:
        """Return positions q (N,) as they are measured at sample k."""
        if self._noisy:
            q = q + self.noise[k]
        if self._coarse:
            q = np.where(self.resolution == 0, q, np.rint(q / self._step) * self._step)
        return q

    @cached_property
    def _noisy(self) -> bool:
        return bool(np.any(self.noise))

    @cached_property
    def _coarse(self) -> bool:
        return bool(np.any(self.resolution > 0))

    @cached_property
    def _step(self) -> np.ndarray:
        return np.where(self.resolution == 0, 1.0, self.resolution)


@dataclass(frozen=True, eq=False, kw_only=True)
class SteppedMotion:
    """What came of it, (T, N) each.

    Attributes
    ----------
    q, v : true motion.
    measured : position as the controller gets it.
    u : command as the controller gives it.
    acting, mean : command that acts just after a sample, and in the mean until the next one.
    saturated : whether the command is at its limit.
    past : what else the accelerations depend on; None where that is nothing.
    """

    q: np.ndarray
    v: np.ndarray
    measured: np.ndarray
    u: np.ndarray
    acting: np.ndarray
    mean: np.ndarray
    saturated: np.ndarray
    past: Past | None = None

    def of_memory(self, columns: slice) -> SteppedMotion:
        """Return it with some of the internal states only."""
        if self.past is None:
            return self
        return replace(self, past=replace(self.past, memory=self.past.memory[:, columns]))


@dataclass(frozen=True)
class JointLoop:
    """How messages call a joint: the motion's name, the joint's, and its unit."""

    task: str
    name: str
    unit: str


def chattering(v: np.ndarray, pace: np.ndarray) -> int | None:
    """Return the joint whose speed swings from sample to sample by more than the loop follows.

    Parameters
    ----------
    v : (W, N) rad/s or m/s, a few hundred samples.
    pace : (N,) rms speed of the whole reference.
    """
    swing = rms(np.diff(v, 2, axis=0))
    # A joint that stands still swings by its encoder's noise alone.
    worst = int(np.argmax(swing / np.maximum(pace, 0.1 * pace.max() + 1e-9)))
    return worst if swing[worst] > max(pace[worst], 0.1 * pace.max()) > 0 else None


def runaway(reference_q: np.ndarray, reference_v: np.ndarray) -> float:
    """Return the squared norm of a state that has left the earth, beside a reference (T, N)."""
    return float((_RUNAWAY * (1.0 + np.abs(reference_q).max() + np.abs(reference_v).max())) ** 2)


def rms(x: np.ndarray) -> np.ndarray:
    """Return the root of the mean square of each column."""
    return np.sqrt(np.mean(x**2, axis=0))
