"""Names of columns: ours, those of other people's files, and the way from one to the other."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynident.errors import RecordingError

REQUIRED = ("q", "tau")
OPTIONAL = ("v", "a", "q_ref")
PARTIAL = ("temperature",)
"""Optional ones that need not be there for every joint."""

_INDEXED = re.compile(r"^(?P<name>.+)\[(?P<index>\d+)\]$")


@dataclass(frozen=True)
class Column:
    """Where one of our columns is found in a file that uses other names and units.

    Attributes
    ----------
    name : the file's name of it; `name[2]` is the third column of a table of numbers.
    scale : ours = scale * theirs (pi/180 for degrees, a drive gain for volts).

    Raises
    ------
    RecordingError
        If the name is empty, or the scale zero or not finite.
    """

    name: str
    scale: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise RecordingError(f"{self.name!r} is no name of a column", "columns")
        if not (math.isfinite(self.scale) and self.scale != 0):
            remedy = "give a number other than zero"
            raise RecordingError(f"scale = {self.scale!r} of '{self.name}'", "columns", remedy)


@dataclass(frozen=True)
class ColumnTable:
    """A file whose columns are named but not yet read.

    Attributes
    ----------
    file : for messages.
    names : what the file holds, in its order.
    load : (names) -> arrays of these names, as they are in the file.
    """

    file: str
    names: tuple[str, ...]
    load: Callable[[Sequence[str]], dict[str, np.ndarray]]


def plain(name: str) -> str:
    """Return a name as a MATLAB variable: what is no letter or digit becomes `_`."""
    return re.sub(r"[^0-9A-Za-z_]", "_", name)


def joints_in(table: ColumnTable) -> tuple[str, ...]:
    """Return the joints whose positions a table holds, in its order.

    Raises
    ------
    RecordingError
        If there is no column `q.<joint>` (or variable `q_<joint>`).
    """
    found = [name[2:] for name in table.names if name.startswith("q.") and len(name) > 2]
    if not found:
        marked = (name for name in table.names if name.startswith("q_"))
        found = [name[2:] for name in marked if name[2:] and not name.startswith("q_ref")]
    if not found:
        raise RecordingError(
            "no column q.<joint>",
            table.file,
            f"{_there(table)}; name the joints or map the columns",
        )
    return tuple(found)


def resolve(
    table: ColumnTable, joints: Sequence[str], columns: Mapping[str, Column | str] | None
) -> dict[str, Column]:
    """Find each of our columns in a table.

    Parameters
    ----------
    table : what the file holds.
    joints : names, in the order asked for.
    columns : ours -> theirs, for those whose names differ.

    Returns
    -------
    ours -> the column as the table names it: `t`, `q.<joint>` and `tau.<joint>`, then whichever
    optional ones are there (for all joints; temperatures for whichever joints have them).

    Raises
    ------
    RecordingError
        If the mapping names a column that is not ours, or a column is missing; the message names
        all missing ones, what is there, and a close match.
    """
    mapping = _checked(columns or {}, joints, table.file)
    wanted = ["t", *(f"{signal}.{joint}" for signal in REQUIRED for joint in joints)]
    found = _located(table, wanted, mapping)
    for signal in OPTIONAL:
        names = [f"{signal}.{joint}" for joint in joints]
        if any(name in mapping or _find(table, name) for name in names):
            found |= _located(table, names, mapping)
    for name in (f"{signal}.{joint}" for signal in PARTIAL for joint in joints):
        if name in mapping or _find(table, name):
            found |= _located(table, [name], mapping)
    return found


def load(table: ColumnTable, columns: Mapping[str, Column]) -> dict[str, np.ndarray]:
    """Read columns as doubles in our units, (T,) each.

    Raises
    ------
    RecordingError
        If one does not hold real numbers, is not one-dimensional, or is longer than another.
    """
    parts = {ours: _split(table, column.name) for ours, column in columns.items()}
    arrays = table.load(list(dict.fromkeys(name for name, _ in parts.values())))
    found: dict[str, np.ndarray] = {}
    for ours, (name, index) in parts.items():
        x = _vector(arrays[name], name, index, table.file)
        scale = columns[ours].scale
        with np.errstate(over="ignore"):
            found[ours] = x if scale == 1.0 else scale * x
    lengths = {ours: len(x) for ours, x in found.items()}
    odd = [ours for ours, length in lengths.items() if length != lengths["t"]]
    if odd:
        raise RecordingError(
            f"{odd[0]} has {lengths[odd[0]]} samples where t has {lengths['t']}",
            table.file,
            "is the file complete?",
        )
    return found


def _located(
    table: ColumnTable, wanted: Sequence[str], mapping: Mapping[str, Column]
) -> dict[str, Column]:
    """Ours -> the column as the table names it, or an error that names all missing ones."""
    found, missing = {}, []
    for ours in wanted:
        theirs = mapping.get(ours, Column(ours))
        name = _find(table, theirs.name)
        if name is None:
            missing.append((theirs.name, "" if theirs.name == ours else f" (for {ours})"))
        else:
            found[ours] = Column(name, theirs.scale)
    if missing:
        raise RecordingError(
            "no column " + ", ".join(f"'{name}'{role}" for name, role in missing),
            table.file,
            _there(table) + _close(missing[0][0], table.names),
        )
    return found


def _checked(
    columns: Mapping[str, Column | str], joints: Sequence[str], file: str
) -> dict[str, Column]:
    signals = (*REQUIRED, *OPTIONAL, *PARTIAL)
    valid = ["t", *(f"{signal}.{joint}" for signal in signals for joint in joints)]
    for ours in columns:
        if ours not in valid:
            remedy = f"columns: t, {', '.join(f'{s}.<joint>' for s in signals)}; " + (
                f"joints: {', '.join(joints)}"
            )
            what = f"the column mapping names '{ours}', which is not ours"
            raise RecordingError(what, file, remedy + _close(ours, valid))
    return {
        ours: theirs if isinstance(theirs, Column) else Column(theirs)
        for ours, theirs in columns.items()
    }


def _find(table: ColumnTable, name: str) -> str | None:
    """Name under which a table holds a column, if it does."""
    if name in table.names:
        return name
    indexed = _INDEXED.match(name)
    if indexed and indexed["name"] in table.names:
        return name
    return plain(name) if plain(name) in table.names else None


def _split(table: ColumnTable, name: str) -> tuple[str, int | None]:
    indexed = _INDEXED.match(name)
    if name in table.names or not indexed:
        return name, None
    return indexed["name"], int(indexed["index"])


def _vector(x: np.ndarray, name: str, index: int | None, file: str) -> np.ndarray:
    if x.dtype.kind not in "fiub":
        what = f"'{name}' does not hold real numbers (it is {x.dtype})"
        raise RecordingError(what, file, "save it as an array of doubles")
    if index is not None:
        if x.ndim != 2 or index >= x.shape[1]:
            remedy = "name[i] is column i, from 0, of a table with one row a sample"
            raise RecordingError(
                f"'{name}' has the shape {x.shape}, and no column {index}", file, remedy
            )
        x = x[:, index]
    elif x.ndim == 2 and 1 in x.shape:
        x = x.ravel()
    if x.ndim != 1:
        remedy = f"map the columns, as {name}[0]" if x.ndim == 2 else "make it one-dimensional"
        raise RecordingError(f"'{name}' has the shape {x.shape}, not (T,)", file, remedy)
    with np.errstate(over="ignore"):
        return x.astype(np.float64)


def _there(table: ColumnTable) -> str:
    if not table.names:
        return "it holds no columns at all"
    shown = ", ".join(table.names[:20])
    more = f" and {len(table.names) - 20} more" if len(table.names) > 20 else ""
    return f"it holds {shown}{more}"


def _close(name: str, names: Sequence[str]) -> str:
    lower = {one.lower(): one for one in reversed(names)}
    close = difflib.get_close_matches(name.lower(), list(lower), 1, 0.6)
    return f"; did you mean '{lower[close[0]]}'?" if close else ""
