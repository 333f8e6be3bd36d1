"""Columns that whoever recorded the files has stated, and what follows from them for the others."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from dynident.errors import RecordingError
from dynident.recording import Column
from dynident.recording.formats.column_expressions import ColumnExpression, parse
from dynident.robot import Robot
from dynident.study_draft.guesses.motor_side import MOVED, MadeColumn, expression_of

_SIGNALS = (*MOVED, "tau", "temperature")
_SINGULAR = 1e-9  # least over largest singular value


@dataclass(frozen=True, eq=False, kw_only=True)
class StatedColumns:
    """A draft's columns with those that were stated.

    Attributes
    ----------
    columns : ours -> theirs.
    followed : joints whose torque follows from the positions that were stated.
    motors : (n, n) turns of the motors, behind their gears, from those of the joints; None where
        each motor turns one.
    """

    columns: dict[str, Column]
    followed: tuple[str, ...]
    motors: np.ndarray | None


def with_stated(
    told: Mapping[str, str],
    motors: Mapping[str, Column],
    columns: Mapping[str, Column],
    robot: Robot,
    names: Collection[str],
) -> StatedColumns:
    """Put columns that were stated in place of those that were matched.

    Where a position is made of several motors', or of one whose gear was given, speeds and
    references turn with it, and torques are those that take the same power: tau = B^-T c for
    positions q = B m + b.

    Parameters
    ----------
    told : ours -> a name in the files, or a linear expression of their columns.
    motors : ours -> theirs, as they were matched.
    columns : the same with ratios of gears, where these were given.
    robot : for the joints' names.
    names : of the files' columns.

    Returns
    -------
    The columns, and what followed.

    Raises
    ------
    RecordingError
        If what is stated is no column of a joint, cannot be read, names no column of the files, or
        if the positions do not tell the motors apart.
    """
    given = {ours: _read(ours, text, robot, names) for ours, text in told.items()}
    found = {**columns, **given}
    places = {motors[f"q.{joint}"].name: k for k, joint in enumerate(robot.names)}
    size = np.array([motors[f"q.{joint}"].scale for joint in robot.names])
    turns = np.zeros((robot.n, robot.n))
    offsets = np.zeros(robot.n)
    stated = []
    for i, joint in enumerate(robot.names):
        one = expression_of(found[f"q.{joint}"])
        if not set(one.terms) <= set(places):  # a sensor of the joint itself, say: no gear's doing
            one = expression_of(columns[f"q.{joint}"])
        elif f"q.{joint}" in given:
            stated.append(i)
        for name, factor in one.terms.items():
            turns[i, places[name]] = factor / size[places[name]]
        offsets[i] = one.offset
    beside = np.any(turns - np.diag(np.diag(turns)), axis=1)
    geared = any(columns[f"q.{joint}"] != motors[f"q.{joint}"] for joint in robot.names)
    stated = [i for i in stated if geared or beside[i]]
    if not stated:
        return StatedColumns(columns=found, followed=(), motors=None)
    values = np.linalg.svd(
        turns / np.maximum(np.linalg.norm(turns, axis=0), 1e-300), compute_uv=False
    )
    if not values[-1] > _SINGULAR * values[0]:
        what = f"positions of {', '.join(told)} do not tell the motors apart"
        raise RecordingError(
            what, "column", "state one position for each motor, none of them twice"
        )
    for i in stated:
        joint = robot.names[i]
        for signal in MOVED[1:]:
            if f"{signal}.{joint}" in motors and f"{signal}.{joint}" not in given:
                offset = float(offsets[i]) if signal == "q_ref" else 0.0
                made = _sum(turns[i], signal, motors, robot, offset)
                found[f"{signal}.{joint}"] = made
    inverse = _rounded(np.linalg.inv(turns))
    followed = []
    for k, joint in enumerate(robot.names):
        made = _sum(inverse[:, k], "tau", motors, robot)
        if f"tau.{joint}" not in given and made != found[f"tau.{joint}"]:
            found[f"tau.{joint}"] = made
            followed.append(joint)
    diagonal = np.diag(inverse)
    several = inverse / diagonal[:, None] if beside.any() and diagonal.all() else None
    return StatedColumns(columns=found, followed=tuple(followed), motors=several)


def _read(ours: str, text: str, robot: Robot, names: Collection[str]) -> Column:
    """What was stated of one of our columns."""
    signal, _, joint = ours.partition(".")
    if signal not in _SIGNALS or joint not in robot.names:
        what = f"'{ours}' is no column of this robot"
        joints = ", ".join(robot.names)
        remedy = (
            f"name {', '.join(_SIGNALS[:-1])} or {_SIGNALS[-1]} and a joint: q.{robot.names[0]}"
        )
        raise RecordingError(what, "column", f"{remedy}; joints: {joints}")
    if text in names:
        return Column(text)
    one = parse(text)
    if odd := [name for name in one.terms if name not in names]:
        shown = ", ".join(list(names)[:20]) + (", ..." if len(names) > 20 else "")
        raise RecordingError(f"'{odd[0]}' is no column of the files", ours, f"they hold {shown}")
    return MadeColumn(text)


def _rounded(x: np.ndarray) -> np.ndarray:
    """An inverse without what rounding alone has left in it."""
    return np.where(np.abs(x) > 1e-12 * np.max(np.abs(x)), x, 0.0)


def _sum(
    factors: np.ndarray,
    signal: str,
    motors: Mapping[str, Column],
    robot: Robot,
    offset: float = 0.0,
) -> Column:
    """The sum of motors' columns of a signal."""
    total = ColumnExpression(offset=float(offset))
    for joint, factor in zip(robot.names, factors, strict=True):
        if factor:
            total = total + expression_of(motors[f"{signal}.{joint}"]).times(float(factor))
    return MadeColumn.of(total)
