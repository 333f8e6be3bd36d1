"""What the first lines of a text file tell: comments, names, units, and how numbers are written."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import FileLayout
from dynident.recording.formats.limits import require_few

_COMMENT = re.compile(r"\s*(#|%|//)+\s*")
_SEPARATOR_OF_EXCEL = re.compile(r'\s*"?sep=.?"?\s*')
_DATE = re.compile(r"\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_SAMPLES = 100
"""Lines of samples that are looked at."""
_OURS = re.compile(r"|-|s|sec|(rad|m)(/s(\^?2|²)?)?|n|n[*·.]?m")
"""Units that need no word, without blanks and in small letters."""
_OTHERS = re.compile(
    r"[muµn]s(ec)?|(deg|°|grad|mm)(/s(\^?2|²)?)?|rpm|1/min|mn[*·.]?m|n[*·.]?mm|m?[av]|%|°?c|degc|w|hz"
    r"|kg|counts?|inc|ticks"
)
_BRACKETED = re.compile(r"\[.*\]|\(.*\)|<.*>")
_Signs = Literal[",", ";", "\t", " "]


@dataclass(frozen=True, kw_only=True)
class TextHead:
    """The head of a text file.

    Attributes
    ----------
    separator : of columns, in the file.
    decimal : what stands before the decimals of numbers.
    names : of the columns, with units that are not ours behind them; () where nothing names them.
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

    def plain(self, lines: bytes) -> bytes:
        """Return lines of samples with one mark between columns, and decimal points."""
        if self.separator == " ":
            lines = re.sub(rb" +", b",", re.sub(rb"^ +| +$", b"", lines, flags=re.MULTILINE))
        return lines.replace(b",", b".") if self.decimal == "," else lines


def head_of(start: bytes, file: str, layout: FileLayout) -> TextHead:
    """Read the head of a text file.

    Lines of comment (`#`, `%`, `//`) come first; the last of them names the columns if the line
    below holds numbers, and as many. Below the names there may be a line of units.

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
        If it has too many columns, the line that names them cannot be read, or all are comments.
    """
    stream = io.BytesIO(start)
    comments, above = [], 0
    for first in _lines(stream):
        if first.strip() and not _is_comment(first):
            break
        comments += [first] if first.strip() else []
        above += 1
    else:
        what = f"begins with {above} lines of comment, and no samples"
        raise RecordingError(what, file, "is it the right file?")
    rest = [line for _, line in zip(range(_SAMPLES), _lines(stream), strict=False)]
    separator = _separator(first, next(iter(rest), ""))
    require_few(1 + first.count(separator), "columns", file)
    cells = _cells(first, separator, f"{file}, line {above + 1}")
    below = [_split(line, separator) for line in rest if not _is_comment(line)]
    titles, samples, units = (), [cells, *below], ()
    if not _is_sample(cells, below, separator):
        titles, samples, above = cells, below, above + 1
        if len(below) > 1 and len(below[0]) == len(cells) and _are_units(below[0], below[1]):
            units, samples, above = below[0], below[1:], above + 1
    elif comments and layout.names in ((), "numbered"):
        titles = _cells(_COMMENT.sub("", comments[-1], count=1), separator, f"{file}, line {above}")
        titles = titles if len(titles) == len(cells) > 1 else ()
        comments = comments[: -1 if titles else None]
    said = [f"{len(comments)} line{'s' * (len(comments) != 1)} of comment"] if comments else []
    plain = [[_with_point(cell, separator) for cell in line] for line in samples]
    return TextHead(
        separator=separator,
        decimal="," if _has_commas(samples, separator) else ".",
        names=tuple(map(_with_unit, titles, units or [""] * len(titles))),
        columns=len(cells),
        above=above,
        line=above - bool(units) + (not titles),
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


def is_comment(cells: Sequence[str]) -> bool:
    """Whether the cells of a line are those of a comment."""
    return bool(cells) and _is_comment(cells[0])


def _lines(stream: io.BytesIO) -> Iterator[str]:
    return (line.decode().rstrip("\n") for line in stream)


def _is_comment(line: str) -> bool:
    return bool(_COMMENT.match(line) or _SEPARATOR_OF_EXCEL.fullmatch(line))


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


def _has_commas(samples: Sequence[Sequence[str]], separator: str) -> bool:
    """Whether numbers have decimal commas, and none a point."""
    cells = [cell for line in samples for cell in line]
    commas = any(not is_number(x) and is_number(_with_point(x, separator)) for x in cells)
    return commas and not any("." in x and is_number(x) for x in cells)


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


def _are_units(cells: Sequence[str], below: Sequence[str]) -> bool:
    """Whether cells are units, and a sample stands below them."""
    known = all(_BRACKETED.fullmatch(cell) or _is_unit(_bare(cell).lower()) for cell in cells)
    return known and any(cells) and any(is_number(cell.replace(",", ".")) for cell in below)


def _is_unit(text: str) -> bool:
    return bool(_OURS.fullmatch(text) or _OTHERS.fullmatch(text))


def _bare(unit: str) -> str:
    return re.sub(r"[\[\]()<>\s]", "", unit)


def _with_unit(name: str, unit: str) -> str:
    """A name with the unit that stands below it, if that is another one than ours."""
    unit = _bare(unit)
    return name if _OURS.fullmatch(unit.lower()) else f"{name} [{unit}]"


def _is_text(cells: Iterable[Sequence[str]]) -> bool:
    """Whether none of a column's cells is a number or a date."""
    return not any(is_number(cell) or is_date(cell) for one in cells for cell in one)
