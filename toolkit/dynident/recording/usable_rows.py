"""Which rows of a recording may be used: one place for fits, instruments, diagnosis, validation.

Left out are: rows near either end, where the parallel filter makes up what it does not see (with
unfiltered noise); a robot that stands still at the start or at the end, whose dry friction may be
anything; the transient of a loop before a motion repeats; and what the study's window excludes. A
pose that is held in the middle of a recording was chosen, and stays.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from dynident.recording.filters import Filter
from dynident.recording.masks import within
from dynident.recording.parallel import ParallelFilter
from dynident.recording.recording import LeftOut, Recording
from dynident.recording.white_noise import encoder_noise_std

_IDLE = 0.25  # s of standing still at an end that are worth leaving out
_MOVES = 1e-3  # of a joint's travel by which it must leave its place at an end
_NOISE = 6.0  # standard deviations of the position's noise likewise
_SETTLED = 5.0  # times the later differences of repetitions, above which a loop has not settled
_FINE = 1e-4  # of a joint's travel by which repetitions may differ in any case
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


def usable_rows(
    recording: Recording, parallel: ParallelFilter, t: np.ndarray, times: np.ndarray
) -> slice:
    """Decide which decimated rows may be used.

    Parameters
    ----------
    recording : whose window holds.
    parallel : the filter of columns and torque.
    t : (T,) s, samples that pass the filter.
    times : (R,) s, of the decimated rows.

    Returns
    -------
    slice
        Of the decimated rows; it may be empty.

    Raises
    ------
    RecordingError
        If the window holds no row at all.
    """
    kept = np.ones(len(times), dtype=bool)
    if recording.window is not None:
        kept = within(times, *recording.window, recording.where)
    if parallel.filter.ends == "drop":
        slack = 1e-6 / parallel.rate_hz
        margin = parallel.transient - slack
        kept &= (times >= t[0] + margin) & (times <= t[-1] - margin)
    inside = np.flatnonzero(kept)
    return slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0, 0)


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
    t = recording.t[first : recording.samples - last]
    kept = usable_rows(recording, parallel, t, parallel.times(t))
    every = parallel.times(recording.t)
    reasons = {STANDS_STILL: 0, TRANSIENT: 0}
    taken = np.zeros(len(every), dtype=bool)
    for one in recording.left_out or ():
        inside = (every >= one.start) & (every <= one.stop) & ~taken
        reasons[one.reason] += int(inside.sum())
        taken |= inside
    low, high = recording.window or (-np.inf, np.inf)
    window = int(np.sum(((every < low) | (every >= high)) & ~taken))
    used = kept.stop - kept.start
    rest = len(every) - used - window - sum(reasons.values())
    return RowCount(
        used=used,
        ends=max(rest, 0),
        standstill=reasons[STANDS_STILL],
        transient=reasons[TRANSIENT],
        window=window,
    )


def rows_in_words(recording: Recording, settings: Filter) -> str:
    """Return the same in words, with the stretches that are left out.

    Parameters
    ----------
    recording : on a uniform clock.
    settings : its filter.
    """
    parallel = ParallelFilter(settings, recording.rate_hz, recording.period, recording.where)
    count = count_rows(recording, settings)
    words = [f"{count.used} of {len(parallel.rows(recording.samples))} rows used"]
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
    least = np.maximum(_MOVES * np.ptp(q, axis=0), _NOISE * encoder_noise_std(q))
    from_start = np.flatnonzero(np.any(np.abs(q - q[0]) > least, axis=1))
    from_end = np.flatnonzero(np.any(np.abs(q - q[-1]) > least, axis=1))
    if not len(from_start) or not len(from_end):
        return float(t[0]), float(t[-1])  # nothing moves at all
    return float(t[from_start[0]]), float(t[from_end[-1]])


def _settled(recording: Recording) -> float:
    """Time from which the motion repeats, s; the start where it does at once or never."""
    start = float(recording.t[0])
    period = recording.period
    if period is None or recording.duration < 1.5 * period:
        return start
    t = recording.t[recording.t <= recording.t[-1] - period]
    first = recording.q[: len(t)]
    again = np.stack([np.interp(t + period, recording.t, column) for column in recording.q.T], 1)
    apart = np.abs(again - first)
    # The first period against the second; what differs later is noise, or a drift.
    head = t < start + period
    later = apart[~head] if np.count_nonzero(~head) > len(t) // 4 else apart[len(apart) // 2 :]
    usual = np.sqrt(np.mean(later**2, axis=0))
    least = np.maximum(_SETTLED * usual, _FINE * np.ptp(recording.q, axis=0))
    far = np.flatnonzero(np.any(apart[head] > least, axis=1))
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
