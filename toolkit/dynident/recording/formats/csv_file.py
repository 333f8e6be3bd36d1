"""CSV files in: a header line, where there is one, then one line of numbers a sample.

Pandas reads a large file in which nothing is odd, NumPy a small one. Pandas forgives a missing
cell, a comment, text that is no number, and neither says in which line: so what may not be forgiven
is looked for first, and a file that they cannot read is read again by lines, for an error that
names line and column.
"""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable, FileLayout, joined
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    TEXT,
    require_distinct,
    require_few,
    require_unpacked,
)
from dynident.recording.formats.text_pieces import text_pieces

_NUMPY_HEADER = b"# "
"""How NumPy marks the line of a header."""
_HEADER = "write a header line: t, q.<joint>, tau.<joint> ..."
_SMALL = 1 << 18
"""Bytes that NumPy has read sooner than pandas is loaded, which takes a third of a second."""


def open_csv(source: FileSource, file: str, layout: FileLayout) -> ColumnTable:
    """Return the table that a CSV file holds.

    Commas, semicolons, tabs or blanks separate the columns; numbers have a decimal point.

    Parameters
    ----------
    source : the file.
    file : for messages.
    layout : names of the columns, where no header line names them.

    Raises
    ------
    FileError
        If the bytes are not UTF-8 text; of those after the first pieces, `ColumnTable.parts` and
        `ColumnTable.load` raise it.
    RecordingError
        If neither a header nor the layout names the columns, or both do, a name is there twice,
        or there are too many. `ColumnTable.parts` raises it for a line with too few or too many
        columns, and for a cell that is not a finite number; `ColumnTable.load` also if there are
        too many of them.
    """
    with source.open() as stream:
        start = next(text_pieces(stream, file), b"")
    if not start or start.isspace():
        raise RecordingError("is empty", file, "the first line names the columns: t, q.<joint> ...")
    blanks = _has_blanks(start)
    start = _commas(start.removeprefix(_NUMPY_HEADER)) if blanks else start
    first, second = (line.decode() for line in _two_lines(start))
    separator = _separator(first, second)
    require_few(1 + first.count(separator), "columns", file)
    cells = _cells(first, separator, file)
    is_header = not all(is_number(cell) for cell in cells)
    where = f"{file}, line 1"
    if is_header:
        names = layout.by_name(cells, where, "the first line names the columns")
    else:
        what = "the first line holds numbers, not the names of columns"
        names = layout.by_position(len(cells), where, what, _HEADER)
    require_distinct([name for name in names if name], "column", f"{file}, line 1")
    places = {name: place for place, name in reversed([*enumerate(names)])}

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        at, above = [places[name] for name in wanted], 0
        with source.open() as stream:
            for piece in text_pieces(stream, file):
                if blanks:
                    piece = _commas(piece if above else piece.removeprefix(_NUMPY_HEADER))
                # The readers below skip the line of the header.
                lines = piece if is_header and not above else b"\n" + piece
                above = above or int(is_header)
                columns = _fast(lines, separator, len(names), at)
                if columns is None:
                    kind = "header" if is_header else "first line"
                    rows = _careful(
                        lines, separator, names, at, file, lines_above=above, names_in=kind
                    )
                    columns = list(rows.T)
                yield dict(zip(wanted, columns, strict=True))
                above += lines.count(b"\n") - 1

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        return joined(_few_enough(parts(wanted), file))

    return ColumnTable(file, names, load, parts=parts, first_line=2 if is_header else 1)


def _few_enough(
    parts: Iterator[dict[str, np.ndarray]], file: str
) -> Iterator[dict[str, np.ndarray]]:
    """Parts as they come, until they are too much for the memory."""
    size = 0
    for part in parts:
        size += sum(x.nbytes for x in part.values())
        require_unpacked(size, TEXT, file)
        yield part


def _has_blanks(data: bytes) -> bool:
    """Whether nothing but blanks separates the columns."""
    first = data.partition(b"\n")[0].strip()
    return b" " in first and not any(mark in first for mark in (b",", b";", b"\t", b'"'))


def _commas(data: bytes) -> bytes:
    """Lines with commas in the place of blanks."""
    return re.sub(rb" +", b",", re.sub(rb"^ +| +$", b"", data, flags=re.MULTILINE))


def _two_lines(data: bytes) -> tuple[bytes, bytes]:
    """Return the header and the line below it."""
    stream = io.BytesIO(data)
    return stream.readline().rstrip(b"\n"), stream.readline().rstrip(b"\n")


def _separator(header: str, row: str) -> str:
    """What separates the columns; names may hold other separators, which no row of numbers has."""
    bare = re.sub('"[^"]*"', "", header)
    both = [mark for mark in ",;\t" if 0 < bare.count(mark) == row.count(mark)]
    return max(both or ",;\t", key=bare.count)


def _cells(line: str, separator: str, file: str) -> list[str]:
    """Cells of the first line."""
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except (csv.Error, StopIteration) as error:
        raise RecordingError(f"the header cannot be read ({error})", f"{file}, line 1") from None
    return [cell.strip() for cell in cells]


def _fast(data: bytes, separator: str, width: int, places: list[int]) -> list[np.ndarray] | None:
    """Columns (T,) each, or None if anything is odd: then the careful reader has to say what."""
    rows = _regular_rows(data, separator, width)
    if rows is None:
        return None
    read = _by_numpy if len(data) <= _SMALL else _by_pandas
    try:
        columns = read(data.partition(b"\n")[2], separator, width, places)
    except (ValueError, OverflowError):  # of text that is no number; a ParserError is one, too
        return None
    return columns if all(len(x) == rows and np.isfinite(x).all() for x in columns) else None


def _by_numpy(body: bytes, separator: str, width: int, places: list[int]) -> list[np.ndarray]:
    body = body.rstrip(b"\n ")
    if not body:
        raise ValueError("no rows")
    columns = np.loadtxt(
        io.BytesIO(body), delimiter=separator, comments=None, usecols=places, ndmin=2
    )
    return list(columns.T)


def _by_pandas(body: bytes, separator: str, width: int, places: list[int]) -> list[np.ndarray]:
    import pandas as pd

    # Since 3.1 pandas rounds every number as Python does, and warns who asks for it.
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    frame = pd.read_csv(
        io.BytesIO(body),
        sep=separator,
        header=None,
        names=list(range(width)),
        usecols=sorted(set(places)),
        index_col=False,
        dtype=np.float64,
        engine="c",
        keep_default_na=False,
        skipinitialspace=b" " in body,
        **exact,
    )
    return [frame[place].to_numpy() for place in places]


def _regular_rows(data: bytes, separator: str, width: int) -> int | None:
    """How many rows there are, if each has as many columns as the header and none is quoted."""
    if width < 2 or data.find(b'"', data.find(b"\n")) >= 0:
        return None
    mark = separator.encode()
    others = bytes(range(256)).translate(None, mark + b"\n")
    marks = data.translate(None, others).partition(b"\n")[2].rstrip(b"\n") + b"\n"
    rows = len(marks) // width
    return rows if marks == (mark * (width - 1) + b"\n") * rows else None


def _careful(
    data: bytes,
    separator: str,
    names: tuple[str, ...],
    places: list[int],
    file: str,
    *,
    lines_above: int = 1,
    names_in: str = "header",
) -> np.ndarray:
    """Values (T, k), line by line, with an error that names the line and the column."""
    body = data.decode().partition("\n")[2].rstrip("\n ")
    if not body.strip():
        remedy = "is the file complete?"
        raise RecordingError("holds a header but no samples", file, remedy)
    numbers = array("d")
    reader = csv.reader(io.StringIO(body, newline=""), delimiter=separator, skipinitialspace=True)
    line = lines_above
    try:
        for cells in reader:
            line = reader.line_num + lines_above
            where = f"{file}, line {line}"
            if not any(cell.strip() for cell in cells):
                raise RecordingError("the line is empty", where, "remove it")
            if len(cells) != len(names):
                raise RecordingError(
                    f"{len(cells)} column{'s' * (len(cells) != 1)} where the "
                    f"{names_in} has {len(names)}",
                    where,
                    "is the file complete?" if len(cells) < len(names) else "name every column",
                )
            numbers.extend(_cell(cells[i], f"{where}, column {names[i] or i + 1}") for i in places)
    except csv.Error as error:
        raise RecordingError(f"cannot be read ({error})", f"{file}, after line {line}") from None
    return np.frombuffer(numbers, dtype=np.float64).reshape(-1, len(places))


def _cell(text: str, where: str) -> float:
    text = text.strip()
    if not text:
        raise RecordingError("the cell is empty", where, "every cell holds a number")
    if not is_number(text):
        comma = text.count(",") == 1 and is_number(text.replace(",", "."))
        shown = text if len(text) <= 30 else text[:27] + "..."
        remedy = "write a decimal point" if comma else "every cell holds a number"
        raise RecordingError(f"'{shown}' is not a number", where, remedy)
    if not np.isfinite(value := float(text)):
        raise RecordingError(f"'{text}' is not a finite number", where, "repair or cut the gap")
    return value


def is_number(text: str) -> bool:
    """Whether a cell of a file is a number."""
    # float() takes 1_000 for a number; no other program does.
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text and text.isascii()
