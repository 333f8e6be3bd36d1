"""Any file of data opened as the table that it holds, before its columns are given our names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dynident.errors import FileError, RecordingError
from dynident.recording.formats.arrays.hdf5_file import open_hdf5
from dynident.recording.formats.arrays.mat_file import open_mat
from dynident.recording.formats.arrays.npy_file import open_npy
from dynident.recording.formats.arrays.npz_file import open_npz
from dynident.recording.formats.arrays.parquet_file import open_parquet
from dynident.recording.formats.arrays.records import pick
from dynident.recording.formats.column_table import ColumnTable, FileLayout
from dynident.recording.formats.file_source import FileSource, open_source
from dynident.recording.formats.limits import CUT, STREAMED
from dynident.recording.formats.ros_bag import SUFFIXES as BAGS
from dynident.recording.formats.ros_bag import is_bag, open_bag
from dynident.recording.formats.text.csv_file import open_csv
from dynident.recording.recording import TEXTS

DEFAULT_LAYOUT = FileLayout()


_Open = Callable[[FileSource, str, FileLayout], ColumnTable]
"""(content, name for messages, layout) -> table"""

_FORMATS: dict[str, _Open] = {
    **dict.fromkeys(TEXTS, open_csv),
    ".npz": lambda source, file, _: open_npz(source, file),
    ".mat": lambda source, file, _: open_mat(source, file),
    ".parquet": lambda source, file, _: open_parquet(source, file),
    ".h5": lambda source, file, _: open_hdf5(source, file),
    ".hdf5": lambda source, file, _: open_hdf5(source, file),
    ".npy": open_npy,
}
READABLE = (*_FORMATS, *BAGS)
"""Suffixes of the files that are read."""


def open_table(
    path: str | Path, record: str | None = None, *, layout: FileLayout = DEFAULT_LAYOUT
) -> ColumnTable:
    """Open a file of data as the table that it holds, its columns under the file's own names.

    Parameters
    ----------
    path : file; its suffix says its format.
    record : which one of an NPZ or MAT file that holds several; see `read`.
    layout : what the file does not say of itself: names of its columns, a rate, a topic.

    Returns
    -------
    ColumnTable
        Names of the columns, and a function that loads some of them. Where the layout gives a rate,
        `t` (s) is one of them.

    Raises
    ------
    FileError
        If the file is not there, is no regular file, cannot be read or is too large.
    RecordingError
        If it is not what its suffix says, or the layout does not fit it.
    """
    path = Path(path)
    try:
        table = open_bag(path, layout) if is_bag(path) else _opened(path, layout)
    except MemoryError:
        raise RecordingError("does not fit into memory", str(path), CUT) from None
    if record is not None:
        table = pick(table, record)
    return table if layout.rate_hz is None else _with_clock(table, layout.rate_hz)


def _opened(path: Path, layout: FileLayout) -> ColumnTable:
    """The table of a file that is no bag."""
    where, suffix = str(path), path.suffix.lower()
    form = _FORMATS.get(suffix)
    if form is None and path.is_dir():
        what = "is a folder, and not one that ROS 2 records into: it holds no metadata.yaml"
        raise FileError(what, where, "name a file in it")
    if form is None:
        raise unknown_suffix(path, READABLE)
    if layout.topic:
        raise RecordingError(f"topic = {layout.topic!r} is of a bag", where, "leave it out")
    if suffix not in (*TEXTS, ".npy") and layout.names not in ((), "numbered"):
        what = "columns are named by position"
        remedy = "only text files without a header, and NPY files, need that"
        raise RecordingError(what, where, remedy)
    source = open_source(path, STREAMED.stored, CUT)
    if not source.size:
        raise RecordingError("is empty", where, "is the file complete?")
    # What is of no use is not hashed first, which takes long where it is large.
    return replace(form(source, where, layout), sha256=source.sha256())


def _with_clock(table: ColumnTable, rate_hz: float) -> ColumnTable:
    """The table with a column `t` of equal steps, s."""
    if "t" in table.there:
        what = f"rate_hz = {rate_hz:g} is given, and the file has a column of time, 't'"
        raise RecordingError(what, table.file, "leave out the rate, or do not name that column t")

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        others = [name for name in wanted if name != "t"]
        found = table.load(others or table.names[:1])
        if "t" not in wanted:
            return found
        return _clocked(found, others, range(_samples(found)))

    def with_clock(table: ColumnTable, wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        others = [name for name in wanted if name != "t"]
        seen = 0
        for found in table.in_parts(others or table.names[:1]):
            rows = range(seen, seen + _samples(found))
            yield _clocked(found, others, rows) if "t" in wanted else found
            seen = rows.stop

    def _clocked(
        found: Mapping[str, np.ndarray], others: Sequence[str], rows: range
    ) -> dict[str, np.ndarray]:
        t = np.arange(rows.start, rows.stop) / rate_hz
        return {**{name: found[name] for name in others}, "t": t}

    return replace(
        table,
        names=("t", *table.names),
        load=load,
        parts=lambda wanted: with_clock(table, wanted),
        forgiving=lambda wanted: with_clock(table.forgiven, wanted),
    )


def _samples(found: Mapping[str, np.ndarray]) -> int:
    """How many samples columns have, by the first of them."""
    x = next(iter(found.values()), np.empty(0))
    return x.size if x.ndim < 2 or 1 in x.shape else len(x)


def unknown_suffix(path: Path, known: Sequence[str]) -> RecordingError:
    """Return the error for a file whose suffix names no format."""
    what = f"the suffix '{path.suffix}' names no format" if path.suffix else "has no suffix"
    return RecordingError(what, str(path), f"formats: {', '.join(known)}")
