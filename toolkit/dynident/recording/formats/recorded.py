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

Window = tuple[float, float]


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
        whole = _recording(table, wanted, None)
    except RecordingError:
        if sound_in is None:
            raise
        return _recording(table.forgiven, wanted, sound_in)
    return sound_part(whole, sound_in)


def _recording(table: ColumnTable, wanted: Wanted, sound_in: Window | None) -> Recording:
    found, place = gather(table, wanted.columns, wanted.signals)
    first_line, comment_lines = table.lines()
    used = [term.name for one in wanted.columns.values() for term in one.terms]
    skipped = left_of(table, used)
    source = Provenance(
        str(wanted.path),
        table.sha256,
        record=wanted.record,
        columns=tuple((ours, one.name, one.scale) for ours, one in wanted.columns.items()),
        first_line=first_line,
        comment_lines=comment_lines,
        place=place,
    )
    changes: dict[str, Any] = {}
    if sound_in is not None:
        rows, samples = _stretch(found, sound_in, source), len(found["t"])
        if rows != slice(0, samples):
            skipped = (*skipped, said_of(rows, samples, sound_in))
        found = {signal: x[rows] for signal, x in found.items()}
        changes = {"first_line": source.line(rows.start)}
    return Recording(
        joints=tuple(wanted.joints),
        name=wanted.record or wanted.path.stem,
        provenance=replace(source, skipped=skipped, **changes),
        **found,
    )


def _stretch(found: Mapping[str, np.ndarray], window: Window, source: Provenance) -> slice:
    # At a joint without a temperature there is none in any row.
    given = {"temperature": lambda x: x[:, ~np.isnan(x).all(axis=0)]}
    signals = [given.get(name, lambda x: x)(x) for name, x in found.items() if name != "t"]
    file = source.file
    return sound_stretch(found["t"], signals, window, file, lambda k: source.row(k, file))
