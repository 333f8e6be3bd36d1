"""Units, gears, signs and order of columns, from the description's own torques and limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Column, Dataset, Recording
from dynident.robot import Robot
from dynident.wiring.assignment import Assignment
from dynident.wiring.fault_words import faults_of
from dynident.wiring.hypothesis_search import search
from dynident.wiring.wiring_rows import rows_of

_OF_GAINS = ("torque_sign", "torque_signs", "torque_unit", "torque_scale", "motor_side_torque")
"""Faults that a gain of the drive makes up for."""


@dataclass(frozen=True, kw_only=True)
class WiringGuess:
    """How columns are to be read so that they suit the robot.

    Attributes
    ----------
    findings : (what, evidence) of each thing that is not as it was recorded.
    columns : ours -> theirs, with that mended.
    gears : whether anything was found on the motor side of a gear.
    unknown_gears : joints whose positions are on the motor side of gears, of which the data do not
        tell the ratios: inertia and friction are as free as they are.
    note : why nothing could be told, else empty.
    """

    findings: tuple[tuple[str, str], ...]
    columns: dict[str, Column]
    gears: bool = False
    unknown_gears: tuple[str, ...] = ()
    note: str = ""


def guess_wiring(
    robot: Robot,
    recordings: tuple[Recording, ...],
    columns: dict[str, Column],
    torque_unit: Literal["N m", "A"] = "N m",
) -> WiringGuess:
    """Compare recordings with the equations of motion of the robot as it is described.

    Parameters
    ----------
    robot : with its limits and described inertias.
    recordings : read with `columns`.
    columns : ours -> theirs, every `q` and `tau` among them.
    torque_unit : "A" where they are currents: sizes and signs of them are gains to be identified,
        and no fault.

    Returns
    -------
    The columns as they are, or with units, gears, signs and order mended.
    """
    model, criteria = Model(robot), DEFAULTS.wiring
    try:
        rows = rows_of(Dataset(recordings), criteria.rows, criteria.independent_hz)
        result = search(model, rows, criteria)
    except DynidentError as error:
        return WiringGuess(findings=(), columns=columns, note=error.what)
    if not result.accepted:
        return WiringGuess(findings=(), columns=columns)
    ignored = _OF_GAINS if torque_unit == "A" else ()
    several = {
        robot.names[j]
        for one in (accepted.hypothesis for accepted in result.accepted)
        if one.kind.startswith("motor_side") and one.kind not in ignored and len(one.joints) > 1
        for j in one.joints
    }
    faults = [
        fault for fault in faults_of(model, result, recordings[0]) if fault.kind not in ignored
    ]
    mended = _mended(robot, columns, result.assignment)
    if torque_unit == "A":
        plain = {column.name: column for ours, column in columns.items() if ours[:4] == "tau."}
        mended |= {ours: plain[one.name] for ours, one in mended.items() if ours[:4] == "tau."}
    return WiringGuess(
        findings=tuple((fault.what, fault.evidence) for fault in faults),
        columns=mended,
        unknown_gears=tuple(name for name in robot.names if name in several),
        gears=any("side" in fault.kind for fault in faults),
    )


def _mended(robot: Robot, columns: dict[str, Column], now: Assignment) -> dict[str, Column]:
    """The columns with an assignment put into effect; references and speeds as their positions."""
    found = dict(columns)
    for signal, order, scales in (
        ("q", now.position_of, now.position_scale),
        ("v", now.position_of, now.position_scale),
        ("q_ref", now.position_of, now.position_scale),
        ("tau", now.torque_of, now.torque_scale),
    ):
        if f"{signal}.{robot.names[0]}" not in columns:
            continue
        for joint, source, scale in zip(robot.names, order, scales, strict=True):
            theirs = columns[f"{signal}.{robot.names[source]}"]
            found[f"{signal}.{joint}"] = Column(theirs.name, theirs.scale * float(scale))
    return found
