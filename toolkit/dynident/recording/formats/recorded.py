"""A recording of the columns of a table, as far as they are sound."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_names import LocatedColumn
from dynident.recording.formats.column_table import ColumnTable, left_of
from dynident.recording.formats.column_values import gather
from dynident.recording.formats.sound_stretch import said_of, sound_part, sound_stretch
from dynident.recording.recording import Provenance, Recording
from dynident.settings import LONGEST_SESSION

Window = tuple[float, float]
_LATEST = 1e11  # s, beyond which a number is the time of no clock
_STAMPS = 1000  # that are looked at to tell what a clock counts from


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What is made a recording of.

    Attributes
    ----------
    columns : ours -> where it is in a table; `t` is among them.
    signals : (ours -> (k,) next values) -> signals of these rows, (k,) or (k, n) each.
    joints : n names.
    path : of the file, after which the recording is named.
    record : which one of a file that holds several; "" for one that does not.
    """

    columns: Mapping[str, LocatedColumn]
    signals: Callable[[Mapping[str, np.ndarray]], dict[str, np.ndarray]]
    joints: Sequence[str]
    path: Path
    record: str = ""


def recorded(table: ColumnTable, wanted: Wanted, sound_in: Window | None) -> Recording:
    """Return the recording of some columns.

    Parameters
    ----------
    table : to read from.
    wanted : what.
    sound_in : (t0, t1) s, outside of which there may be faults; None for nowhere.

    Raises
    ------
    FileError, RecordingError
        If they cannot be read, or are no recording.
    """
    try:
        found, source = _read(table, wanted)
        whole = _recording(found, source, wanted)
    except RecordingError:
        if sound_in is None:
            raise
        found, source = _read(table.forgiven, wanted)
        sound_in = counted_window(sound_in, source.began) or sound_in
        if _is_lost(found["t"], sound_in):
            raise  # the first error says more than that the window holds no samples
        return _recording(*_sound(found, source, sound_in), wanted)
    return sound_part(whole, counted_window(sound_in, whole.provenance.began))


def _read(table: ColumnTable, wanted: Wanted) -> tuple[dict[str, Any], Provenance]:
    """Signals of all rows, and where they are from."""
    found, place = gather(table, wanted.columns, wanted.signals)
    began = _began(found["t"])
    if began:
        found["t"] = found["t"] - began
    first_line, comment_lines = table.lines()
    used = [term.name for one in wanted.columns.values() for term in one.terms]
    return found, Provenance(
        str(wanted.path),
        table.sha256,
        record=wanted.record,
        columns=tuple((ours, one.name, one.scale) for ours, one in wanted.columns.items()),
        skipped=left_of(table, used),
        first_line=first_line,
        comment_lines=comment_lines,
        place=place,
        began=began,
    )


def _began(t: np.ndarray) -> float:
    """What a clock that is none of a session shows at first, s; else zero.

    Most of its stamps say so: some may be faulty, also the first.
    """
    some = t[:: max(1, len(t) // _STAMPS)]
    some = some[np.isfinite(some)]
    if not len(some) or not LONGEST_SESSION < np.median(some) < _LATEST:
        return 0.0
    return float(t[np.argmax((t > LONGEST_SESSION) & (t < _LATEST))])


def counted_window(window: Window | None, began: float) -> Window | None:
    """Return a window (s) on the clock of a recording whose file's clock showed `began` at first.

    Parameters
    ----------
    window : on that clock, or on the file's where that is none of a session; None for all.
    began : s, as of `Provenance`.
    """
    if window is None or window[0] <= LONGEST_SESSION:
        return window
    return window[0] - began, window[1] - began


def _recording(found: Mapping[str, Any], source: Provenance, wanted: Wanted) -> Recording:
    name = wanted.record or wanted.path.stem
    return Recording(joints=tuple(wanted.joints), name=name, provenance=source, **found)


def _is_lost(t: np.ndarray, window: Window) -> bool:
    """Whether a window may be among the rows whose time is unknown: no other is in it."""
    known = np.isfinite(t)
    return not known.all() and not (known & (t >= window[0]) & (t < window[1])).any()


def _sound(
    found: Mapping[str, Any], source: Provenance, window: Window
) -> tuple[dict[str, Any], Provenance]:
    """Signals of the sound stretch around a window, and where they are from."""
    # At a joint without a temperature there is none in any row.
    given = {"temperature": lambda x: x[:, ~np.isnan(x).all(axis=0)]}
    signals = [given.get(name, lambda x: x)(x) for name, x in found.items() if name != "t"]
    t, file = found["t"], source.file
    rows = sound_stretch(t, signals, window, file, lambda k: source.row(k, file))
    said = (said_of(rows, len(t), window),) if rows != slice(0, len(t)) else ()
    return {signal: x[rows] for signal, x in found.items()}, replace(
        source, skipped=(*source.skipped, *said), first_line=source.line(rows.start)
    )
