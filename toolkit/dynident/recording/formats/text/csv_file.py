"""CSV files in: a header line, where there is one, then one line of numbers a sample.

Pandas reads a large file in which nothing is odd, NumPy a small one. Pandas forgives a missing
cell, a comment, text that is no number, and neither says in which line: so what may not be forgiven
is looked for first, and a file that they cannot read is read again by lines, for an error that
names line and column.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable, FileLayout, joined
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import TEXT, require_distinct, require_unpacked
from dynident.recording.formats.text.careful_lines import CarefulLines, ForgivingLines
from dynident.recording.formats.text.comment_lines import CommentLines, without_words
from dynident.recording.formats.text.text_head import head_of
from dynident.recording.formats.text.text_pieces import text_pieces

_HEADER = "write a header line: t, q.<joint>, tau.<joint> ..."
_SMALL = 1 << 18
"""Bytes that NumPy has read sooner than pandas is loaded, which takes a third of a second."""


def open_csv(source: FileSource, file: str, layout: FileLayout) -> ColumnTable:
    """Return the table that a CSV file holds.

    Commas, semicolons, tabs or blanks separate the columns; numbers have a decimal point, or where
    no commas separate columns a decimal comma. Columns of dates (ISO 8601) are read as such.
    Comments (`#`, `%`, `//`) are skipped, and a line of units below the names is read.

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
    head = head_of(start, file, layout)
    where = f"{file}, line {head.line}"
    if head.names:
        names = layout.by_name(head.names, where, "the first line names the columns")
    else:
        what = "the first line holds numbers, not the names of columns"
        names = layout.by_position(head.columns, where, what, _HEADER)
    require_distinct([name for name in names if name], "column", where)
    places = {name: place for place, name in reversed([*enumerate(names)])}
    comments = CommentLines()

    def read_by(
        reader: type[CarefulLines], wanted: Sequence[str]
    ) -> Iterator[dict[str, np.ndarray]]:
        comments.clear()
        numbers = [name for name in wanted if places[name] not in head.dates]
        at, above = [places[name] for name in numbers], 0
        with source.open() as stream:
            for piece in text_pieces(stream, file):
                body = piece if above else _below(piece, head.above)
                above = above or head.above
                has_comments = comments.found_in(body, above)
                # A quotation mark in a comment opens no cell.
                plain = head.plain(without_words(body) if has_comments else body)
                fast = bool(at) and not has_comments
                columns = _fast(plain, head.mark, len(names), at) if fast else None
                lines = reader(data=plain, head=head, names=names, file=file, above=above)
                if columns:
                    above += len(columns[0])
                else:
                    columns = lines.numbers(at).T if at else []
                    above += body.count(b"\n")  # some may be comments
                found = dict(zip(numbers, columns, strict=True))
                found |= {one: lines.dates(places[one]) for one in wanted if one not in found}
                yield {name: found[name] for name in wanted}

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        return read_by(CarefulLines, wanted)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        return joined(_few_enough(parts(wanted), file))

    return ColumnTable(
        file,
        names,
        load,
        parts=parts,
        forgiving=lambda wanted: read_by(ForgivingLines, wanted),
        skipped=lambda _: (*head.skipped, *comments.words),
        lines=lambda: comments.numbered(head.above + 1),
        texts=frozenset(names[place] for place in head.texts) - {""},
    )


def _below(piece: bytes, lines: int) -> bytes:
    """What is below the first lines of a piece."""
    parts = piece.split(b"\n", lines)
    return parts[lines] if len(parts) > lines else b""


def _few_enough(
    parts: Iterator[dict[str, np.ndarray]], file: str
) -> Iterator[dict[str, np.ndarray]]:
    """Parts as they come, until they are too much for the memory."""
    size = 0
    for part in parts:
        size += sum(x.nbytes for x in part.values())
        require_unpacked(size, TEXT, file)
        yield part


def _fast(body: bytes, separator: str, width: int, places: list[int]) -> list[np.ndarray] | None:
    """Columns (T,) each, or None if anything is odd: then the careful reader has to say what."""
    rows = _regular_rows(body, separator, width)
    if rows is None:
        return None
    read = _by_numpy if len(body) <= _SMALL else _by_pandas
    try:
        columns = read(body, separator, width, places)
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
        low_memory=False,
        keep_default_na=False,
        skipinitialspace=b" " in body,
        **exact,
    )
    return [frame[place].to_numpy() for place in places]


def _regular_rows(body: bytes, separator: str, width: int) -> int | None:
    """How many rows there are, if each has as many columns as the header and none is quoted."""
    if width < 2 or b'"' in body:
        return None
    mark = separator.encode()
    others = bytes(range(256)).translate(None, mark + b"\n")
    marks = body.translate(None, others).rstrip(b"\n") + b"\n"
    rows = len(marks) // width
    return rows if marks == (mark * (width - 1) + b"\n") * rows else None
