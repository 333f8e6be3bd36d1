"""Columns read as numbers, once it is known where they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_names import ColumnTable, LocatedColumn
from dynident.recording.formats.limits import CUT
from dynident.recording.spooled import Spool

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def gather(
    table: ColumnTable,
    columns: Mapping[str, LocatedColumn],
    signals: Callable[[Mapping[str, np.ndarray]], dict[str, np.ndarray]],
) -> tuple[dict[str, Any], str]:
    """Read columns some rows at a time, and gather the signals that are made of them.

    Parameters
    ----------
    table : to read from.
    columns : ours -> where it is in the table; `t` is among them.
    signals : (ours -> (k,) next values) -> signals of these rows, (k,) or (k, n) each.

    Returns
    -------
    Each signal, read-only, and where they lie if they are too many for the memory, in words

    Raises
    ------
    FileError, RecordingError
        As `load`; if there is no room for them in memory or on the disk.
    """
    try:
        with Spool(table.file) as spool:
            for part in load(table, columns):
                spool.add(signals(part))
            return spool.arrays(), spool.words
    except MemoryError:
        raise RecordingError("does not fit into memory", table.file, CUT) from None


def load(
    table: ColumnTable, columns: Mapping[str, LocatedColumn]
) -> Iterator[dict[str, np.ndarray]]:
    """Read columns as doubles in our units, some rows at a time.

    Parameters
    ----------
    table : to read from.
    columns : ours -> where it is in the table; `t` is among them.

    Yields
    ------
    ours -> (k,) its next values, as many in each column; one part at least

    Raises
    ------
    FileError
        If the file cannot be read to its end, or changes meanwhile.
    RecordingError
        If one does not hold real numbers, is not one-dimensional, or is longer than another.
    """
    names = dict.fromkeys(term.name for one in columns.values() for term in one.terms)
    for arrays in table.in_parts(list(names)):
        found = {ours: _combined(ours, one, arrays, table.file) for ours, one in columns.items()}
        lengths = {ours: len(x) for ours, x in found.items()}
        odd = [ours for ours, length in lengths.items() if length != lengths["t"]]
        if odd:
            raise RecordingError(
                f"{odd[0]} has {lengths[odd[0]]} samples where t has {lengths['t']}",
                table.file,
                "is the file complete?",
            )
        yield found


def _combined(
    ours: str, column: LocatedColumn, arrays: Mapping[str, np.ndarray], file: str
) -> np.ndarray:
    """One of our columns from theirs; a plain name without a scale keeps every bit."""
    found = [arrays[one.name] for one in column.terms]
    found = [seconds_of(x) for x in found] if ours == "t" else found
    vectors = [
        _vector(x, one.name, one.index, file) for x, one in zip(found, column.terms, strict=True)
    ]
    lengths = [len(x) for x in vectors]
    if len(set(lengths)) > 1:
        shown = ", ".join(f"'{one.name}' {n}" for one, n in zip(column.terms, lengths, strict=True))
        what = f"columns of different lengths in the expression for {ours}: {shown} samples"
        raise RecordingError(what, file, "is the file complete?")
    with np.errstate(over="ignore", invalid="ignore"):
        factors = [one.factor for one in column.terms]
        parts = [x if f == 1.0 else f * x for f, x in zip(factors, vectors, strict=True)]
        total = sum(parts[1:], start=parts[0])
        total = total + column.offset if column.offset else total
        return total if column.scale == 1.0 else column.scale * total


def seconds_of(x: np.ndarray) -> np.ndarray:
    """Return dates, or times since one, as seconds since 1970, and anything else as it is."""
    if x.dtype.kind not in "mM":
        return x
    unit, count = np.datetime_data(x.dtype)
    if unit not in _SECONDS:  # days, say
        x, unit, count = x.astype(f"{x.dtype.kind}8[s]"), "s", 1
    return np.where(np.isnat(x), np.nan, count * _SECONDS[unit] * x.astype(np.int64))


def _vector(x: np.ndarray, name: str, index: int | None, file: str) -> np.ndarray:
    if x.dtype.kind not in "fiub":
        what = f"'{name}' does not hold real numbers (it is {x.dtype})"
        raise RecordingError(what, file, "save it as an array of doubles")
    if index is not None:
        if x.ndim != 2 or index >= x.shape[1]:
            remedy = "name[i] is column i, from 0, of a table with one row a sample"
            raise RecordingError(
                f"'{name}' has the shape {x.shape}, and no column {index}", file, remedy
            )
        x = x[:, index]
    elif x.ndim == 2 and 1 in x.shape:
        x = x.ravel()
    if x.ndim != 1:
        remedy = f"map the columns, as {name}[0]" if x.ndim == 2 else "make it one-dimensional"
        raise RecordingError(f"'{name}' has the shape {x.shape}, not (T,)", file, remedy)
    with np.errstate(over="ignore"):
        return x.astype(np.float64)
