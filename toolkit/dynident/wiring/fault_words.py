"""Faults of columns in words, with the lines of the study file that mend them."""

from __future__ import annotations

import json

import numpy as np

from dynident.model import Model
from dynident.recording import Recording
from dynident.tables import percent
from dynident.wiring.assignment import DEGREE, Assignment, Hypothesis
from dynident.wiring.fault import Fault, FaultKind
from dynident.wiring.hypothesis_search import Accepted, SearchResult
from dynident.wiring.regressions.wiring_regression import TorqueFit

IN_COLUMNS = "Write in [columns] of the study, in place of lines for the same columns"
_OF_SCREWS = (
    "The ratio at {0} is none that torques tell, as another mass makes up for it: take it from the "
    "drive's data. In [columns] the scale of q.{0} is then the metres for one unit of the recorded "
    "position (of a motor's rad: the lead of the screw over 2 pi), and that of tau.{0} one over "
    "it where the torque is the motor's"
)
_MILLI = (5e-4, 2e-3)
"""Factors of a torque that are rather a unit than a gear."""


def faults_of(model: Model, result: SearchResult, recording: Recording) -> tuple[Fault, ...]:
    """Put faults into words.

    Parameters
    ----------
    model : the robot, for names and units.
    result : what the search accepted.
    recording : one of the study's, for the names of its columns.

    Returns
    -------
    Each with the lines that mend all of them: a column has one line.
    """
    assignment = result.assignment
    for one in (accepted.hypothesis for accepted in result.accepted):
        if one.kind == "torque_scale" and is_milli(one):
            for joint, factor in zip(one.joints, one.ratios, strict=True):
                assignment = assignment.torques_scaled(1e-3 / factor, joint)
        for joint in _slides(model, one):
            assignment = _as_recorded(assignment, joint)
    lines = column_lines(assignment, recording)
    found = []
    for one in result.accepted:
        kind, what = _named(model, one.hypothesis)
        joints = tuple(model.robot.names[j] for j in one.hypothesis.joints)
        slides = [model.robot.names[j] for j in _slides(model, one.hypothesis)]
        only = bool(slides) and len(slides) == len(joints)
        where = [] if only else [IN_COLUMNS]
        found.append(
            Fault(
                kind=kind,
                joints=joints,
                what=what,
                evidence=_evidence(model, one, kind),
                mend=() if only else lines,
                where=". ".join([_OF_SCREWS.format(name) for name in slides] + where),
            )
        )
    return tuple(found)


def _slides(model: Model, one: Hypothesis) -> tuple[int, ...]:
    """Prismatic joints on the motor side: of a screw's ratio a fit tells next to nothing.

    Whatever the ratio, another mass makes up for it; a line with one that fits as well as another
    would give bodies that are not there.
    """
    if one.kind not in ("motor_side", "motor_side_position"):
        return ()
    return tuple(j for j in one.joints if model.robot.kinds[j] == "prismatic")


def _as_recorded(assignment: Assignment, joint: int) -> Assignment:
    position = 1.0 / float(assignment.position_scale[joint])
    torque = 1.0 / float(assignment.torque_scale[joint])
    return assignment.positions_scaled(position, joint).torques_scaled(torque, joint)


def _named(model: Model, one: Hypothesis) -> tuple[FaultKind, str]:
    """The kind of a fault, and the fault in a few words."""
    names = [model.robot.names[j] for j in one.joints]
    torques, positions = ([f"{s}.{name}" for name in names] for s in ("tau", "q"))
    match one.kind:
        case "torque_sign":
            return one.kind, f"the sign of {torques[0]} is wrong"
        case "torque_signs":
            return one.kind, "the signs of all torques are wrong"
        case "position_sign":
            return one.kind, f"the sign of {positions[0]} is wrong"
        case "torques_exchanged":
            return one.kind, f"{torques[0]} and {torques[1]} are exchanged"
        case "positions_exchanged":
            return one.kind, f"{positions[0]} and {positions[1]} are exchanged"
        case "joints_exchanged":
            return one.kind, f"the joints {names[0]} and {names[1]} are exchanged, q and tau"
        case "degrees":
            return one.kind, f"{', '.join(positions)}: in degrees, not rad"
        case "millimetres":
            return one.kind, f"{', '.join(positions)}: in mm, not m"
        case "motor_side" | "motor_side_position":
            which = positions
            if one.kind == "motor_side":
                which = [name for pair in zip(positions, torques, strict=True) for name in pair]
            told = [
                ratio
                for joint, ratio in zip(one.joints, one.ratios, strict=True)
                if model.robot.kinds[joint] != "prismatic"
            ]
            if not told:
                side = f"{', '.join(positions)}: on the motor side of a screw, a rack or a belt"
                return one.kind, f"{side}, or in another unit than m"
            side = f"{', '.join(which)}: on the motor side of a gear"
            return one.kind, f"{side} (likely ratio {_listed(tuple(told))})"
    return _torque_scale(one, torques, model)


def is_milli(one: Hypothesis) -> bool:
    """Whether the factors of torques are those of a unit rather than of a gear."""
    return all(_MILLI[0] < factor < _MILLI[1] for factor in one.ratios)


def _torque_scale(one: Hypothesis, torques: list[str], model: Model) -> tuple[FaultKind, str]:
    """A torque on another scale: its unit, a gear, or neither."""
    units = {model.robot.torque_units[j] for j in one.joints}
    small = "N mm or mN m" if units == {"N m"} else "mN"
    if is_milli(one):
        return "torque_unit", f"{', '.join(torques)}: in {small}, not {', '.join(sorted(units))}"
    if all(factor > 1 for factor in one.ratios):
        side = f"{', '.join(torques)}: on the motor side of a gear"
        return "motor_side_torque", f"{side} (likely ratio {_listed(one.ratios)})"
    off = _listed(tuple(1 / factor for factor in one.ratios))
    return "torque_scale", f"{', '.join(torques)}: {off} times too large"


def _evidence(model: Model, one: Accepted, kind: FaultKind) -> str:
    """What shows a fault: values that cannot be, the residual, or the size beside the described."""
    joints = model.robot.names
    before, after = one.before, one.after
    if before is after:
        return "beside the torques of the robot as described, or its limits, that is their size"
    said = []
    negative = [
        joint
        for j, joint in enumerate(joints)
        if min(before.inertia_z[j], before.friction_z[j]) < 0
        and min(after.inertia_z[j], after.friction_z[j]) > 0
    ]
    lower = after.fit_score - before.fit_score > 0.1
    if lower:
        said.append(residuals(before, after))
    if negative and (kind.endswith(("sign", "signs")) or not lower):
        said.append(f"as recorded, inertia or friction at {', '.join(negative)} come out negative")
    return ", and ".join(said) or "the equations of motion fit far better with it mended"


def residuals(before: TorqueFit, after: TorqueFit) -> str:
    """What is left of the torque with a fault mended, and without."""
    left = [percent(one.misfit) for one in (before, after)]
    return f"with it mended a fit leaves {left[1]} of the torque instead of {left[0]}"


def column_lines(assignment: Assignment, recording: Recording) -> tuple[str, ...]:
    """Lines of [columns] that put an assignment into effect, one for each column that changes.

    Parameters
    ----------
    assignment : of columns to joints.
    recording : whose columns they are: it knows which of its file's columns it took.
    """
    known = {ours: (theirs, scale) for ours, theirs, scale in recording.provenance.columns}
    parts = [
        ("q", assignment.position_of, assignment.position_scale),
        ("tau", assignment.torque_of, assignment.torque_scale),
    ]
    if recording.q_ref is not None and _follows(recording, assignment):
        parts.append(("q_ref", assignment.position_of, assignment.position_scale))
    found = []
    for signal, order, scales in parts:
        for j, joint in enumerate(recording.joints):
            source = f"{signal}.{recording.joints[order[j]]}"
            theirs, scale = known.get(source, (source, 1.0))
            if order[j] != j or scales[j] != 1.0:
                found.append(_line(f"{signal}.{joint}", theirs, scale * float(scales[j])))
    return tuple(found)


def _line(ours: str, theirs: str, scale: float) -> str:
    name = json.dumps(theirs, ensure_ascii=False)
    key = json.dumps(ours, ensure_ascii=False)
    if scale == 1.0:
        return f"{key} = {name}"
    shown = repr(scale) if abs(scale) == DEGREE else f"{scale:.6g}"
    shown = shown if any(c in shown for c in ".e") else f"{shown}.0"
    return f"{key} = {{ name = {name}, scale = {shown} }}"


def _follows(recording: Recording, assignment: Assignment) -> bool:
    """Whether the reference has the same fault as the position that follows it."""
    assert recording.q_ref is not None
    change = assignment.change
    mended = recording.q @ change.T
    off = np.linalg.norm(recording.q_ref @ change.T - mended)
    return bool(off < np.linalg.norm(recording.q_ref - mended))


def _listed(ratios: tuple[float, ...]) -> str:
    return ", ".join(f"{ratio:.3g}" for ratio in ratios)
