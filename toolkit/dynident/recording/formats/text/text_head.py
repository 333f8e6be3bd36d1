"""What the first lines of a text file tell: comments, names, units, and how numbers are written."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Literal

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import FileLayout
from dynident.recording.formats.limits import require_few
from dynident.recording.formats.text.column_titles import are_names, are_units, with_unit

_COMMENT = re.compile(r"\s*(#|%|//)+\s*")
_SEPARATOR_OF_EXCEL = re.compile(r'\s*"?sep=.?"?\s*')
_DATE = re.compile(r"\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_WORD = re.compile(r"\w")
_BETWEEN = re.compile(r"[,;\s]+")
_SAMPLES = 100
"""Lines of samples that are looked at."""
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may stand before decimals, or at thousands."""
_Signs = Literal[",", ";", "\t", " "]


@dataclass(frozen=True, kw_only=True)
class TextHead:
    """The head of a text file.

    Attributes
    ----------
    separator : of columns, in the file.
    decimal : what stands before the decimals of numbers.
    names : of the columns, with units that are not ours behind them; () where nothing names them.
    headings : cells of the lines that tell names and units, as they stand there; those in comments
        are none.
    columns : how many there are.
    above : lines above the first sample.
    line : that names the columns, or the first one, from 1.
    dates : columns of dates.
    texts : columns without a number or a date in the first samples.
    skipped : what of the head was not read, in words each.
    """

    separator: _Signs
    decimal: Literal[".", ","]
    names: tuple[str, ...]
    headings: tuple[tuple[str, ...], ...]
    columns: int
    above: int
    line: int
    dates: frozenset[int]
    texts: frozenset[int]
    skipped: tuple[str, ...]

    @property
    def mark(self) -> str:
        """What separates the columns of lines that were made plain."""
        return "," if self.separator == " " else self.separator

    @property
    def plain_headings(self) -> tuple[tuple[str, ...], ...]:
        """Cells of the lines that tell names and units, as they are in lines made plain."""
        if self.decimal == ".":
            return self.headings
        return tuple(tuple(cell.replace(",", ".") for cell in line) for line in self.headings)

    def plain(self, lines: bytes) -> bytes:
        """Return lines of samples with one mark between columns, and decimal points."""
        if self.separator == " ":
            # Not by patterns, which are tried at every byte.
            while b"  " in lines:
                lines = lines.replace(b"  ", b" ")
            lines = lines.replace(b" \n", b"\n").replace(b"\n ", b"\n")
            lines = lines.removeprefix(b" ").removesuffix(b" ").replace(b" ", b",")
        return lines.replace(b",", b".") if self.decimal == "," else lines


def head_of(start: bytes, file: str, layout: FileLayout) -> TextHead:
    """Read the head of a text file.

    Lines of comment (`#`, `%`, `//`) come first. Where the first line below them holds numbers, the
    last of them names the columns if it has as many words, and they look like names; a sentence
    does not. Below the names there may be a line of units.

    A comma in numbers that it does not separate stands before decimals. Where every one of them may
    as well stand at thousands ("1,234"), and there is no point, that is asked.

    Parameters
    ----------
    start : first lines of it, complete ones, with line feeds between them.
    file : for messages.
    layout : names of the columns, where no line names them.

    Returns
    -------
    What they tell.

    Raises
    ------
    RecordingError
        If it has too many columns, the line that names them cannot be read, all are comments, or
        commas may be of decimals or of thousands.
    """
    lines = enumerate(_lines(io.BytesIO(start)), start=1)
    comments: list[tuple[int, str]] = []
    number = 0
    for number, first in lines:
        if first.strip() and not is_comment(first):
            break
        comments += [(number, first)] if first.strip() else []
    else:
        what = f"begins with {number} lines of comment, and no samples"
        raise RecordingError(what, file, "is it the right file?")
    every = list(islice(lines, _SAMPLES))
    rest = [one for one in every if not is_comment(one[1])]
    separator = _separator(first, rest[0][1] if rest else "")
    require_few(1 + first.count(separator), "columns", file)
    cells = _cells(first, separator, f"{file}, line {number}")
    below = [_split(line, separator) for _, line in rest]
    titles, units, samples = (), (), [cells, *below]
    headings: list[tuple[str, ...]] = []
    named, above = number, number - 1
    if not _is_sample(cells, below, separator):
        titles, samples, above = cells, below, number
        if len(below) > 1 and len(below[0]) == len(cells) and _above_numbers(below[0], below[1]):
            units, samples, above = below[0], below[1:], rest[0][0]
        headings = [tuple(one) for one in (titles, units) if one]
        comments += [one for one in every if one[0] < above and is_comment(one[1])]
    elif layout.names in ((), "numbered"):
        told = [(k, _COMMENT.sub("", line, count=1)) for k, line in comments]
        told = [(k, line) for k, line in told if _WORD.search(line)][-2:]
        if told and (last := _as_units(told[-1][1], separator, cells)):
            units, told = last, told[:-1]
        titles = _as_names(told[-1][1], separator, len(cells)) if told else ()
        named = told[-1][0] if titles else number
        units = units if titles else ()
        comments = comments[: len(comments) - bool(titles) - bool(units)]
    said = [f"{len(comments)} line{'s' * (len(comments) != 1)} of comment"] if comments else []
    plain = [[_with_point(cell, separator) for cell in line] for line in samples]
    return TextHead(
        separator=separator,
        decimal=_decimal(samples, separator, file),
        names=tuple(map(with_unit, titles, units or [""] * len(titles))),
        headings=tuple(headings),
        columns=len(cells),
        above=above,
        line=named,
        dates=frozenset(k for k, cell in enumerate(plain[0] if plain else ()) if is_date(cell)),
        texts=frozenset(
            k for k in range(len(cells)) if _is_text(line[k : k + 1] for line in plain)
        ),
        skipped=tuple(said),
    )


def is_number(text: str) -> bool:
    """Whether a cell of a file is a number."""
    # float() takes 1_000 for a number; no other program does.
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text and text.isascii()


def is_date(text: str) -> bool:
    """Whether a cell begins as a date and a time of ISO 8601 do."""
    return bool(_DATE.match(text))


def is_comment(line: str) -> bool:
    """Whether a line, or its first cell, is a comment; what Excel says of separators is one."""
    return bool(_COMMENT.match(line) or _SEPARATOR_OF_EXCEL.fullmatch(line))


def _lines(stream: io.BytesIO) -> Iterator[str]:
    return (line.decode().rstrip("\n") for line in stream)


def _separator(first: str, second: str) -> _Signs:
    """What separates columns; names may hold other signs, which no row of numbers has."""
    marks: tuple[_Signs, ...] = (",", ";", "\t")
    if " " in first.strip() and not any(mark in first for mark in (*marks, '"')):
        return " "
    bare = re.sub('"[^"]*"', "", first)
    both: list[_Signs] = [mark for mark in marks if 0 < bare.count(mark) == second.count(mark)]
    # Where numbers have decimal commas there are as many of these in both lines, perhaps.
    numbers: list[_Signs] = [mark for mark in both if _are_values(_split(second, mark), mark)]
    likely: Sequence[_Signs] = numbers or both or marks
    return max(likely, key=bare.count)


def _cells(line: str, separator: str, where: str) -> list[str]:
    """Cells of the first line, or of the one that names the columns."""
    if separator == " ":
        return line.split()
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except (csv.Error, StopIteration) as error:
        raise RecordingError(f"the header cannot be read ({error})", where) from None
    return [cell.strip() for cell in cells]


def _split(line: str, separator: str) -> list[str]:
    """Cells of another line; whoever reads it says what is wrong with it."""
    try:
        return _cells(line, separator, "")
    except RecordingError:
        return []


def _with_point(cell: str, separator: str) -> str:
    """A number with a decimal comma as one with a point, where commas separate no columns."""
    return cell.replace(",", ".") if separator in ";\t" and cell.count(",") == 1 else cell


def _are_values(cells: Sequence[str], separator: str) -> bool:
    return all(is_number(_with_point(cell, separator)) for cell in cells)


def _decimal(samples: Sequence[Sequence[str]], separator: str, file: str) -> Literal[".", ","]:
    """What stands before decimals: a comma where numbers have one, and none a point."""
    cells = [cell for line in samples for cell in line]
    commas = [x for x in cells if not is_number(x) and is_number(_with_point(x, separator))]
    if not commas or any("." in x and is_number(x) for x in cells):
        return "."
    if all(_GROUPED.fullmatch(x) for x in commas):
        what = f"'{commas[0]}' may be {commas[0].replace(',', '.')} or {commas[0].replace(',', '')}"
        raise RecordingError(what, file, "write decimal points, and no commas at thousands")
    return ","


def _kind(cell: str, separator: str) -> str:
    cell = _with_point(cell, separator)
    return "number" if is_number(cell) else "date" if is_date(cell) else f"text {cell}"


def _is_sample(cells: Sequence[str], below: Sequence[Sequence[str]], separator: str) -> bool:
    """Whether a first line holds numbers and dates alone, or text that stands below it again."""
    kinds = [_kind(cell, separator) for cell in cells]
    if all(kind in ("number", "date") for kind in kinds):
        return True
    same = bool(below) and kinds == [_kind(cell, separator) for cell in below[0]]
    return same and "number" in kinds


def _above_numbers(cells: Sequence[str], below: Sequence[str]) -> bool:
    """Whether cells are units, and a sample stands below them."""
    return are_units(cells) and any(is_number(cell.replace(",", ".")) for cell in below)


def _as_units(comment: str, separator: str, sample: Sequence[str]) -> tuple[str, ...]:
    """Units in a comment above a sample; () where it has none."""
    cells = _split(comment, separator)
    return tuple(cells) if len(cells) == len(sample) and _above_numbers(cells, sample) else ()


def _as_names(comment: str, separator: str, count: int) -> tuple[str, ...]:
    """Names of so many columns in a comment, which may separate them by commas or blanks."""
    for cells in (_split(comment, separator), _BETWEEN.split(comment.strip())):
        cut_elsewhere = any(cell.endswith((",", ";")) for cell in cells)
        if len(cells) == count > 1 and not cut_elsewhere and are_names(cells):
            return tuple(cells)
    return ()


def _is_text(cells: Iterable[Sequence[str]]) -> bool:
    """Whether none of a column's cells is a number or a date."""
    return not any(is_number(cell) or is_date(cell) for one in cells for cell in one)
