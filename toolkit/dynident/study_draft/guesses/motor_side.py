"""Columns on the motor side of gears, and what joints make of them: ratios, zeros, shared motors.

Positions of joints are linear in those of motors, q = B m + b, with ratios on the diagonal of B and
what one motor does to another's joint beside it. Power is the same on either side, so that torques
follow: tau = B^-T c.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from dynident.errors import RecordingError
from dynident.recording import Column
from dynident.recording.formats.column_expressions import LONGEST, ColumnExpression, parse
from dynident.robot import Robot

MOVED = ("q", "v", "a", "q_ref")
"""Signals that turn as positions do."""
_ROUNDING = 1e-12


class MadeColumn(Column):
    """A column that is an expression of the file's, whatever names the file has."""

    @classmethod
    def of(cls, expression: ColumnExpression) -> MadeColumn:
        """Write an expression.

        Raises
        ------
        RecordingError
            If no study could hold it: a name has a backtick in it, or names are too long.
        """
        text = expression.text
        if odd := [name for name in expression.terms if "`" in name]:
            what = f"the column {odd[0]!r} has a backtick in its name: no expression can hold it"
            raise RecordingError(what, "columns", "rename it in the files")
        if len(text) > LONGEST:
            what = f"an expression of {text[:40]}... is longer than {LONGEST} characters"
            raise RecordingError(what, "columns", "give the columns shorter names in the files")
        return cls(text)


def expression_of(column: Column) -> ColumnExpression:
    """Return what a column is worth, its scale in it."""
    if isinstance(column, MadeColumn):
        return parse(column.name).times(column.scale)
    # Any other is a name, whatever signs are in it.
    return ColumnExpression({column.name: column.scale})


def require_ratios(gears: Sequence[float] | None, robot: Robot) -> tuple[float, ...] | None:
    """Refuse gear ratios that are none.

    Raises
    ------
    RecordingError
        If there is not one finite number other than zero for each joint.
    """
    if gears is None:
        return None
    ratios = tuple(float(ratio) for ratio in gears)
    if len(ratios) != robot.n or not all(math.isfinite(x) and x for x in ratios):
        what = f"gears {', '.join(f'{x:g}' for x in ratios)}"
        names = ", ".join(robot.names)
        remedy = f"give one number for each of {names}, none of them 0; negative ones turn back"
        raise RecordingError(what, remedy=remedy)
    return ratios


def joint_side(
    columns: dict[str, Column], robot: Robot, ratios: Sequence[float]
) -> dict[str, Column]:
    """Return columns of the joints' side: positions divided by the gears, torques multiplied.

    Parameters
    ----------
    columns : ours -> theirs, of the motors' side.
    robot : for the joints' names.
    ratios : (n) motor turns per turn of the joint.
    """
    found = dict(columns)
    for joint, ratio in zip(robot.names, ratios, strict=True):
        for signal in (*MOVED, "tau"):
            theirs = columns.get(f"{signal}.{joint}")
            if theirs is None:
                continue
            one = expression_of(theirs)
            made = one.times(ratio) if signal == "tau" else one.divided(ratio)
            found[f"{signal}.{joint}"] = MadeColumn.of(made)
    return found


def turned(columns: dict[str, Column], robot: Robot, quarters: Sequence[int]) -> dict[str, Column]:
    """Return columns with positions and references moved by quarter turns.

    Parameters
    ----------
    columns : ours -> theirs.
    robot : for the joints' names.
    quarters : (n) whole numbers.
    """
    found = dict(columns)
    for joint, count in zip(robot.names, quarters, strict=True):
        for signal in ("q", "q_ref"):
            theirs = columns.get(f"{signal}.{joint}")
            if theirs is not None and count:
                moved = expression_of(theirs) + ColumnExpression(offset=count * math.pi / 2)
                found[f"{signal}.{joint}"] = MadeColumn.of(moved)
    return found


def coupled(columns: dict[str, Column], joint: str, by: str, turns: float) -> dict[str, Column]:
    """Return columns with a joint that another one's motor turns too.

    Parameters
    ----------
    columns : ours -> theirs, of joints that each one motor turns.
    joint, by : names of the joint, and of the one whose motor turns it.
    turns : of `joint` for each turn of `by`, with its own motor at rest.
    """
    found = dict(columns)
    for signal in MOVED:
        own, other = (columns.get(f"{signal}.{name}") for name in (joint, by))
        if own is not None and other is not None:
            shared = ColumnExpression(expression_of(other).terms).times(turns)  # not its zero
            found[f"{signal}.{joint}"] = MadeColumn.of(_added(expression_of(own), shared))
    tau, other = (expression_of(columns[f"tau.{name}"]) for name in (joint, by))
    found[f"tau.{by}"] = MadeColumn.of(_added(other, tau.times(-turns)))
    return found


def _added(one: ColumnExpression, other: ColumnExpression) -> ColumnExpression:
    """The sum without what cancels but for rounding."""
    total = one + other
    terms = {
        name: factor
        for name, factor in total.terms.items()
        if abs(factor) > _ROUNDING * abs(one.terms.get(name, 0.0))
    }
    return ColumnExpression(terms, total.offset)
