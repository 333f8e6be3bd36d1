"""Columns that whoever recorded the files has stated, and what follows from them for the others."""

from __future__ import annotations

import math
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
_ROUGH = 0.01  # relative, to which ratios are written out


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

    Speeds and references turn with a position that is made of motors'. Where it is made of several,
    or gears were given, torques are those that take the same power: tau = B^-T c for positions
    q = B m + b; degrees in it are a unit and no gear.

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
        If what is stated is no column of a joint, cannot be read, names no column of the files, has
        motors' positions beside other columns, has another ratio than was given, or if the
        positions do not tell the motors apart.
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
        if places.keys().isdisjoint(one.terms):  # a sensor of the joint itself: no gear's doing
            one = expression_of(columns[f"q.{joint}"])
        elif odd := [name for name in one.terms if name not in places]:
            what = f"'{odd[0]}' stands beside motors' positions and is none"
            remedy = f"the columns of motors' positions are {', '.join(places)}"
            raise RecordingError(what, f"q.{joint}", remedy)
        elif f"q.{joint}" in given:
            stated.append(i)
        for name, factor in one.terms.items():
            turns[i, places[name]] = factor / size[places[name]]
        offsets[i] = one.offset
    beside = np.any(turns - np.diag(np.diag(turns)), axis=1)
    geared = any(columns[f"q.{joint}"] != motors[f"q.{joint}"] for joint in robot.names)
    units = np.ones(robot.n)
    for i in stated:
        ratio = _ratio(robot.names[i], motors, columns)
        units[i] = _unit(float(turns[i, i] * ratio))
        if geared and turns[i, i]:
            _require_same(robot.names[i], float(turns[i, i] / units[i]), ratio)
    for i in stated:
        joint = robot.names[i]
        for signal in MOVED[1:]:
            theirs = motors.get(f"{signal}.{joint}")
            if theirs is not None and f"{signal}.{joint}" not in given:
                # Degrees of a position are those of its speed, but where its name says the unit.
                known = 1.0 if theirs.scale == size[i] else units[i]
                offset = float(offsets[i]) if signal == "q_ref" else 0.0
                made = _sum(turns[i] / known, signal, motors, robot, offset)
                found[f"{signal}.{joint}"] = made
    if not (geared or any(beside[i] for i in stated)):
        return StatedColumns(columns=found, followed=(), motors=None)
    turns = turns / units[:, None]
    _require_apart(turns, told)
    return _with_torques(found, given, motors, turns, robot)


def _with_torques(
    found: dict[str, Column],
    given: Collection[str],
    motors: Mapping[str, Column],
    turns: np.ndarray,
    robot: Robot,
) -> StatedColumns:
    """The columns with the torques that take the motors' power."""
    inverse = _rounded(np.linalg.inv(turns))
    beside = turns - np.diag(np.diag(turns))
    found, followed = dict(found), []
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


def terms_of(ours: str, text: str, robot: Robot, names: Collection[str]) -> tuple[str, ...]:
    """Return the columns of the files that one of ours is made of.

    Parameters
    ----------
    ours, text : one of our columns and what was stated of it.
    robot : for the joints' names.
    names : of the files' columns.

    Raises
    ------
    RecordingError
        If what is stated is no column of a joint, cannot be read, or names no column of the files.
    """
    return tuple(expression_of(_read(ours, text, robot, names)).terms)


def _ratio(joint: str, motors: Mapping[str, Column], columns: Mapping[str, Column]) -> float:
    """The ratio that was given of a joint's gear."""
    theirs = motors[f"q.{joint}"]
    return theirs.scale / expression_of(columns[f"q.{joint}"]).terms[theirs.name]


def _unit(factor: float) -> float:
    """What of a factor is a unit: degrees, or none."""
    degree = math.pi / 180
    return degree if math.isclose(abs(factor), degree, rel_tol=_ROUGH) else 1.0


def _require_same(joint: str, turn: float, ratio: float) -> None:
    if not math.isclose(turn * ratio, 1.0, rel_tol=_ROUGH):
        what = f"has 1/{1 / turn:g} of its motor, where the gears have 1/{ratio:g}"
        remedy = f"say the same in both; for degrees write pi/180/{ratio:g}"
        raise RecordingError(what, f"q.{joint}", remedy)


def _require_apart(turns: np.ndarray, told: Collection[str]) -> None:
    sizes = np.maximum(np.linalg.norm(turns, axis=0), 1e-300)
    values = np.linalg.svd(turns / sizes, compute_uv=False)
    if not values[-1] > _SINGULAR * values[0]:
        what = f"positions of {', '.join(told)} do not tell the motors apart"
        remedy = "state one position for each motor, none of them twice"
        raise RecordingError(what, "column", remedy)


def require_no_sums(columns: Mapping[str, Column], told: Collection[str]) -> None:
    """Refuse currents that were added without anybody saying so.

    Parameters
    ----------
    columns : ours -> theirs, with currents for torques.
    told : ours that were stated.

    Raises
    ------
    RecordingError
        If a torque is made of several currents: these add only with the gain of each drive.
    """
    for ours, theirs in columns.items():
        summed = ours.startswith("tau.") and len(expression_of(theirs).terms) > 1
        if summed and ours not in told:
            remedy = f"give --column {ours} (currents of two motors add only with their gains)"
            raise RecordingError("is no sum of two motors' currents", ours, remedy)


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
