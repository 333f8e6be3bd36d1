"""NPY files in: a table of one row a sample, or an array of records whose fields have names."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.arrays.array_header import (
    NUMBERS,
    ArrayHeader,
    read_array_header,
)
from dynident.recording.formats.column_table import ColumnTable, FileLayout, joined, rows_at_once
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    ARRAYS,
    COMPLETE,
    damaged,
    require_few,
    require_streamed,
    require_unpacked,
)

_OF_NUMBERS = "save one row a sample and one column a signal, or an array of records, of numbers"


def open_npy(source: FileSource, file: str, layout: FileLayout) -> ColumnTable:
    """Return the table that an NPY file holds; its rows are read where they lie.

    Parameters
    ----------
    source : the file.
    file : for messages.
    layout : names of the columns, where the array's fields do not name them.

    Raises
    ------
    RecordingError
        If it is no NPY file or ends before its array does, the array is no table of numbers, or its
        columns are named twice or not at all.
    """
    with source.open() as stream:
        try:
            header = read_array_header(stream)
        except Exception as error:
            raise damaged("an NPY file", file, error) from None
        start = stream.tell()
    fields = _fields(header)
    if header is None or fields is None:
        kind = f"the shape {header.shape} and the type {header.dtype}" if header else "no numbers"
        raise RecordingError(f"holds an array with {kind}", file, _OF_NUMBERS)
    rows, across = header.shape[0], header.shape[1:]
    if not rows:
        raise RecordingError("holds no samples", file, COMPLETE)
    row_size = header.dtype.itemsize * math.prod(across)
    if source.size - start < rows * row_size:
        raise RecordingError("ends before its array does", file, COMPLETE)
    if across:
        names = layout.by_position(across[0], file, "the columns of an NPY file have no names")
    else:
        names = layout.by_name(fields, file, "the array's fields name the columns")
    require_few(len(names), "columns", file)
    # Columns of a table are its only field's, a record's are a field each.
    places = {name: k for k, name in enumerate(names) if name}

    def loaded(stream: BinaryIO, first: int, stop: int, wanted: Sequence[str]) -> dict:
        if not across:
            found = _numbers(stream, header, start + first * row_size, stop - first)
            return {name: found[name] for name in wanted}
        if header.by_columns:
            size = header.dtype.itemsize
            return {
                name: _numbers(
                    stream, header, start + (places[name] * rows + first) * size, stop - first
                )
                for name in wanted
            }
        count = (stop - first) * across[0]
        table = _numbers(stream, header, start + first * row_size, count)
        table = table.reshape(stop - first, across[0])
        return {name: table[:, places[name]].copy() for name in wanted}

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        require_streamed(rows * row_size, source.size, file)
        # Never one row alone at the end: that of a table would look like a vector.
        edges = [*range(0, max(rows - 1, 1), rows_at_once(row_size)), rows]
        with source.open() as stream:
            for first, stop in itertools.pairwise(edges):
                yield loaded(stream, first, stop, wanted)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        require_unpacked(rows * row_size, ARRAYS, file)
        return joined(parts(wanted))

    others = tuple(name for name in header.dtype.names or () if name not in names)
    left = (f"no numbers: {', '.join(others)}",) if others else ()
    return ColumnTable(file, names, load, parts=parts, skipped=lambda _: left)


def _fields(header: ArrayHeader | None) -> tuple[str, ...] | None:
    """Fields of numbers of an array, () for a table of them; None where it is neither."""
    if header is None or header.dtype.hasobject:
        return None
    if header.dtype.names is None:
        return () if len(header.shape) == 2 and header.dtype.kind in NUMBERS else None
    fields = [name for name in header.dtype.names if header.dtype[name].base.kind in NUMBERS]
    return tuple(fields) if len(header.shape) == 1 and fields else None


def _numbers(stream: BinaryIO, header: ArrayHeader, place: int, count: int) -> np.ndarray:
    """So many numbers or records from a place of the file on."""
    stream.seek(place)
    return np.frombuffer(stream.read(count * header.dtype.itemsize), header.dtype, count)
