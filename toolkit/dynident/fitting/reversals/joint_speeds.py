"""Speeds of a recording's joints in all its samples, and their noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np
from scipy.ndimage import maximum_filter1d

from dynident.fitting.sampling import BLOCK, Sampled
from dynident.recording import MotionInParts
from dynident.recording.position_cutoff import DIGITS, SpeedGain
from dynident.recording.white_noise import encoder_noise_std

REST_S = 0.2
"""Duration of a stop from which it is a rest, s."""
_SCATTER = 10.0
"""Range of the positions of a joint that rests, over the noise of its encoder."""
_SLIPS = 1e-3
"""Share of its travel that a joint which rests may slip in a second."""
_RINGING = 0.1
"""Overshoot of the speed's low-pass beside a kink, of the change of acceleration times the time
constant 1 / (2 pi cut-off)."""
_KINK = 2.0  # change of acceleration where a joint stops or starts, of its root mean square
_MARGIN = 1.2  # of what the low-pass makes of a kink: the acceleration before it may fall
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
        q = self.sampled.recording.q
        digits = DIGITS * np.abs(q).max(axis=0)
        return np.maximum(encoder_noise_std(q), digits) * self._gain.noise

    @cached_property
    def rests(self) -> np.ndarray:
        """Which joints rest from the first row to the last, (n,) mask."""
        return np.ptp(self.sampled.q, axis=0) <= rest_range(self.sampled)

    @cached_property
    def rms(self) -> np.ndarray:
        """Their root mean square from the first to the last row that is used, (n,)."""
        squares = [np.sum(part**2, axis=0) for part in self.used()]
        return np.sqrt(np.sum(squares, axis=0) / (self._used.stop - self._used.start))

    @cached_property
    def ringing(self) -> np.ndarray:
        """How far the low-pass of the positions rings beside a stop, (n,) rad/s or m/s.

        A joint that stands is given that much speed before it starts, and after it has stopped.
        """
        cutoff, rate = (
            self.sampled.parallel.filter.position_cutoff_hz,
            self.sampled.recording.rate_hz,
        )
        if not cutoff:
            return np.zeros(self.sampled.recording.n)
        parts = [np.diff(part, axis=0) * rate for part in self.used()]
        squares = np.sum([np.sum(part**2, axis=0) for part in parts], axis=0)
        acceleration = np.sqrt(squares / max(sum(map(len, parts)), 1))
        return _RINGING * _KINK * acceleration / (2.0 * np.pi * cutoff)

    @cached_property
    def rounding(self) -> float:
        """Speed that is made up where a stop begins, over the acceleration there, s."""
        return _MARGIN * self._gain.rounding

    @cached_property
    def _gain(self) -> SpeedGain:
        """From positions to speeds."""
        return SpeedGain(self.sampled.recording.rate_hz, self.sampled.parallel.filter)

    def used(self) -> Iterator[np.ndarray]:
        """Yield them (T, n) from the first to the last row that is used, part by part."""
        for start in range(self._used.start, self._used.stop, BLOCK):
            yield self._part(slice(start, min(start + BLOCK, self._used.stop)))

    def slower(self, limits: np.ndarray, rounding: float = 0.0) -> Iterator[np.ndarray]:
        """Return how much of each row's low-pass lies within a speed, (T, n), part by part.

        Parameters
        ----------
        limits : (n,) the speed, rad/s or m/s; a negative one for joints that are not asked for.
        rounding : s, times the largest acceleration around a sample: speeds below count, too.
        """
        asked = limits >= 0

        def within(v: np.ndarray) -> np.ndarray:
            most = np.tile(limits, (len(v), 1))
            if rounding:
                made_up = rounding * self._largest_around(v[:, asked])
                most[:, asked] = np.maximum(most[:, asked], made_up)
            return (np.abs(v) <= most).astype(float)

        return self.passed(within)

    def passed(
        self, signal: Callable[[np.ndarray], np.ndarray], around: int = 0
    ) -> Iterator[np.ndarray]:
        """Yield a function of the speeds, low-passed, in the rows that are used, part by part.

        Parameters
        ----------
        signal : of speeds (S, n) in consecutive samples, of the same shape.
        around : samples on either side that show in it.
        """
        full = self._full
        for plan in full.parallel.blocks(full.source.samples, BLOCK, self.sampled.kept):
            first = max(0, plan.raw.start - around)
            some = signal(self._part(slice(first, plan.raw.stop + around)))
            kept = some[plan.raw.start - first :][: plan.raw.stop - plan.raw.start]
            yield full.parallel.apply_block(kept, plan)

    def _largest_around(self, v: np.ndarray) -> np.ndarray:
        """Largest acceleration within a period of the positions' cut-off, (T, n)."""
        rate = self.sampled.recording.rate_hz
        cutoff = self.sampled.parallel.filter.position_cutoff_hz or rate
        accelerations = np.abs(np.gradient(v, axis=0)) * rate
        return maximum_filter1d(accelerations, 2 * ceil(rate / cutoff) + 1, axis=0)

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


def rest_range(sampled: Sampled) -> np.ndarray:
    """Return the range of positions within which a joint rests, (n,) rad or m.

    What encoders make of one position, or little of the travel.

    Parameters
    ----------
    sampled : the recording.
    """
    q = sampled.recording.q
    least = DIGITS * np.abs(q).max(axis=0) + _SCATTER * encoder_noise_std(q)
    return np.maximum(least, _SLIPS * REST_S * np.ptp(q, axis=0))
