"""What of a faulty recording can be used: the sound stretch around a window.

A filter needs what is before and after a window, so no more is left out than from the next fault
on: a value that is no number, a clock that does not go on, a gap that cannot be bridged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.recording import LARGEST, Recording
from dynident.recording.uniform import is_gap, may_have_gaps

_REACH = 1.5
"""Time steps by which the stretch may be short of a window where a fault ends it."""


def sound_stretch(
    t: np.ndarray,
    signals: Iterable[np.ndarray],
    window: tuple[float, float],
    where: str,
    row: Callable[[int], str],
) -> slice:
    """Return the rows from the last fault before a window to the first one after it.

    Where there is a fault within the window, or the clock passes it twice, rows with faults are
    among them; `Recording` then says which.

    Parameters
    ----------
    t : (T,) s, with any faults.
    signals : (T, n) each.
    window : (t0, t1) s on that clock.
    where : file, for messages.
    row : (index of a row, from 0) -> where it is, for messages.

    Raises
    ------
    RecordingError
        If the window holds no row, or a fault keeps the stretch from reaching one of its ends.
        Where the file begins or ends within the window there is no fault.
    """
    sound = np.abs(t) < LARGEST
    inside = np.flatnonzero(sound & (t >= window[0]) & (t < window[1]))
    if not len(inside):
        what = f"the window [{window[0]:g}, {window[1]:g}] s holds no samples"
        raise RecordingError(what, where, "is it on the clock of the file?")
    for x in signals:
        sound &= (np.abs(x) < LARGEST).all(axis=1)
    with np.errstate(invalid="ignore"):
        steps = np.diff(t)
        forward = steps[steps > 0]
        usual = float(np.median(forward)) if len(forward) else 1.0
        # Of two stamps in the wrong order either may be wrong: the later one is left out, too.
        sound[1:] &= ~(steps <= 0)
        goes_on = (steps > 0) & ~is_gap(steps, 1.0 / usual)
    broken = np.flatnonzero(~(goes_on & sound[1:] & sound[:-1])) + 1  # rows that do not follow on
    first, last = int(inside[0]), int(inside[-1])
    before, after = broken[broken <= first], broken[broken > last]
    start = int(before[-1]) if len(before) else 0
    stop = int(after[0]) if len(after) else len(t)
    fault = f"a fault leaves the window [{window[0]:g}, {window[1]:g}] s without its samples"
    # The time of a line at fault may be unknown: it is taken to be that of its neighbours.
    if start and t[start] - _REACH * usual > window[0]:
        what = f"{fault} up to {t[start]:g} s"
        remedy = f"repair it, or let the window begin at {t[start]:g} s"
        raise RecordingError(what, row(start - 1), remedy)
    if stop < len(t) and t[stop - 1] + _REACH * usual < window[1]:
        what = f"{fault} from {t[stop - 1]:g} s on"
        remedy = f"repair it, or let the window end at {t[stop - 1]:g} s"
        raise RecordingError(what, row(stop), remedy)
    return slice(start, stop)


def sound_part(recording: Recording, window: tuple[float, float] | None) -> Recording:
    """Return a recording up to the gaps around a window that are too long to be bridged.

    Parameters
    ----------
    recording : all of it.
    window : (t0, t1) s; None for all.
    """
    if window is None or not may_have_gaps(recording):
        return recording
    passed = recording.t[0] < window[1] and recording.t[-1] >= window[0]
    if not passed:  # whoever applies the window says so
        return recording
    rows = sound_stretch(recording.t, (), window, recording.where, recording.row)
    if rows == slice(0, recording.samples):
        return recording
    found = recording.part(rows)
    said = said_of(rows, recording.samples, window)
    skipped = (*found.provenance.skipped, said)
    return found.replace(provenance=replace(found.provenance, skipped=skipped))


def said_of(rows: slice, samples: int, window: tuple[float, float]) -> str:
    """Return what is left out of a file, in words.

    Parameters
    ----------
    rows : that are kept.
    samples : of the file.
    window : (t0, t1) s, which was asked for.
    """
    before, after = rows.start, samples - rows.stop
    count = before + after
    return (
        f"{count} sample{'s' * (count != 1)} beyond faults outside the window [{window[0]:g}, "
        f"{window[1]:g}] s: {before} before it, {after} after it"
    )
