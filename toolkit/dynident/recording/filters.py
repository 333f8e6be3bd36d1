"""The filter of a recording: its settings, and zero-phase low-passes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from dynident.arguments import checked
from dynident.errors import RecordingError
from dynident.recording.derivatives import ORDERS
from dynident.recording.low_pass.sections import butterworth_sections, slowest_pole
from dynident.recording.low_pass.zero_phase import zero_phase

FORGOTTEN = 1e-12
"""Share of a disturbance at the end of a part that is left where the part is used."""
_LEAST_SHARE = 1e-6
"""Cut-off over sampling rate below which a filter's coefficients run out of digits."""
_OF_POSITIONS = 0.45
"""Usual cut-off of columns and torque over that of the positions."""
_OF_RATE = 0.36
"""The same over the rate of the rows."""


@checked
@dataclass(frozen=True, kw_only=True)
class Filter:
    """How a recording is filtered, differentiated and decimated.

    Attributes
    ----------
    position_cutoff_hz : zero-phase low-pass of q before it is differentiated; None: none.
    cutoff_hz : the same zero-phase low-pass on every column and on the torque; None: none.
    rate_hz : decimated to about this; None: every sample is kept.
    decimation : "pick" keeps every k-th filtered row; "chebyshev" filters as MATLAB's `decimate`
        does before it picks.
    edge_s : s dropped at the start and at the end after differentiation.
    ends : "drop" leaves out, beyond `edge_s`, what the filters and differences make up where they
        see past the record; "keep" uses all of the record, as some published recipes do, also where
        a joint sticks.
    difference_order : order of accuracy of the central differences of positions, and of the torque
        that held commands make: 2, 4, 6 or 8. None: see `order`.
    suited_order : that of positions that pass no low-pass, where none is stated. A `Dataset` sets
        it, see `with_suited_order`.

    Raises
    ------
    RecordingError
        If a frequency is not above zero, an edge is negative, or `cutoff_hz` is not below half of
        `rate_hz` (what lies above would be folded into the result).
    """

    position_cutoff_hz: float | None = None
    cutoff_hz: float | None = None
    rate_hz: float | None = None
    decimation: Literal["pick", "chebyshev"] = "pick"
    edge_s: tuple[float, float] = (0.0, 0.0)
    ends: Literal["drop", "keep"] = "drop"
    difference_order: Literal[2, 4, 6, 8] | None = None
    suited_order: Literal[2, 4, 6, 8] | None = None

    def __post_init__(self) -> None:
        for name in ("position_cutoff_hz", "cutoff_hz", "rate_hz"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise RecordingError(f"{name} = {value!r}", "filter", "choose it above 0 Hz")
        if self.decimation not in ("pick", "chebyshev"):
            raise RecordingError(
                f"decimation = {self.decimation!r}", "filter", 'write "pick" or "chebyshev"'
            )
        if self.ends not in ("drop", "keep"):
            raise RecordingError(f"ends = {self.ends!r}", "filter", 'write "drop" or "keep"')
        for name in ("difference_order", "suited_order"):
            if getattr(self, name) not in (None, *ORDERS):
                what = f"{name} = {getattr(self, name)!r}"
                raise RecordingError(what, "filter", "write 2, 4, 6 or 8")
        if len(self.edge_s) != 2 or not all(math.isfinite(e) and e >= 0 for e in self.edge_s):
            remedy = "give two times in s, not negative"
            raise RecordingError(f"edge_s = {self.edge_s!r}", "filter", remedy)
        if self.cutoff_hz and self.rate_hz and self.cutoff_hz >= self.rate_hz / 2:
            raise RecordingError(
                f"cutoff_hz = {self.cutoff_hz:g} is not below half of rate_hz = {self.rate_hz:g}",
                "filter",
                f"choose it below {self.rate_hz / 2:g} Hz, or raise rate_hz",
            )

    @property
    def description(self) -> str:
        """What it does, in words."""
        parts = [
            f"position low-pass {self.position_cutoff_hz:g} Hz" if self.position_cutoff_hz else "",
            f"parallel low-pass {self.cutoff_hz:g} Hz" if self.cutoff_hz else "",
            f"decimated to {self.rate_hz:g} Hz ({self.decimation})" if self.rate_hz else "",
            "ends kept" if self.ends == "keep" else "",
            f"differences of order {self.order}",
        ]
        return ", ".join(part for part in parts if part)

    @property
    def order(self) -> int:
        """Order of accuracy of the differences.

        Where none is stated 8 behind a low-pass of the positions. Without one the higher it is, the
        more of the noise near half the sampling rate it lets through: it is `suited_order`, or 2.
        """
        raw = self.suited_order or ORDERS[0]
        return self.difference_order or (ORDERS[-1] if self.position_cutoff_hz else raw)

    def narrowed(self, share: float, rate_hz: float) -> Filter:
        """Return the filter with its cut-offs at a share of what they are, for samples at a rate.

        What is narrowed is the band of columns and torque alike. A recipe that lets torque through
        whole gets a low-pass of both, at a share of the band that it leaves the positions: behind a
        lower cut-off of the positions alone, noise around that cut-off would still be judged.
        """
        default = default_filter(rate_hz)
        position = self.position_cutoff_hz or self.cutoff_hz or default.position_cutoff_hz
        assert position is not None and default.cutoff_hz and default.rate_hz
        if self.cutoff_hz:
            lower = replace(self, cutoff_hz=share * self.cutoff_hz)
            return replace(lower, position_cutoff_hz=share * position)
        cutoff = share * position
        enough = default.rate_hz / default.cutoff_hz * cutoff
        return replace(
            self,
            position_cutoff_hz=position,
            cutoff_hz=cutoff,
            rate_hz=min(enough, self.rate_hz or rate_hz),
        )

    def margins(self, rate_hz: float) -> tuple[int, int]:
        """Samples at either end whose derivatives are not used, at a sampling rate in Hz.

        Besides `edge_s`: 3 periods of the position's cut-off, after which the transient of its
        filter is below 1 % of the acceleration, and at least the samples from which differences
        reach past the ends.
        """
        least = 0
        if self.ends == "drop":
            cutoff = self.position_cutoff_hz
            least = max(self.order, math.ceil(3.0 / cutoff * rate_hz) if cutoff else 0)
        first, last = (max(round(edge * rate_hz), least) for edge in self.edge_s)
        return first, last


def default_position_cutoff(rate_hz: float, cutoff_hz: float | None) -> float:
    """Cut-off of the positions' low-pass, in Hz, that suits that of columns and torque.

    40 Hz, below 200 Hz a fifth of the sampling rate; at least twice `cutoff_hz`, so that it leaves
    what the other one passes, as far as the rate permits.
    """
    wanted = max(40.0 * min(1.0, rate_hz / 200.0), 2.0 * (cutoff_hz or 0.0))
    return min(wanted, 0.4 * rate_hz)


def default_cutoff(position_cutoff_hz: float, rate_hz: float | None = None) -> tuple[float, float]:
    """Cut-off and rate of columns and torque, in Hz, that suit the low-pass of the positions.

    Above what positions let through they predict no torque: all that the torque holds there would
    count as missing from the model. The proportions are those of `default_filter`.

    Parameters
    ----------
    position_cutoff_hz : of the positions.
    rate_hz : to which rows are decimated, where that is chosen already.
    """
    cutoff = _OF_POSITIONS * position_cutoff_hz
    return (min(cutoff, _OF_RATE * rate_hz), rate_hz) if rate_hz else (cutoff, cutoff / _OF_RATE)


def default_filter(rate_hz: float) -> Filter:
    """Filter that suits most arms: 40 Hz on positions, 18 Hz on columns and torque, 50 Hz out.

    Below 200 Hz all frequencies shrink with the sampling rate, so that the position's low-pass
    stays at a fifth of it.
    """
    share = min(1.0, rate_hz / 200.0)
    return Filter(
        position_cutoff_hz=default_position_cutoff(rate_hz, 18.0 * share),
        cutoff_hz=18.0 * share,
        rate_hz=50.0 * share,
        decimation="pick",
    )


def lowpass(
    x: np.ndarray, rate_hz: float, cutoff_hz: float, order: int = 4, where: str | None = None
) -> np.ndarray:
    """Zero-phase Butterworth low-pass along axis 0, forward and backward.

    Each end is extended by point reflection over 3 times the filter's order, as MATLAB's
    `filtfilt` does, so that EMPS's published figures are reproduced.

    Parameters
    ----------
    x : (T, ...).
    rate_hz : sampling rate.
    cutoff_hz : where one pass lets 1/sqrt 2 through (both passes: 1/2).
    order : of one pass, even.
    where : file, for messages.

    Returns
    -------
    (T, ...).

    Raises
    ------
    RecordingError
        If the cut-off is not between 0 and half the sampling rate, or x has too few rows.
    """
    return zero_phase(x, butterworth(rate_hz, cutoff_hz, order, where), 3 * order, where)


def butterworth(
    rate_hz: float, cutoff_hz: float, order: int = 4, where: str | None = None
) -> np.ndarray:
    """Butterworth low-pass as second-order sections.

    Sections rather than numerator and denominator: these lose digits at low cut-offs.

    Parameters
    ----------
    rate_hz, cutoff_hz : of the samples, and of half the power.
    order : of the filter, even.
    where : file, for messages.

    Returns
    -------
    (order / 2, 6) sections, as `butterworth_sections` gives them.

    Raises
    ------
    RecordingError
        If the cut-off is not between 0 and half the sampling rate, or the order is odd.
    """
    if order % 2:
        raise RecordingError(f"a low-pass of order {order}", where, "choose an even order")
    if 0 < cutoff_hz < _LEAST_SHARE * rate_hz:
        what = f"samples at {rate_hz:.6g} Hz are too many for a cut-off of {cutoff_hz:g} Hz"
        raise RecordingError(what, where, "are the time stamps in s?")
    if not 0 < cutoff_hz < rate_hz / 2:
        raise RecordingError(
            f"a cut-off of {cutoff_hz:g} Hz does not suit samples at {rate_hz:.6g} Hz",
            where,
            f"choose it above 0 and below {rate_hz / 2:.6g} Hz",
        )
    return _sections(cutoff_hz / (rate_hz / 2), order)


@lru_cache(64)
def _sections(share: float, order: int) -> np.ndarray:
    """A low-pass with its cut-off at a share of half the sampling rate; not to be written to."""
    found = butterworth_sections(share, order)
    found.flags.writeable = False
    return found


def memory(sections: np.ndarray, share: float) -> int:
    """Samples in which a disturbance fades to a share; half as much again for the two passes.

    Parameters
    ----------
    sections : of a filter, as of `butterworth`.
    share : below one.
    """
    return math.ceil(1.5 * math.log(share) / math.log(slowest_pole(sections)))
