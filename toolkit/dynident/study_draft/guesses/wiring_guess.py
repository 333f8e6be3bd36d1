"""Units, gears, signs and order of columns, from the description's own torques and limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Column, Recording
from dynident.robot import Robot
from dynident.study_draft.guesses.file_reading import Reading
from dynident.wiring.assignment import Assignment
from dynident.wiring.fault_words import faults_of
from dynident.wiring.hypothesis_search import search
from dynident.wiring.regressions.wiring_rows import WiringRows

_OF_GAINS = ("torque_sign", "torque_signs", "torque_unit", "torque_scale", "motor_side_torque")
"""Faults that a gain of the drive makes up for."""


@dataclass(frozen=True, kw_only=True)
class WiringGuess:
    """How columns are to be read so that they suit the robot.

    Attributes
    ----------
    findings, evidence : what is not as it was recorded, and what shows it.
    columns : ours -> theirs, with that mended.
    motors : (n, n) turns of the motors from those of the joints, with that mended; None where each
        turns one.
    left : share of the torque that a fit then leaves.
    gears : whether anything was found on the motor side of a gear.
    unknown_gears : joints whose positions are on the motor side of gears, of which the data do not
        tell the ratios: inertia and friction are as free as they are. Of a screw they never do.
    """

    findings: tuple[str, ...]
    evidence: tuple[str, ...]
    columns: dict[str, Column]
    motors: np.ndarray | None
    left: float
    gears: bool
    unknown_gears: tuple[str, ...]


def guess_wiring(reading: Reading, rows: WiringRows, recording: Recording) -> WiringGuess | None:
    """Compare recordings with the equations of motion of the robot as it is described.

    Parameters
    ----------
    reading : with the robot's limits and described inertias, and every `q` and `tau` among its
        columns. Where these are in amperes, sizes and signs of them are gains to be identified, and
        no fault.
    rows : of the recordings.
    recording : the first of them.

    Returns
    -------
    None where nothing is found.
    """
    robot, columns = reading.robot, reading.columns
    model, criteria = Model(robot), DEFAULTS.wiring
    try:
        result = search(model, rows, criteria)
    except DynidentError:
        return None
    faults = faults_of(model, result, recording)
    now = result.assignment
    if reading.torque_unit == "A":
        faults = tuple(one for one in faults if one.kind not in _OF_GAINS)
        now = replace(now, torque_scale=np.ones(robot.n))
    if not faults:
        return None
    untold = {
        robot.names[j]
        for one in (accepted.hypothesis for accepted in result.accepted)
        if one.kind.startswith("motor_side")
        for j in one.joints
        if len(one.joints) > 1
        or (robot.kinds[j] == "prismatic" and one.kind != "motor_side_torque")
    }
    return WiringGuess(
        findings=tuple(fault.what for fault in faults),
        evidence=tuple(fault.evidence for fault in faults),
        columns=_mended(robot, columns, now),
        motors=None if reading.motors is None else now.motors(reading.motors),
        left=float(np.sqrt(np.mean(result.fit.unexplained))),
        gears=any("side" in fault.kind for fault in faults),
        unknown_gears=tuple(name for name in robot.names if name in untold),
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
            found[f"{signal}.{joint}"] = replace(theirs, scale=theirs.scale * float(scale))
    return found
