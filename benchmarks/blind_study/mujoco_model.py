"""A robot as MuJoCo has it: bodies, joints, transmissions and tendons as an MJCF text.

MuJoCo's own laws are used wherever it has one: damping, armature, friction loss, springs, tendons,
soft limits. The rest is in `mujoco_laws`. Nothing of the package's dynamics is used here.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from dynident.inertia import PARAMETERS
from dynident.robot import Robot

_SPECK = 1e-7
"""kg and kg m^2 of a body that MuJoCo wants to have mass and that has none: a rotor's housing."""
_LIMIT = 0.99
"""Impedance of a soft limit: the share of it that acts like a spring."""


@dataclass(frozen=True, kw_only=True)
class Gear:
    """What stands between the motor and the link of a joint, on a joint of its own.

    Attributes
    ----------
    stiffness, damping : N m/rad and N m s/rad of the spring, or of the sides of the gap.
    gap : rad, whole width in which the link is free; 0 for none.
    resonance, ratio : rad/s and 1, of the link against the motor that moves too.
    """

    stiffness: float
    damping: float
    gap: float = 0.0
    resonance: float = 0.0
    ratio: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """A fixed tendon of length q_joint + ratio q_source: a transmission that two joints share.

    Attributes
    ----------
    joint, source : columns.
    ratio : 1.
    damping, armature, friction, stiffness : N m s/rad, kg m^2, N m, N m/rad, at the joint.
    """

    joint: int
    source: int
    ratio: float
    damping: float = 0.0
    armature: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Machine:
    """A robot with what MuJoCo has laws for; every array is (n,), in the order of its joints.

    Attributes
    ----------
    robot : its tree and the inertial parameters of its bodies.
    armature : kg m^2.
    damping, friction : N m s/rad and N m; friction is MuJoCo's own constraint.
    time_constant : s, in which that constraint stops a joint.
    stiffness, rest : N m/rad and rad of springs across the joints.
    drive : torque that acts per unit of what is commanded.
    gears, tendons : transmissions; gears by joint.
    payload : (10,) inertial parameters in the last joint's frame, or None.
    gravity : (3,) m/s^2 in the base's axes.
    """

    robot: Robot
    armature: np.ndarray
    damping: np.ndarray
    friction: np.ndarray
    time_constant: float
    stiffness: np.ndarray
    rest: np.ndarray
    drive: np.ndarray
    gravity: np.ndarray
    gears: dict[int, Gear] = field(default_factory=dict)
    tendons: tuple[Tendon, ...] = ()
    payload: np.ndarray | None = None


def mjcf(machine: Machine) -> str:
    """Return the model's text; its joints, motors and bodies are named by their columns."""
    robot = machine.robot
    roots = [j for j in range(robot.n) if robot.joints[j].parent == -1]
    solver = f"{machine.time_constant!r} 1"
    lines = [
        "<mujoco>",
        '<compiler angle="radian" autolimits="false" balanceinertia="false"/>',
        f'<option integrator="implicitfast" gravity="{_text(machine.gravity)}">',
        '<flag contact="disable"/></option>',
        f'<default><joint solreffriction="{solver}"/></default>',
        "<worldbody>",
        *(line for j in roots for line in _body(machine, j)),
        "</worldbody><tendon>",
    ]
    for number, one in enumerate(machine.tendons):
        lines += [
            f'<fixed name="tendon{number}" damping="{one.damping!r}" armature="{one.armature!r}" '
            f'stiffness="{one.stiffness!r}" springlength="0" frictionloss="{one.friction!r}" '
            f'solreffriction="{solver}">',
            f'<joint joint="joint{one.joint}" coef="1"/>',
            f'<joint joint="joint{one.source}" coef="{one.ratio!r}"/></fixed>',
        ]
    lines.append("</tendon><actuator>")
    lines += [
        f'<motor joint="joint{j}" gear="{float(machine.drive[j])!r}"/>' for j in range(robot.n)
    ]
    return "\n".join([*lines, "</actuator></mujoco>"])


def _body(machine: Machine, j: int) -> list[str]:
    """Return the lines of a moving body and of all that it carries."""
    robot, joint = machine.robot, machine.robot.joints[j]
    x, y, z, w = Rotation.from_matrix(joint.R).as_quat()
    axis = f'type="{_KIND[joint.kind]}" axis="{_text(joint.axis)}"'
    lines = [
        f'<body name="body{j}" pos="{_text(joint.p)}" quat="{_text([w, x, y, z])}">',
        f'<joint name="joint{j}" {axis} armature="{float(machine.armature[j])!r}" '
        f'damping="{float(machine.damping[j])!r}" frictionloss="{float(machine.friction[j])!r}" '
        f'stiffness="{float(machine.stiffness[j])!r}" springref="{float(machine.rest[j])!r}"/>',
    ]
    gear = machine.gears.get(j)
    if gear is not None:
        speck = f'mass="{_SPECK}" diaginertia="{_SPECK} {_SPECK} {_SPECK}"'
        lines += [
            f'<inertial pos="0 0 0" {speck}/><body name="link{j}">',
            f'<joint name="gear{j}" {axis} {_between(gear)}/>',
        ]
    lines.append(_inertial(robot.theta[10 * j : 10 * j + 10]))
    if machine.payload is not None and j == robot.tip:
        lines += ['<body name="payload">', _inertial(machine.payload), "</body>"]
    for child in range(robot.n):
        if robot.joints[child].parent == j:
            lines += _body(machine, child)
    return [*lines, "</body>" * (1 if gear is None else 2)]


_KIND = {"revolute": "hinge", "prismatic": "slide"}


def _between(gear: Gear) -> str:
    """Return the attributes of the joint between a motor and its link."""
    if not gear.gap:
        return f'stiffness="{gear.stiffness!r}" damping="{gear.damping!r}" springref="0"'
    # MuJoCo makes a soft limit of a time constant and a damping ratio: resonance = 1 / (both).
    constant = 1.0 / (gear.resonance * gear.ratio)
    half = gear.gap / 2
    return (
        f'limited="true" range="{-half!r} {half!r}" solreflimit="{constant!r} {gear.ratio!r}" '
        f'solimplimit="{_LIMIT} {_LIMIT} 1"'
    )


def _inertial(theta: np.ndarray) -> str:
    """Return the element of a body with these parameters about its frame's origin."""
    said = dict(zip(PARAMETERS, (float(x) for x in theta), strict=True))
    mass = said["m"]
    centre = np.array([said["mx"], said["my"], said["mz"]]) / mass
    about_origin = np.array(
        [
            [said["Ixx"], said["Ixy"], said["Ixz"]],
            [said["Ixy"], said["Iyy"], said["Iyz"]],
            [said["Ixz"], said["Iyz"], said["Izz"]],
        ]
    )
    i = about_origin - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    six = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    return f'<inertial pos="{_text(centre)}" mass="{mass!r}" fullinertia="{_text(six)}"/>'


def _text(numbers) -> str:
    return " ".join(repr(float(x)) for x in numbers)
