"""A file of measurements as it lies there: columns with the file's own names, nothing matched."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dynident.errors import RecordingError
from dynident.recording import ColumnTable, FileLayout, open_table
from dynident.recording.formats.arrays.records import COLUMNS, pick
from dynident.recording.formats.column_values import seconds_of

MOST_COLUMNS = 2000
"""Columns of a file that are looked at."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Log:
    """One record of a file.

    Attributes
    ----------
    file : path as it was given.
    record : which of a file that holds several; empty where it holds one.
    columns : name -> (T,) numbers; `name[k]` for column k of a table. Text is left out.
    names : of all columns in the file, in its order; "" for one that the layout skips.
    skipped : names of what is there and is no column of as many numbers as the others.
    layout : with which it was opened.
    texts : names of columns that hold text.
    unread : why columns could not be read, by name: a cell is empty or no number, say.
    """

    file: Path
    record: str
    columns: Mapping[str, np.ndarray]
    names: tuple[str, ...]
    skipped: tuple[str, ...]
    layout: FileLayout
    texts: frozenset[str] = frozenset()
    unread: Mapping[str, RecordingError] = field(default_factory=dict)

    @property
    def where(self) -> str:
        """How messages call it."""
        return f"{self.file}, record {self.record}" if self.record else str(self.file)

    @property
    def is_unnamed(self) -> bool:
        """Whether its columns have no names but their numbers."""
        own = [name for name in (*self.columns, *self.unread) if name != "t"]
        return bool(own) and all(re.fullmatch(r"column\d+", name) for name in own)


def logs_of(path: str | Path, layout: FileLayout) -> tuple[Log, ...]:
    """Open a file, every record of it.

    Parameters
    ----------
    path : of any format that a study can name.
    layout : what the file does not say of itself.

    Returns
    -------
    One log, or as many as the file has records.

    Raises
    ------
    FileError
        If it cannot be read.
    RecordingError
        If it is no file of measurements, or holds no columns of numbers.
    """
    path = Path(path)
    table = open_table(path, layout=layout)
    if COLUMNS in table.names:
        records = [name for name in table.names if name != COLUMNS]
        if records and table.load([COLUMNS])[COLUMNS].dtype.kind == "U":
            return tuple(_log(path, record, pick(table, record), layout) for record in records)
    return (_log(path, "", table, layout),)


def _log(path: Path, record: str, table: ColumnTable, layout: FileLayout) -> Log:
    found: dict[str, np.ndarray] = {}
    skipped: list[str] = []
    named = [name for name in table.names if name]
    arrays, unread = _arrays(table, named[:MOST_COLUMNS])
    for name in named[:MOST_COLUMNS]:
        columns = _numbers(name, arrays.get(name))
        if columns is None:
            skipped.append(name + _lies(arrays.get(name)))
        else:
            found |= columns
    skipped += named[MOST_COLUMNS:]
    lengths = [len(x) for x in found.values()]
    if not lengths and unread:
        raise next(iter(unread.values()))
    if not lengths:
        what = "holds no column of numbers"
        raise RecordingError(what, table.file, "is it the right file?")
    # Of tables of several lengths (parameters beside samples) the samples are the most.
    most = max(set(lengths), key=lambda n: (n > 1, sum(one == n for one in lengths), n))
    skipped += [name for name, x in found.items() if len(x) != most]
    kept = {name: x for name, x in found.items() if len(x) == most}
    if table.joints == "prefixed" and "t" not in kept:
        # Several drivers on one topic of a bag: the clock is that of messages of these joints.
        kept = {"t": table.load(["t", *kept])["t"], **kept}
        skipped.remove("t")
    return Log(
        file=path,
        record=record,
        columns=kept,
        names=table.names,
        skipped=tuple(skipped),
        layout=layout,
        texts=table.texts,
        unread=unread,
    )


def _arrays(
    table: ColumnTable, names: Sequence[str]
) -> tuple[dict[str, np.ndarray], dict[str, RecordingError]]:
    """What a table holds under some names, at once if it can be, and why some cannot be read."""
    try:
        return table.load(names), {}
    except RecordingError:  # one is text, say, or the messages of a bag do not share it
        found, unread = {}, {}
        for name in names:
            try:
                found[name] = table.load([name])[name]
            except RecordingError as error:
                unread[name] = error
        return found, unread


def _numbers(name: str, x: np.ndarray | None) -> dict[str, np.ndarray] | None:
    """Columns of numbers under a name; None where it holds text or numbers of no use."""
    x = x if x is None else seconds_of(x)
    if x is None or x.dtype.kind not in "fiu" or x.ndim not in (1, 2) or not x.size:
        return None
    if x.ndim == 2 and 1 in x.shape:
        x = x.ravel()
    if x.ndim == 1:
        return {name: x.astype(float, copy=False)}
    if len(x.T) > min(MOST_COLUMNS, len(x)):
        return None
    return {f"{name}[{k}]": column.astype(float, copy=False) for k, column in enumerate(x.T)}


def _lies(x: np.ndarray | None) -> str:
    """What to say of a table whose rows are signals, behind its name."""
    if x is None or x.ndim != 2 or not x.shape[1] > x.shape[0] > 1:
        return ""
    return f" ({x.shape[0]} rows of {x.shape[1]}: one row a sample is needed)"


def same_columns(logs: Sequence[Log]) -> None:
    """Refuse files that do not hold the same columns: they cannot be of one study.

    Raises
    ------
    RecordingError
        Naming the first that differs, and a column; or why that column could not be read.
    """
    first = logs[0]
    for one in logs[1:]:
        odd = sorted(set(first.columns) ^ set(one.columns))
        if odd:
            have, lack = (first, one) if odd[0] in first.columns else (one, first)
            if odd[0] in lack.unread:
                raise lack.unread[odd[0]]
            what = f"has no column '{odd[0]}', which {have.where} has"
            raise RecordingError(what, lack.where, "draft a study of files with the same columns")
