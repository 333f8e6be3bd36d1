"""Speeds of a recording's joints in all its samples, and their noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynident.fitting.sampling import BLOCK, Sampled
from dynident.recording import MotionInParts
from dynident.recording.filters import butterworth
from dynident.recording.sections import response
from dynident.recording.white_noise import encoder_noise_std

_FREQUENCIES = 4096  # at which a filter's response is taken
DIGITS = 1e-12
"""Of a position's size, that its low-pass keeps: some joints stand exactly."""
_RINGING, _ROUNDING = 0.1, 0.33
"""Overshoot of the speed's low-pass beside a kink, and what it makes of no speed at the kink, of
the change of acceleration times the time constant 1 / (2 pi cut-off)."""
_KINK = 1.155
"""Change of acceleration where a joint stops or starts, of the root of its mean fourth power over
its mean square, which rests do not lower: the amplitude of a sine."""
_AT_ONCE = 1 << 21  # speeds that are computed at once, and kept with the recording's motion


@dataclass(frozen=True, eq=False)
class JointSpeeds:
    """Speeds of a recording's joints in all its samples: a stop may be over in a few.

    Parameters
    ----------
    sampled : the recording, whose rows they are asked for.
    """

    sampled: Sampled

    @cached_property
    def noise(self) -> np.ndarray:
        """Standard deviation of the noise in them, (n,) rad/s or m/s.

        White noise of the encoders, or the digits of the numbers, through the low-pass of the
        positions and the central difference.
        """
        rate = self.sampled.recording.rate_hz
        angle = np.linspace(0.0, np.pi, _FREQUENCIES)
        gain = np.sin(angle) * rate
        cutoff = self.sampled.parallel.filter.position_cutoff_hz
        if cutoff:
            gain = gain * np.abs(response(butterworth(rate, cutoff), angle)) ** 2
        share = float(np.sqrt(np.trapezoid(gain**2, angle) / np.pi))
        q = self.sampled.recording.q
        digits = DIGITS * np.abs(q).max(axis=0)
        return np.maximum(encoder_noise_std(q), digits) * share

    @cached_property
    def rms(self) -> np.ndarray:
        """Their root mean square from the first to the last row that is used, (n,)."""
        squares = [np.sum(part**2, axis=0) for part in self.used()]
        return np.sqrt(np.sum(squares, axis=0) / (self._used.stop - self._used.start))

    @property
    def ringing(self) -> np.ndarray:
        """How far the low-pass of the positions rings beside a stop, (n,) rad/s or m/s.

        A joint that stands is given that much speed before it starts, and after it has stopped.
        """
        return _RINGING * self._kink

    @property
    def rounding(self) -> np.ndarray:
        """Speed that the low-pass of the positions makes up where a stop begins or ends, (n,)."""
        return _ROUNDING * self._kink

    @cached_property
    def _kink(self) -> np.ndarray:
        """Change of acceleration at a stop times the time constant of the low-pass, (n,)."""
        cutoff, rate = (
            self.sampled.parallel.filter.position_cutoff_hz,
            self.sampled.recording.rate_hz,
        )
        if not cutoff:
            return np.zeros(self.sampled.recording.n)
        squares = [(np.diff(part, axis=0) * rate) ** 2 for part in self.used()]
        second = np.sum([part.sum(axis=0) for part in squares], axis=0)
        fourth = np.sum([(part**2).sum(axis=0) for part in squares], axis=0)
        change = np.sqrt(np.divide(fourth, second, out=np.zeros_like(second), where=second > 0))
        return _KINK * change / (2.0 * np.pi * cutoff)

    def used(self) -> Iterator[np.ndarray]:
        """Yield them (T, n) from the first to the last row that is used, part by part."""
        for start in range(self._used.start, self._used.stop, BLOCK):
            yield self._part(slice(start, min(start + BLOCK, self._used.stop)))

    def slower(self, limits: np.ndarray) -> Iterator[np.ndarray]:
        """Yield how much of each row's low-pass lies within a speed, (T, n), part by part.

        Parameters
        ----------
        limits : (n,) the speed, rad/s or m/s; a negative one for joints that are not asked for.
        """
        full = self._full
        for plan in full.parallel.blocks(full.source.samples, BLOCK, self.sampled.kept):
            inside = np.abs(self._part(plan.raw)) <= limits
            yield full.parallel.apply_block(inside.astype(float), plan)

    @property
    def _full(self) -> Sampled:
        return self.sampled.unthinned or self.sampled

    @cached_property
    def _used(self) -> slice:
        rows = self._full.parallel.rows(self._full.source.samples)[self.sampled.kept]
        return slice(int(rows[0]), int(rows[-1]) + 1)

    def _part(self, raw: slice) -> np.ndarray:
        source = self._full.source
        few = source.samples * self.sampled.recording.n <= _AT_ONCE
        if few and isinstance(source, MotionInParts):
            return source.speeds[raw]
        return source.part(raw).v
