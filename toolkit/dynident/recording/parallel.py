"""The parallel filter: one low-pass and decimation for every column and for the torque.

Filtering both sides of tau = Y theta alike keeps the equation true. Columns may be filtered in
blocks of samples, so that a regressor never exists as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from dynident.batch import side_by_side
from dynident.errors import RecordingError
from dynident.recording.filters import FORGOTTEN, Filter, butterworth, memory
from dynident.recording.low_pass.zero_phase import FilteredColumns, zero_phase_columns

_FEW = 8  # columns, of which it costs more to find the empty ones than to filter them


@dataclass(frozen=True)
class FilterBlock:
    """A block of samples to filter: what to evaluate, what to keep.

    Attributes
    ----------
    raw : samples of the record to evaluate, the overlap on both sides included.
    rows : (k,) which of these samples are kept after filtering, counted from the slice's start.
    kept : where these rows belong in the decimated whole.
    """

    raw: slice
    rows: np.ndarray
    kept: slice


@dataclass(frozen=True)
class ParallelFilter:
    """The low-pass and decimation of a `Filter` at a given sampling rate.

    The last sample is always kept, as by MATLAB's `decimate`, whose filter "chebyshev" is: type I
    of order 8, 0.05 dB ripple, 0.8 of the new half rate, forward and backward. With a period the
    kept rows fall on the same phases in every period.

    Attributes
    ----------
    filter : `cutoff_hz`, `rate_hz` and `decimation` are used here.
    rate_hz : sampling rate of what is to be filtered.
    period : s, or None; a whole number of samples (see `uniform`).
    where : file, for messages.
    """

    filter: Filter
    rate_hz: float
    period: float | None = None
    where: str | None = None

    @cached_property
    def _ratio(self) -> tuple[int, int]:
        """So many samples give so many kept rows."""
        if self.filter.rate_hz is None:
            return 1, 1
        factor = choose_factor(self.rate_hz, self.filter.rate_hz, self.period)
        samples = round(self.period * self.rate_hz) if self.period else 0
        return (samples, round(samples / factor)) if samples > factor else (factor, 1)

    @property
    def step(self) -> float:
        """Samples from one kept row to the next; whole, unless no whole step divides a period."""
        samples, rows = self._ratio
        return samples / rows

    @property
    def factor(self) -> int:
        """The step as a whole number."""
        return round(self.step)

    def thinned(self, most: int) -> tuple[ParallelFilter, int]:
        """Return the filter that keeps the same rows of every k-th sample, and that k.

        The largest that there is: one that divides the samples of a step, and of a period. Itself
        and 1 if there is none.

        Parameters
        ----------
        most : largest k.
        """
        period = round(self.period * self.rate_hz) if self.period else 0
        for every in range(most, 1, -1):
            thinner = replace(self, rate_hz=self.rate_hz / every)
            divides = period % every == 0 and self.step % every == 0
            if divides and thinner.step * every == self.step:
                return thinner, every
        return self, 1

    @property
    def output_rate_hz(self) -> float:
        """Rate of the kept rows."""
        return self.rate_hz / self.step

    @cached_property
    def stages(self) -> tuple[tuple[np.ndarray, int], ...]:
        """Second-order sections and padding of each filter in turn."""
        found = []
        if self.filter.cutoff_hz is not None:
            cutoff = self.filter.cutoff_hz
            if self.step > 1 and cutoff >= self.output_rate_hz / 2:
                raise RecordingError(
                    f"cutoff_hz = {cutoff:g} is not below half of the decimated rate, "
                    f"{self.output_rate_hz:.6g} Hz",
                    self.where,
                    "choose another cutoff_hz or rate_hz",
                )
            found.append((butterworth(self.rate_hz, cutoff, where=self.where), 12))
        if self.filter.decimation == "chebyshev" and self.factor > 1:
            from scipy.signal import cheby1  # takes long to load

            found.append((cheby1(8, 0.05, 0.8 / self.factor, output="sos"), 24))
        return tuple(found)

    @cached_property
    def overlap(self) -> int:
        """Samples after which a block's end no longer shows (below 1e-9 of the largest value)."""
        return sum(memory(sections, FORGOTTEN) for sections, _ in self.stages)

    @cached_property
    def _least(self) -> int:
        """Samples that a block needs, so that it can be padded."""
        return max((padding for _, padding in self.stages), default=0)

    @cached_property
    def transient(self) -> float:
        """Time in s from a record's end over which the filter sees beyond it (to 1 %)."""
        return sum(memory(sections, 1e-2) for sections, _ in self.stages) / self.rate_hz

    def count(self, samples: int) -> int:
        """How many of so many samples are kept."""
        above, below = self._ratio
        return -(-below * (2 * samples - 1) // (2 * above)) if samples else 0

    def rows(self, samples: int, some: slice = slice(None)) -> np.ndarray:
        """Which of so many samples are kept, increasing; the last one is.

        Parameters
        ----------
        samples : T.
        some : of the kept rows; all by default.
        """
        count = self.count(samples)
        return self._sample(samples, count - 1 - np.arange(*some.indices(count)))

    def row(self, samples: int, which: int) -> int:
        """Return which of so many samples is a kept row of a number, as `rows` of all has it."""
        return self._sample(samples, self.count(samples) - 1 - which)

    def _sample(self, samples: int, back: Any) -> Any:
        """The sample that is a kept row so far back from the last, one or an array of them."""
        # In whole numbers: rounding must fall alike in every period.
        above, below = self._ratio
        return samples - 1 - (2 * above * back + below) // (2 * below)

    def times(self, t: np.ndarray) -> np.ndarray:
        """Time stamps of the kept rows."""
        return t[self.rows(len(t))]

    def apply(self, x: np.ndarray) -> np.ndarray:
        """Filter and decimate a complete record, (T, ...) -> (kept rows, ...).

        Raises
        ------
        RecordingError
            If there are too few samples, or a cut-off does not suit the sampling rate.
        """
        return self._filtered(np.asarray(x, dtype=float), self.rows(len(x)))

    def blocks(
        self, samples: int, size: int = 32768, kept: slice = slice(None)
    ) -> Iterator[FilterBlock]:
        """Plan a record of so many samples as blocks of about `size`, with overlap.

        `apply_block` on each `x[block.raw]` gives `apply(x)[block.kept]`, to 1e-9 of the largest
        value of x.

        Parameters
        ----------
        samples : of the record.
        size : of a block, without its overlap.
        kept : which of the kept rows are wanted; all by default.

        Returns
        -------
        The blocks in the order of time.
        """
        start, stop, _ = kept.indices(self.count(samples))
        blocks = max(1, round((stop - start) * self.step / max(size, 2 * self.overlap)))
        for i in range(blocks if stop > start else 0):
            some = slice(
                start + (stop - start) * i // blocks, start + (stop - start) * (i + 1) // blocks
            )
            rows = self.rows(samples, some)
            low = max(0, int(rows[0]) - self.overlap)
            # Padding takes as many samples as a stage needs, also where all else is forgotten.
            high = min(samples, max(int(rows[-1]) + self.overlap, low + self._least) + 1)
            low = max(0, min(low, high - self._least - 1))
            if blocks == 1 and samples - (high - low) <= 2 * self.overlap:
                low, high = 0, samples
            yield FilterBlock(slice(low, high), rows - low, some)

    def apply_block(self, x: np.ndarray, block: FilterBlock) -> np.ndarray:
        """Filter and decimate one block, `x` being the record's samples `block.raw`."""
        return self._filtered(np.asarray(x, dtype=float), block.rows)

    def apply_each(
        self, xs: Sequence[np.ndarray], block: FilterBlock | None = None
    ) -> list[np.ndarray]:
        """As `apply`, or `apply_block`, of several together, which costs less.

        Parameters
        ----------
        xs : (T, ...) each, of as many samples.
        block : of which they are the samples; None for complete records.
        """
        if not xs:
            return []
        rows = self.rows(len(xs[0])) if block is None else block.rows
        every = [np.asarray(x, dtype=float) for x in xs]
        if not self.stages:
            return [x[_as_slice(rows)].copy() for x in every]
        out = [np.empty((len(rows), _width(x))) for x in every]
        self._filter(every, rows, out)
        return [y.reshape(len(rows), *x.shape[1:]) for x, y in zip(every, out, strict=True)]

    def low_pass(self, x: np.ndarray) -> np.ndarray:
        """Filter without decimating, (T, ...) -> (T, ...); symmetric but for the ends."""
        return self._filtered(np.asarray(x, dtype=float), np.arange(len(x)))

    def _filtered(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        if not self.stages:
            return x[_as_slice(rows)]
        aside = x.ndim > 2 and x.strides[0] == x.itemsize
        shape = (len(rows), _width(x))
        out = side_by_side(len(rows), shape[1:]) if aside else np.empty(shape)
        self._filter([x], rows, [out])
        return out.reshape(len(rows), *x.shape[1:])

    def _filter(
        self, xs: Sequence[np.ndarray], rows: np.ndarray, out: Sequence[np.ndarray]
    ) -> None:
        """Filter and decimate arrays (T, ...) into others (kept rows, columns)."""
        parts = []
        for x, result in zip(xs, out, strict=True):
            flat = x.reshape(len(x), _width(x))
            used = _used(flat)
            if len(used) < flat.shape[1]:
                result[:] = 0.0
            parts.append(FilteredColumns(flat, used, result))
        *before, (sections, padding) = self.stages
        for some in [[part] for part in parts] if before else [parts]:  # whole copies of one alone
            for earlier in before:
                whole = [replace(one, out=np.empty(one.x.shape)) for one in some]
                zero_phase_columns(whole, *earlier, self.where)
                some = [replace(a, x=b.out) for a, b in zip(some, whole, strict=True)]
            zero_phase_columns(some, sections, padding, self.where, rows=rows)


def _used(flat: np.ndarray) -> np.ndarray:
    """Numbers of the columns that are not zero throughout.

    Many columns of a regressor are: a link does not load the joints beyond it.
    """
    if flat.shape[1] < _FEW:
        return np.arange(flat.shape[1])
    some = flat[0] != 0.0
    for column in np.flatnonzero(~some):
        some[column] = flat[:, column].any()
    return np.flatnonzero(some)


def _as_slice(rows: np.ndarray) -> np.ndarray | slice:
    """Rows that are evenly apart as a slice, which copies nothing."""
    if len(rows) < 2:
        return rows
    step = int(rows[1] - rows[0])
    even = rows[-1] - rows[0] == step * (len(rows) - 1) and np.all(np.diff(rows) == step)
    return slice(int(rows[0]), int(rows[-1]) + 1, step) if even else rows


def _width(x: np.ndarray) -> int:
    return math.prod(x.shape[1:])


def choose_factor(rate_hz: float, target_rate: float, period: float | None = None) -> int:
    """Decimation factor near the requested rate that, if possible, divides a period's samples.

    Parameters
    ----------
    rate_hz : sampling rate.
    target_rate : requested rate; at or above `rate_hz` nothing is decimated.
    period : s, or None.

    Returns
    -------
    The divisor of the samples of a period nearest to rate_hz / target_rate if it is within 20 %
    of it; else rate_hz / target_rate, rounded.
    """
    ratio = max(1.0, rate_hz / target_rate)
    plain = max(1, round(ratio))
    samples = round(period * rate_hz) if period else 0
    if not samples or abs(samples - period * rate_hz) > 0.25:  # type: ignore[operator]
        return plain
    near = range(max(1, math.ceil(ratio / 1.2)), math.floor(ratio * 1.2) + 1)
    divisors = [factor for factor in near if samples % factor == 0]
    return min(divisors, key=lambda factor: abs(math.log(factor / ratio)), default=plain)
