"""Files of several records: a table of numbers each, and one list of names for the columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable
from dynident.recording.formats.limits import require_few
from dynident.words import did_you_mean

COLUMNS = "columns"
"""Array of text, in the same file, that names the columns of every record."""


def pick(table: ColumnTable, record: str) -> ColumnTable:
    """Return one record of a file as a table of its own.

    Parameters
    ----------
    table : of a file with one two-dimensional array for each record (a row a sample), and their
        columns named by the array `columns`.
    record : name of the array.

    Raises
    ------
    RecordingError
        If there is no such record, it is no table of numbers, or its columns are not named.
    """
    if COLUMNS not in table.names:
        what = f"record '{record}' is asked for, and no array '{COLUMNS}' names its columns"
        remedy = "records are for NPZ and MAT files; else map the columns, as name[0]"
        raise RecordingError(what, table.file, remedy)
    records = [name for name in table.names if name != COLUMNS]
    if record not in records:
        shown = ", ".join(records[:20]) + (", ..." if len(records) > 20 else "")
        remedy = did_you_mean(record, records, f"it holds {shown or 'none'}")
        raise RecordingError(f"no record '{record}'", table.file, remedy)
    names = _column_names(table)
    where = f"{table.file}, record {record}"

    def picked(x: np.ndarray, wanted: Sequence[str]) -> dict[str, np.ndarray]:
        if x.ndim != 2 or x.shape[1] != len(names):
            what = f"has the shape {x.shape}, and {len(names)} columns are named"
            raise RecordingError(what, where, "save one row a sample and one column a name")
        return {name: x[:, names.index(name)] for name in wanted}

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        return picked(table.load([record])[record], wanted)

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        for part in table.in_parts([record]):
            yield picked(part[record], wanted)

    others = [name for name in records if name != record]
    also = (f"{len(others)} other record{'s' * (len(others) != 1)}",) if others else ()
    return replace(table, file=where, names=names, load=load, parts=parts, skipped=lambda _: also)


def _column_names(table: ColumnTable) -> tuple[str, ...]:
    array = table.load([COLUMNS])[COLUMNS]
    if array.dtype.kind != "U" or not array.size:
        what = f"'{COLUMNS}' does not hold names (it is {array.dtype})"
        raise RecordingError(what, table.file, "save it as an array of text")
    # MATLAB pads the rows of a table of letters to one length.
    names = tuple(str(name).strip() for name in array.ravel())
    require_few(len(names), "columns", table.file)
    for name in names:
        if names.count(name) > 1:
            what = f"'{COLUMNS}' holds the name '{name}' twice"
            raise RecordingError(what, table.file, "name each column once")
    return names
