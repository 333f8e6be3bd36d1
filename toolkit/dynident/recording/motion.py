"""From a recording to the motion that a regressor needs: low-passed positions and derivatives.

Part by part, each with as many samples around it as the filter remembers, so that the motion of a
long recording never exists as a whole; or all of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.derivatives import central_difference, held_torque
from dynident.recording.filters import FORGOTTEN, Filter, butterworth, lowpass, memory
from dynident.recording.recording import Recording

_FEW = 16
_BAND = 0.25
"""Cut-off of a thinned torque's low-pass over its rate.

A twentieth of the rate is let through to 3e-6, a fiftieth to 2e-9; what is folded into that band
from above is less than 4e-5 of what it was.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """Filtered positions and their derivatives, at the recording's own rate unless thinned.

    Attributes
    ----------
    t : (T,) s, the recording's clock.
    q, v, a : (T, n) rad or m, and per s and s^2.
    tau : (T, n) N m or N, at the instants of `t` (half a sample after held commands).
    rate_hz : mean sampling rate.
    first, every : index in the recording of the first row, and its samples from row to row.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    tau: np.ndarray
    rate_hz: float
    first: int = 0
    every: int = 1

    @property
    def samples(self) -> int:
        """Number of rows, T."""
        return len(self.t)

    @property
    def whole(self) -> Motion:
        """All of it."""
        return self

    def part(self, rows: slice) -> Motion:
        """Return some consecutive rows."""
        t, q, v, a, tau = (x[rows] for x in (self.t, self.q, self.v, self.a, self.tau))
        return replace(self, t=t, q=q, v=v, a=a, tau=tau)

    def thinned(self, every: int) -> Motion:
        """Return every so many-th row, the last one included, for positions with a low-pass.

        Far above its cut-off a motion holds nothing that would be lost. The torque, whose noise has
        all frequencies, passes a low-pass of its own before.

        Parameters
        ----------
        every : 1 for all rows.
        """
        if every == 1:
            return self
        rate, skipped = self.rate_hz / every, (self.samples - 1) % every
        kept = slice(skipped, None, every)
        t, q, v, a = (np.ascontiguousarray(x[kept]) for x in (self.t, self.q, self.v, self.a))
        tau = np.ascontiguousarray(lowpass(self.tau, self.rate_hz, _BAND * rate)[kept])
        first, every = self.first + self.every * skipped, self.every * every
        return Motion(t=t, q=q, v=v, a=a, tau=tau, rate_hz=rate, first=first, every=every)


@dataclass(frozen=True, eq=False)
class MotionInParts:
    """The motion of a recording, of which no more is computed than is asked for.

    Attributes
    ----------
    recording : T samples, taken as uniformly sampled at its mean rate: see `uniform`.
    filter : its `position_cutoff_hz`, `order`, `edge_s` and `ends` are used here.

    Raises
    ------
    RecordingError
        If the cut-off does not suit the sampling rate, or too few samples remain.
    """

    recording: Recording
    filter: Filter
    every: ClassVar[int] = 1

    def __post_init__(self) -> None:
        rate, (first, last) = self.rate_hz, self._margins
        if self.filter.position_cutoff_hz is not None:
            # That the filter suits is seen in a few samples.
            few, cutoff = self.recording.q[:_FEW], self.filter.position_cutoff_hz
            lowpass(few, rate, cutoff, where=self.recording.where)
        if self.samples < 2:
            raise RecordingError(
                f"nothing is left of {self.recording.duration:.4g} s when {first / rate:.3g} and "
                f"{last / rate:.3g} s are dropped at the ends",
                self.recording.where,
                "record longer, raise position_cutoff_hz, or choose a smaller edge_s",
            )

    @cached_property
    def rate_hz(self) -> float:
        """Mean sampling rate."""
        return self.recording.rate_hz

    @cached_property
    def _margins(self) -> tuple[int, int]:
        return self.filter.margins(self.rate_hz)

    @property
    def first(self) -> int:
        """Index in the recording of the first row."""
        return self._margins[0]

    @property
    def samples(self) -> int:
        """Number of rows."""
        return self.recording.samples - sum(self._margins)

    @cached_property
    def _reach(self) -> int:
        """Samples around a part that show in it."""
        cutoff, own = self.filter.position_cutoff_hz, self.filter.order  # of two differences
        if cutoff is None:
            return own
        passes = butterworth(self.rate_hz, cutoff, where=self.recording.where)
        return own + memory(passes, FORGOTTEN)

    @cached_property
    def whole(self) -> Motion:
        """All of it; kept from then on."""
        return self.part(slice(0, self.samples))

    @cached_property
    def speeds(self) -> np.ndarray:
        """Its velocities, (T, n) rad/s or m/s; kept from then on."""
        return self.part(slice(0, self.samples)).v

    def part(self, rows: slice) -> Motion:
        """Compute some consecutive rows; those of the whole, to rounding.

        The second difference magnifies rounding with the square of the sampling rate: at 10 kHz
        accelerations agree to about 1e-7 of the largest, at 1 kHz to 1e-9.

        Parameters
        ----------
        rows : from which to before which, counted from `first`.
        """
        recording, rate = self.recording, self.rate_hz
        start, stop, _ = rows.indices(self.samples)
        start, stop = start + self.first, stop + self.first
        low, high = max(0, start - self._reach), min(recording.samples, stop + self._reach)
        q = recording.q[low:high]
        if self.filter.position_cutoff_hz is not None:
            q = lowpass(q, rate, self.filter.position_cutoff_hz, where=recording.where)
        v = central_difference(q, rate, self.filter.order)
        a = central_difference(v, rate, self.filter.order)
        kept = slice(start - low, stop - low)
        tau = recording.tau[low:high]
        if recording.torque == "held_command":
            tau = held_torque(tau, self.filter.order)
        return Motion(
            t=recording.t[start:stop],
            q=q[kept],
            v=v[kept],
            a=a[kept],
            tau=tau[kept],
            rate_hz=rate,
            first=self.first,
        )


def differentiate(recording: Recording, filter: Filter) -> Motion:
    """Low-pass the positions, differentiate them twice, and drop the edges.

    Recorded v and a are not used, since columns and torque must have passed the same filters. A
    held command acts from its sample to the next: see `derivatives.held_torque`.

    Parameters
    ----------
    recording, filter : as of `MotionInParts`.

    Returns
    -------
    Motion
        At the full rate, without the edges.

    Raises
    ------
    RecordingError
        If the cut-off does not suit the sampling rate, or too few samples remain.
    """
    return MotionInParts(recording, filter).whole
