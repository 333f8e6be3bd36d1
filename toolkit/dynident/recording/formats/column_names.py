"""Names of columns: ours, those of other people's files, and the way from one to the other."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dynident.errors import RecordingError
from dynident.recording.formats.column_expressions import ColumnExpression, may_be_expression, parse
from dynident.recording.formats.column_table import ColumnTable
from dynident.words import did_you_mean

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
    name : the file's name of it; `name[2]` is the third column of a table of numbers. What is no
        name in the file is read as a linear expression of its columns, as
        `motor[5]/32 - motor[4]/45 + pi/2`; see `column_expressions.parse`.
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
class ColumnTerm:
    """A column as a table names it, the number of one in it if it is a table too, and a factor."""

    name: str
    index: int | None
    factor: float


@dataclass(frozen=True)
class LocatedColumn:
    """One of our columns, found in a table: ours = scale * (offset + sum of factor * theirs).

    Attributes
    ----------
    name : as the table names it, or the expression as it was written.
    scale : of the mapping.
    terms : columns in it.
    offset : number in the expression.
    """

    name: str
    scale: float
    terms: tuple[ColumnTerm, ...]
    offset: float = 0.0


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
) -> dict[str, LocatedColumn]:
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
        If the mapping names a column that is not ours, a column is missing, or an expression is
        none; the message names all missing ones, what is there, and a close match.
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


def locate(
    table: ColumnTable, wanted: Sequence[str], columns: Mapping[str, Column | str]
) -> dict[str, LocatedColumn]:
    """Find columns by their names, all of which have to be there.

    Parameters
    ----------
    table : what the file holds.
    wanted : ours.
    columns : ours -> theirs, for those whose names differ.

    Returns
    -------
    ours -> the column as the table names it.

    Raises
    ------
    RecordingError
        If a column is missing, or an expression is none.
    """
    return _located(table, wanted, {ours: _column(theirs) for ours, theirs in columns.items()})


def _column(theirs: Column | str) -> Column:
    return theirs if isinstance(theirs, Column) else Column(theirs)


def _located(
    table: ColumnTable, wanted: Sequence[str], mapping: Mapping[str, Column]
) -> dict[str, LocatedColumn]:
    """Ours -> the column as the table names it, or an error that names all missing ones."""
    found, missing = {}, []
    for ours in wanted:
        theirs = mapping.get(ours, Column(ours))
        one = _locate(table, theirs)
        if isinstance(one, LocatedColumn):
            found[ours] = one
        else:
            missing += [(name, "" if name == ours else f" (for {ours})") for name in one]
    if missing:
        # A column that holds another signal is no slip of the pen for this one.
        taken = {term.name for one in found.values() for term in one.terms}.union(wanted)
        free = [name for name in table.names if name not in taken]
        clock = "; a file without times takes rate_hz" if ("t", "") in missing else ""
        raise RecordingError(
            "no column " + ", ".join(f"'{name}'{role}" for name, role in dict.fromkeys(missing)),
            table.file,
            _there(table) + _close(missing[0][0], free) + clock,
        )
    return found


def _locate(table: ColumnTable, column: Column) -> LocatedColumn | list[str]:
    """Where a column is in a table: under its name, else as an expression; else what is missing.

    A name that the table holds is never read as an expression, whatever signs are in it.
    """
    name = column.name
    if _is_there(table, name):
        return LocatedColumn(name, column.scale, (_term(table, name),))
    expression: ColumnExpression | None = None
    if may_be_expression(name):
        try:
            expression = parse(name)
        except RecordingError as error:
            if _find(table, name) is None:
                what = f"no column has this name, and {error.what}"
                remedy = f"{error.remedy}; {_there(table)}{_close(name, table.names)}"
                raise RecordingError(what, table.file, remedy) from None
    if expression is not None:
        places = {theirs: _find(table, theirs) for theirs in expression.terms}
        if all(places.values()):
            terms = (_term(table, str(places[n]), x) for n, x in expression.terms.items())
            return LocatedColumn(name, column.scale, tuple(terms), expression.offset)
        if any(places.values()):
            return [theirs for theirs, place in places.items() if place is None]
    near = _find(table, name)
    return [name] if near is None else LocatedColumn(near, column.scale, (_term(table, near),))


def _checked(
    columns: Mapping[str, Column | str], joints: Sequence[str], file: str
) -> dict[str, Column]:
    signals = (*REQUIRED, *OPTIONAL, *PARTIAL)
    valid = ["t", *(f"{signal}.{joint}" for signal in signals for joint in joints)]
    known = frozenset(valid)
    for ours in columns:
        if ours not in known:
            remedy = f"columns: t, {', '.join(f'{s}.<joint>' for s in signals)}; " + (
                f"joints: {', '.join(joints)}"
            )
            what = f"the column mapping names '{ours}', which is not ours"
            raise RecordingError(what, file, remedy + _close(ours, valid))
    return {ours: _column(theirs) for ours, theirs in columns.items()}


def _find(table: ColumnTable, name: str) -> str | None:
    """Name under which a table holds a column, if it does."""
    if _is_there(table, name):
        return name
    return plain(name) if plain(name) in table.there else None


def _is_there(table: ColumnTable, name: str) -> bool:
    indexed = _INDEXED.match(name)
    return name in table.there or bool(indexed and indexed["name"] in table.there)


def _term(table: ColumnTable, name: str, factor: float = 1.0) -> ColumnTerm:
    indexed = _INDEXED.match(name)
    if name in table.there or not indexed:
        return ColumnTerm(name, None, factor)
    return ColumnTerm(indexed["name"], int(indexed["index"]), factor)


def _there(table: ColumnTable) -> str:
    if not table.names:
        return "it holds no columns at all"
    shown = ", ".join(table.names[:20])
    more = f" and {len(table.names) - 20} more" if len(table.names) > 20 else ""
    return f"it holds {shown}{more}"


def _close(name: str, names: Sequence[str]) -> str:
    hint = did_you_mean(name, names)
    return f"; {hint}" if hint else ""
