"""Which rows of a recording may be used: one place for fits, instruments, diagnosis, validation.

Left out are: rows near either end, where the parallel filter makes up what it does not see (with
unfiltered noise); a robot that stands still at the start or at the end, whose dry friction may be
anything; the transient of a loop before a motion repeats; and what the study's window excludes. A
pose that is held in the middle of a recording was chosen, and stays.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from dynident.recording.filters import Filter
from dynident.recording.masks import within
from dynident.recording.parallel import ParallelFilter
from dynident.recording.recording import LeftOut, Recording
from dynident.recording.repetition import as_points, turning_round
from dynident.recording.white_noise import encoder_noise_std

_IDLE = 0.25  # s of standing still at an end that are worth leaving out
_MOVES = 1e-3  # of a joint's travel by which it must leave its place at an end
_NOISE = 6.0  # standard deviations of the position's noise likewise
_SETTLED = 5.0  # times the later differences of repetitions, above which a loop has not settled
_FINE = 1e-4  # of a joint's travel by which repetitions may differ in any case
_AT_ONCE = 65536  # samples that are looked at
_COMPARED = 8192  # samples that are compared with those of the next period at a time
_QUIET = 0.1  # s that repetitions must agree for a transient to be over

STANDS_STILL = "standing still"
TRANSIENT = "transient before the motion repeats"
FILTER_ENDS = "the filter sees past the ends"


def usable(recording: Recording) -> Recording:
    """Return the recording with a window that leaves out what is of no use.

    Copies of it (with other positions, say) keep that window, so that their rows belong together.

    Parameters
    ----------
    recording : as it was recorded; one that has been looked at comes back as it is.

    Returns
    -------
    Recording
        With `left_out`, and the window that follows from it and from its own.
    """
    if recording.left_out is not None:
        return recording
    start, stop = float(recording.t[0]), float(recording.t[-1])
    # Of what repeats, standing still is a part of every repetition.
    begins, ends = (start, stop) if recording.period else _moves(recording)
    found = []
    if begins - start >= _IDLE:
        found.append(LeftOut(reason=STANDS_STILL, start=start, stop=begins))
    settled = _settled(recording)
    if settled > start:
        found.append(LeftOut(reason=TRANSIENT, start=start, stop=settled))
    if stop - ends >= _IDLE:
        found.append(LeftOut(reason=STANDS_STILL, start=ends, stop=stop))
    low, high = recording.window or (-np.inf, np.inf)
    for one in found:
        if one.start == start:
            low = max(low, one.stop)
        else:
            high = min(high, one.start)
    if not found or not low < high:
        # A window that asks for just these stretches means them.
        return recording.replace(left_out=())
    return recording.replace(window=(low, high), left_out=tuple(found))


def usable_rows(recording: Recording, parallel: ParallelFilter, first: int, samples: int) -> slice:
    """Decide which decimated rows may be used.

    Parameters
    ----------
    recording : whose window holds.
    parallel : the filter of columns and torque.
    first, samples : the recording's samples that pass the filter, from which and how many.

    Returns
    -------
    slice
        Of the decimated rows; it may be empty.

    Raises
    ------
    RecordingError
        If the window holds no row at all.
    """
    t = recording.t[first : first + samples]
    rows = _RowTimes(parallel, t)
    start, stop = 0, rows.count
    if recording.window is not None:
        low, high = recording.window
        slack = rows.slack
        start, stop = rows.before(low - slack), rows.before(high - slack)
        if stop <= start:
            within(parallel.times(t), low, high, recording.where)  # which says why
    if parallel.filter.ends == "drop":
        margin = parallel.transient - 1e-6 / parallel.rate_hz
        start = max(start, rows.before(t[0] + margin))
        stop = min(stop, rows.until(t[-1] - margin))
    return slice(start, stop) if stop > start else slice(0, 0)


class _RowTimes:
    """Time stamps of decimated rows, found without listing them.

    Parameters
    ----------
    parallel : that decimates.
    t : (T,) s, samples that pass it.
    """

    def __init__(self, parallel: ParallelFilter, t: np.ndarray) -> None:
        self._parallel, self._t = parallel, t
        self.count = parallel.count(len(t))

    @property
    def slack(self) -> float:
        """As `within` has it: rounding that has put a stamp just before a limit."""
        return 1e-3 * (self._at(self.count - 1) - self._at(0)) / max(self.count - 1, 1)

    def before(self, limit: float) -> int:
        """How many rows are earlier than a time."""
        return bisect_left(range(self.count), limit, key=self._at)

    def until(self, limit: float) -> int:
        """How many rows are not later than a time."""
        return bisect_right(range(self.count), limit, key=self._at)

    def _at(self, row: int) -> float:
        return float(self._t[self._parallel.row(len(self._t), row)])


@dataclass(frozen=True, kw_only=True)
class RowCount:
    """Decimated rows of recordings: how many are used, and why the others are not.

    Attributes
    ----------
    used : rows that count.
    ends : near an end, where the filters see past the record.
    standstill : before the robot moves, or after.
    transient : before the motion repeats.
    window : outside the windows of the study.
    """

    used: int = 0
    ends: int = 0
    standstill: int = 0
    transient: int = 0
    window: int = 0

    def __add__(self, other: RowCount) -> RowCount:
        """Count the rows of both."""
        return RowCount(
            **{one.name: getattr(self, one.name) + getattr(other, one.name) for one in fields(self)}
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the count as JSON says it."""
        dropped = asdict(self)
        return {"used": dropped.pop("used"), "dropped": dropped}


def count_rows(recording: Recording, settings: Filter) -> RowCount:
    """Return how many decimated rows of a recording are used, and why the others are not.

    Parameters
    ----------
    recording : on a uniform clock.
    settings : its filter.
    """
    parallel = ParallelFilter(settings, recording.rate_hz, recording.period, recording.where)
    first, last = settings.margins(recording.rate_hz)
    kept = usable_rows(recording, parallel, first, recording.samples - first - last)
    every = _RowTimes(parallel, recording.t)
    reasons = {STANDS_STILL: 0, TRANSIENT: 0}
    taken: list[range] = []
    for one in recording.left_out or ():
        inside = range(every.before(one.start), every.until(one.stop))
        reasons[one.reason] += _union([*taken, inside]) - _union(taken)
        taken.append(inside)
    low, high = recording.window or (-np.inf, np.inf)
    outside = [range(every.before(low)), range(every.before(high), every.count)]
    window = _union([*taken, *outside]) - _union(taken)
    used = kept.stop - kept.start
    rest = every.count - used - window - sum(reasons.values())
    return RowCount(
        used=used,
        ends=max(rest, 0),
        standstill=reasons[STANDS_STILL],
        transient=reasons[TRANSIENT],
        window=window,
    )


def _union(ranges: list[range]) -> int:
    """How many numbers are in at least one of some ranges."""
    count, reached = 0, 0
    for one in sorted(ranges, key=lambda one: one.start):
        count += max(0, one.stop - max(one.start, reached))
        reached = max(reached, one.stop)
    return count


def rows_in_words(recording: Recording, settings: Filter) -> str:
    """Return the same in words, with the stretches that are left out.

    Parameters
    ----------
    recording : on a uniform clock.
    settings : its filter.
    """
    parallel = ParallelFilter(settings, recording.rate_hz, recording.period, recording.where)
    count = count_rows(recording, settings)
    words = [f"{count.used} of {parallel.count(recording.samples)} rows used"]
    if settings.ends == "drop":
        margins = settings.margins(recording.rate_hz)
        ends = [n / recording.rate_hz + parallel.transient for n in margins]
        words.append(f"{FILTER_ENDS} ({ends[0]:.3g} and {ends[1]:.3g} s)")
    else:
        words.append("ends kept")
    words += [
        f"{one.reason} from {one.start:.4g} to {one.stop:.4g} s" for one in recording.left_out or ()
    ]
    if recording.window is not None and not recording.left_out:
        words.append(f"window {recording.window[0]:.4g} to {recording.window[1]:.4g} s")
    return "; ".join(words)


def _moves(recording: Recording) -> tuple[float, float]:
    """When a joint first leaves its place, and when the last one comes to rest, s."""
    q, t = recording.q, recording.t
    least = np.maximum(_MOVES * (q.max(axis=0) - q.min(axis=0)), _NOISE * encoder_noise_std(q))
    start, stop = _leaves(q, q[0], least), _leaves(q[::-1], q[-1], least)
    if start is None or stop is None:
        return float(t[0]), float(t[-1])  # nothing moves at all, or noise alone does
    return float(t[start]), float(t[len(t) - 1 - stop])


def _leaves(q: np.ndarray, place: np.ndarray, least: np.ndarray) -> int | None:
    """First row (T, n) in which a joint is farther from a place than so much."""
    for start in range(0, len(q), _AT_ONCE):
        far = np.flatnonzero(np.any(np.abs(q[start : start + _AT_ONCE] - place) > least, axis=1))
        if len(far):
            return start + int(far[0])
    return None


def _settled(recording: Recording) -> float:
    """Time from which the motion repeats, s; the start where it does at once or never."""
    start = float(recording.t[0])
    period = recording.period
    if period is None or recording.duration < 1.5 * period:
        return start
    count = int(np.searchsorted(recording.t, recording.t[-1] - period, side="right"))
    t = recording.t[:count]
    # The first period against the second; what differs later is noise, or a drift.
    head = int(np.searchsorted(t, start + period))
    later = slice(head, count) if count - head > count // 4 else slice(count // 2, count)
    squares = sum(np.sum(apart**2, axis=0) for apart in _apart(recording, later))
    usual = np.sqrt(squares / (later.stop - later.start))
    travel = np.ptp(as_points(recording.q, turning_round(recording)), axis=0)
    least = np.maximum(_SETTLED * usual, _FINE * travel)
    parts = [np.any(apart > least, axis=1) for apart in _apart(recording, slice(0, head))]
    far = np.flatnonzero(np.concatenate(parts))
    if not len(far) or t[far[0]] - start > _QUIET:
        return start
    over = far[-1]
    for one, two in pairwise(far):
        if t[two] - t[one] > _QUIET:
            over = one
            break
    settled = float(t[over])
    # Half a period and more is no transient: it does not repeat, which others say.
    return settled if settled - start < period / 2 else start


def _apart(recording: Recording, rows: slice) -> Iterator[np.ndarray]:
    """How far the positions of some rows are from those a period later, as points, part by part."""
    t, q, turning = recording.t, recording.q, turning_round(recording)
    for start in range(rows.start, rows.stop, _COMPARED):
        stop = min(start + _COMPARED, rows.stop)
        later = t[start:stop] + recording.period
        low = max(0, int(np.searchsorted(t, later[0], side="right")) - 1)
        high = int(np.searchsorted(t, later[-1])) + 1
        there = t[low:high]
        points = as_points(q[low:high], turning)
        again = [np.interp(later, there, column) for column in points.T]
        yield np.abs(np.stack(again, axis=1) - as_points(q[start:stop], turning))
