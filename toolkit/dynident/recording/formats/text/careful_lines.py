"""Lines of a text file read one by one, with errors that name line and column."""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.text.text_head import TextHead, is_comment, is_date, is_number

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_LETTER = re.compile(r"[^\W\d_]")
_NO_DATE = int(np.datetime64("NaT", "us").astype(np.int64))


@dataclass(frozen=True, eq=False, kw_only=True)
class CarefulLines:
    """Lines that are read one by one, with errors that name the line and the column.

    Attributes
    ----------
    data : the lines, made plain.
    head : of their file.
    names : of the columns; "" for one without.
    file : for messages.
    above : lines above the first of them.
    """

    data: bytes
    head: TextHead
    names: tuple[str, ...]
    file: str
    above: int

    def numbers(self, places: Sequence[int]) -> np.ndarray:
        """Return the numbers (T, k) of k columns."""
        found = array("d")
        for where, cells in self._rows():
            found.extend(self._number(cells[i], f"{where}, {self._column(i)}") for i in places)
        return np.frombuffer(found, dtype=np.float64).reshape(-1, len(places))

    def dates(self, place: int) -> np.ndarray:
        """Return the dates (T,) of a column."""
        found = array("q")
        for where, cells in self._rows():
            found.append(self._microseconds(cells[place], f"{where}, {self._column(place)}"))
        return np.frombuffer(found, dtype="datetime64[us]")

    def _column(self, place: int) -> str:
        return f"column {self.names[place] or place + 1}"

    def _rows(self) -> Iterator[tuple[str, list[str]]]:
        """Where each line is, and its cells, as many as there are columns."""
        body = self.data.decode().rstrip("\n ")
        if not body.strip():
            remedy = "is the file complete?"
            raise RecordingError("holds a header but no samples", self.file, remedy)
        text = io.StringIO(body, newline="")
        reader = csv.reader(text, delimiter=self.head.mark, skipinitialspace=True)
        line = self.above
        try:
            for cells in reader:
                before, line = line, reader.line_num + self.above
                if cells and is_comment(cells[0]):
                    continue
                row = self._complete(cells, f"{self.file}, line {line}")
                if line > before + 1 and self._holds_samples(cells):
                    what = f"a quotation mark opens a cell that goes on to line {line}"
                    where = f"{self.file}, line {before + 1}"
                    raise RecordingError(what, where, "close it in its line, or remove it")
                yield row
        except csv.Error as error:
            where = f"{self.file}, after line {line}"
            raise RecordingError(f"cannot be read ({error})", where) from None

    def _holds_samples(self, cells: list[str]) -> bool:
        """Whether a row of several lines has others in it; text in a column may go on over some."""
        lines = [
            one.split(self.head.mark) for cell in cells if "\n" in cell for one in cell.split("\n")
        ]
        whole = len(cells) == len(self.names)
        return not whole or any(sum(is_number(x.strip()) for x in line) > 1 for line in lines)

    def _complete(self, cells: list[str], where: str) -> tuple[str, list[str]]:
        count, wanted = len(cells), len(self.names)
        if not any(cell.strip() for cell in cells):
            raise RecordingError("the line is empty", where, "remove it")
        if count != wanted:
            names_in = "header" if self.head.names else "first line"
            what = f"{count} column{'s' * (count != 1)} where the {names_in} has {wanted}"
            remedy = "is the file complete?" if count < wanted else "name every column"
            raise RecordingError(what, where, remedy)
        return where, cells

    @staticmethod
    def _number(text: str, where: str) -> float:
        text = text.strip()
        if not text:
            raise RecordingError("the cell is empty", where, "every cell holds a number")
        if not is_number(text):
            comma = text.count(",") == 1 and is_number(text.replace(",", "."))
            remedy = "write a decimal point" if comma else "every cell holds a number"
            raise RecordingError(f"'{_short(text)}' is not a number", where, remedy)
        if not np.isfinite(value := float(text)):
            raise RecordingError(f"'{text}' is not a finite number", where, "repair or cut the gap")
        return value

    @staticmethod
    def _microseconds(text: str, where: str) -> int:
        """Time since 1970 of a date of ISO 8601; without a zone it is that of Greenwich."""
        try:
            date = datetime.fromisoformat(text.strip())
        except ValueError:
            what = f"'{_short(text)}' is not a date and a time"
            raise RecordingError(what, where, "write 2026-03-05T10:11:12.345") from None
        date = date if date.tzinfo else date.replace(tzinfo=UTC)
        return (date - _EPOCH) // timedelta(microseconds=1)


class ForgivingLines(CarefulLines):
    """Lines of which those at fault are rows of what is no number, and no date."""

    def _complete(self, cells: list[str], where: str) -> tuple[str, list[str]]:
        fits = len(cells) == len(self.names)
        stripped = tuple(cell.strip() for cell in cells)
        headings = self.head.plain_headings
        known = headings[0] if headings else ()
        names_some = fits or not set(known).isdisjoint(stripped)
        if names_some and _are_words(stripped) and stripped not in headings:
            # Columns below it may be others, in the places of the first ones.
            what = f"a line of words among the samples: {_short(', '.join(stripped))}"
            remedy = "split the file there in two if it names other columns, else remove the line"
            raise RecordingError(what, where, remedy)
        return where, cells if fits else [""] * len(self.names)

    @staticmethod
    def _number(text: str, where: str) -> float:
        try:
            return CarefulLines._number(text, where)
        except RecordingError:
            return np.nan

    @staticmethod
    def _microseconds(text: str, where: str) -> int:
        try:
            return CarefulLines._microseconds(text, where)
        except RecordingError:
            return _NO_DATE


def _are_words(cells: Sequence[str]) -> bool:
    """Whether no cell is a number or a date, and one has a letter, as a header line's have."""
    return not any(map(is_number, cells)) and (
        any(map(_LETTER.search, cells)) and not any(map(is_date, cells))
    )


def _short(text: str) -> str:
    return text if len(text) <= 30 else text[:27] + "..."
