"""Any file of data opened as the table that it holds, before its columns are given our names."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynident import files
from dynident.errors import FileError, RecordingError
from dynident.recording.formats.binary_files import open_mat, open_npz, open_parquet, pick
from dynident.recording.formats.column_table import ColumnTable, FileLayout
from dynident.recording.formats.csv_file import open_csv
from dynident.recording.formats.hdf5_file import open_hdf5
from dynident.recording.formats.limits import ARRAYS, CUT, TEXT, SizeLimit
from dynident.recording.formats.ros_bag import SUFFIXES as BAGS
from dynident.recording.formats.ros_bag import is_bag, open_bag

DEFAULT_LAYOUT = FileLayout()


@dataclass(frozen=True)
class _Format:
    """How files of a format are opened: (content, name for messages, layout) -> table."""

    open: Callable[[bytes, str, FileLayout], ColumnTable]
    limit: SizeLimit


_FORMATS = {
    ".csv": _Format(open_csv, TEXT),
    ".npz": _Format(lambda data, file, _: open_npz(data, file), ARRAYS),
    ".mat": _Format(lambda data, file, _: open_mat(data, file), ARRAYS),
    ".parquet": _Format(lambda data, file, _: open_parquet(data, file), ARRAYS),
    ".h5": _Format(lambda data, file, _: open_hdf5(data, file), ARRAYS),
    ".hdf5": _Format(lambda data, file, _: open_hdf5(data, file), ARRAYS),
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
    """The table of a file that is read as a whole."""
    where, suffix = str(path), path.suffix.lower()
    form = _FORMATS.get(suffix)
    if form is None and path.is_dir():
        what = "is a folder, and not one that ROS 2 records into: it holds no metadata.yaml"
        raise FileError(what, where, "name a file in it")
    if form is None:
        raise unknown_suffix(path, READABLE)
    if layout.topic:
        raise RecordingError(f"topic = {layout.topic!r} is of a bag", where, "leave it out")
    if suffix != ".csv" and layout.names not in ((), "numbered"):
        what, remedy = "columns are named by position", "only text files without a header need that"
        raise RecordingError(what, where, remedy)
    data = files.read_bytes(path, form.limit.stored, CUT)
    if not data:
        raise RecordingError("is empty", where, "is the file complete?")
    return replace(form.open(data, where, layout), sha256=hashlib.sha256(data).hexdigest())


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
        x = next(iter(found.values()), np.empty(0))
        samples = x.size if x.ndim < 2 or 1 in x.shape else len(x)
        return {**{name: found[name] for name in others}, "t": np.arange(samples) / rate_hz}

    return replace(table, names=("t", *table.names), load=load)


def unknown_suffix(path: Path, known: Sequence[str]) -> RecordingError:
    """Return the error for a file whose suffix names no format."""
    what = f"the suffix '{path.suffix}' names no format" if path.suffix else "has no suffix"
    return RecordingError(what, str(path), f"formats: {', '.join(known)}")
