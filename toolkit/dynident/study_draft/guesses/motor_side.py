"""Columns on the motor side of gears whose ratios are known."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dynident.errors import RecordingError
from dynident.recording import Column
from dynident.recording.formats.column_expressions import quoted
from dynident.robot import Robot

_TURNS = {1: "pi/2", -1: "pi/2", 2: "pi", -2: "pi"}


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
        remedy = f"give one number for each of {', '.join(robot.names)}; negative ones turn back"
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
        for signal in ("q", "v", "a", "q_ref", "tau"):
            theirs = columns.get(f"{signal}.{joint}")
            if theirs is None:
                continue
            name, sign = quoted(theirs.name), "-" if ratio < 0 else ""
            size = f"{abs(ratio):.12g}"
            text = f"{sign}{size}*{name}" if signal == "tau" else f"{sign}{name}/{size}"
            found[f"{signal}.{joint}"] = _Made(text, theirs.scale)
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
            if theirs is None or not count:
                continue
            # What was made here is an expression; any other is a name, whatever signs are in it.
            text = theirs.name if isinstance(theirs, _Made) else quoted(theirs.name)
            if theirs.scale != 1.0:
                text = f"{theirs.scale!r}*({text})"
            found[f"{signal}.{joint}"] = _Made(
                f"{text} {'+' if count > 0 else '-'} {_TURNS[count]}"
            )
    return found


class _Made(Column):
    """A column that is an expression of the file's."""
