"""A file as a table of columns, before anybody asks what they are called here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.limits import AT_ONCE

SLOWEST_HZ, FASTEST_HZ = 1e-3, 1e7
"""Sampling rates of a robot: beyond them the number is in another unit."""
UNWANTED = ("", "-")
"""What stands in the place of the name of a column that is skipped."""


@dataclass(frozen=True, kw_only=True)
class FileLayout:
    """What a file of data does not say of itself.

    Attributes
    ----------
    names : of the columns of a file that does not name them, by position; "" or "-" skips one.
        "numbered" calls them column1, column2, ...; where there is a header line, it counts.
    rate_hz : sampling rate of a file without a column of time: sample k is at k/rate_hz.
    topic : which one of a bag that holds the joints on several.

    Raises
    ------
    RecordingError
        If a name is no text or there twice, or the rate is none that a robot is sampled at.
    """

    names: tuple[str, ...] | Literal["numbered"] = ()
    rate_hz: float | None = None
    topic: str = ""

    def __post_init__(self) -> None:
        if self.names != "numbered":
            if isinstance(self.names, str) or not all(isinstance(one, str) for one in self.names):
                remedy = 'write a list of names: ["t", "q.joint1", ...]'
                raise RecordingError(
                    f"names = {self.names!r} is no list of names", "columns", remedy
                )
            object.__setattr__(self, "names", tuple(one.strip() for one in self.names))
        if self.rate_hz is not None:
            rate = self.rate_hz
            known = isinstance(rate, int | float) and math.isfinite(rate)
            if not (known and SLOWEST_HZ <= rate <= FASTEST_HZ):
                remedy = f"give samples a second, from {SLOWEST_HZ:g} to {FASTEST_HZ:g}"
                raise RecordingError(f"rate_hz = {rate!r}", "rate_hz", remedy)

    def by_name(self, names: Sequence[str], where: str, said: str) -> tuple[str, ...]:
        """Names of columns that a file names.

        Parameters
        ----------
        names : those in the file.
        where, said : for the message: in what, and that it names them.

        Returns
        -------
        The names.

        Raises
        ------
        RecordingError
            If they are named by position, too.
        """
        if self.names and self.names != "numbered":
            what = f"{said}, and the study names them by position"
            remedy = "leave out one of them; [columns] says which of the file's names is ours"
            raise RecordingError(what, where, remedy)
        return tuple(names)

    def by_position(
        self, count: int, where: str, unnamed: str, remedy: str = ""
    ) -> tuple[str, ...]:
        """Names of columns that a file does not name.

        Parameters
        ----------
        count : how many columns there are.
        where, unnamed, remedy : for the message: in what, that it does not name them, and what
            else than naming them by position helps.

        Returns
        -------
        One for each column; "" for one that is skipped.

        Raises
        ------
        RecordingError
            If nothing names them, or another number of them.
        """
        if self.names == "numbered":
            return tuple(f"column{k}" for k in range(1, count + 1))
        if not self.names:
            by_position = (
                'name them by position (columns = ["t", "q.<joint>", ...] beside the file in the '
                "study)"
            )
            raise RecordingError(unnamed, where, f"{remedy}{', or ' * bool(remedy)}{by_position}")
        if len(self.names) != count:
            what = f"{len(self.names)} columns are named by position, and there are {count}"
            raise RecordingError(what, where, 'write "-" for each that is to be skipped')
        return tuple("" if name in UNWANTED else name for name in self.names)


Parts = Callable[[Sequence[str]], Iterator[dict[str, np.ndarray]]]
"""(names) -> arrays of these names, some rows at a time."""


def _no_lines() -> tuple[int, tuple[int, ...]]:
    return 0, ()


def _nothing_more(_: Sequence[str]) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class ColumnTable:
    """A file whose columns are named but not yet read.

    Attributes
    ----------
    file : for messages.
    names : what the file holds, in its order; "" for a column without a name.
    load : (names) -> arrays of these names, as they are in the file, whole.
    parts : (names) -> the same some rows at a time, each part a row or more and with as many rows
        under each name; None where the file can only be loaded.
    forgiving : parts, of a text file, with NaN where it has no number, and a row of them for a line
        that has too few columns, or too many; None in any other.
    skipped : (names) -> what else the file holds that is not read with them, in words each; what
        is skipped of the columns themselves, `left_of` says.
    sha256 : hexadecimal digits of the file's content.
    lines : () -> line of the first sample in a text file, from 1, and the lines of comment below
        it as far as it has been read; 0 for the first where there are too many, or no lines.
    texts : columns of a text file without a number or a date in the first samples.
    joints : "prefixed" where the names of joints may have a prefix that the robot's have not, or
        be without one that they have, as on topics of ROS; "exact" anywhere else.
    """

    file: str
    names: tuple[str, ...]
    load: Callable[[Sequence[str]], dict[str, np.ndarray]]
    _: KW_ONLY
    parts: Parts | None = None
    forgiving: Parts | None = None
    skipped: Callable[[Sequence[str]], tuple[str, ...]] = _nothing_more
    sha256: str = ""
    lines: Callable[[], tuple[int, tuple[int, ...]]] = _no_lines
    texts: frozenset[str] = frozenset()
    joints: Literal["exact", "prefixed"] = "exact"

    @cached_property
    def there(self) -> frozenset[str]:
        """The names, for looking them up."""
        return frozenset(self.names)

    @property
    def forgiven(self) -> ColumnTable:
        """The table with NaN where a text file is at fault."""
        return self if self.forgiving is None else replace(self, parts=self.forgiving)

    def in_parts(self, names: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        """Yield arrays of these names some rows at a time; as one part if it cannot be otherwise.

        Raises
        ------
        FileError, RecordingError
            As `load`.
        """
        if self.parts is None:
            yield self.load(names)
        else:
            yield from self.parts(names)


class RowReader(Protocol):
    """Rows of an array in a file as they come.

    Attributes
    ----------
    rows : how many there are.
    row_size : bytes of one.
    """

    @property
    def rows(self) -> int: ...

    @property
    def row_size(self) -> int: ...

    def take(self, count: int) -> np.ndarray:
        """Return the next rows, (count,) or (count, n); there are as many."""
        ...


def rows_together(readers: Mapping[str, RowReader]) -> Iterator[dict[str, np.ndarray]]:
    """Yield rows of arrays of as many rows, some at a time; never one alone at the end.

    One row of a table would look like a vector.

    Parameters
    ----------
    readers : of each array, by its name, at the beginning.
    """
    rows = next(iter(readers.values())).rows
    at_once = rows_at_once(sum(one.row_size for one in readers.values()))
    left = rows
    while left:
        count = left if left <= at_once + 1 else at_once
        yield {name: one.take(count) for name, one in readers.items()}
        left -= count


def rows_at_once(row_size: int) -> int:
    """How many rows of so many bytes are read at a time."""
    return max(16, AT_ONCE // max(1, row_size))


def is_lying(shape: Sequence[int]) -> bool:
    """Whether an array is a vector that lies in one row of a table, as MATLAB's may."""
    return len(shape) == 2 and shape[0] == 1 and shape[1] > 1


def joined(parts: Iterator[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Return whole arrays of what comes in parts, one at least."""
    whole = [*parts]
    # Pieces go as they are put together: they take as much memory as the arrays.
    return {name: np.concatenate([one.pop(name) for one in whole]) for name in [*whole[0]]}


def left_of(table: ColumnTable, used: Sequence[str]) -> tuple[str, ...]:
    """Return what a file holds besides the columns that are used, in words each."""
    names = [name for name in table.names if name not in set(used)]
    columns = ()
    if names:
        shown = ", ".join(name or "one without a name" for name in names[:10])
        more = f" and {len(names) - 10} more" if len(names) > 10 else ""
        columns = (f"{len(names)} column{'s' * (len(names) != 1)}: {shown}{more}",)
    return columns + table.skipped(used)
