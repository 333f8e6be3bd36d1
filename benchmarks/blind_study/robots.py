"""Robots of two to seven joints with lengths, masses and friction drawn at random."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.closed_loop import Controller
from dynident.robot import Robot

HALF_TURN = np.pi / 2
TWO, MANY = 2, (6, 7)


@dataclass(frozen=True, eq=False)
class Specimen:
    """A robot, its loop, and the size of its friction.

    Attributes
    ----------
    robot : as it truly is.
    nominal : as its user is told: other masses.
    controller : of its joints.
    viscous, dry, rotor : (n,) Fv in N m s/rad, Fc in N m and Ia in kg m^2 of each joint.
    inertia : (n,) kg m^2, mean joint-space inertia of the bodies at each joint.
    amplitude, speed : (n,) rad and rad/s of its trajectories.
    planar : whether it moves in one vertical plane.
    """

    robot: Robot
    nominal: Robot
    controller: Controller
    viscous: np.ndarray
    dry: np.ndarray
    rotor: np.ndarray
    inertia: np.ndarray
    amplitude: np.ndarray
    speed: np.ndarray
    planar: bool


@dataclass(frozen=True)
class _Part:
    """A joint and the link that it carries: a solid ellipsoid along `reach`."""

    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]
    axis: str
    range: float
    speed: float
    mass: float
    reach: tuple[float, float, float]
    friction: tuple[float, float, float]
    """Fv, Fc, Ia"""


def specimen(joints: int, rate_hz: float, rng: np.random.Generator) -> Specimen:
    """Draw a robot of two to seven joints; of three to five, it is the shoulder of one of six."""
    planar = joints == TWO and rng.random() < 0.6
    whole = joints if joints in MANY else MANY[0]
    parts = _two(rng, planar) if joints == TWO else _many(rng, whole)[:joints]
    robot = Robot.from_text(_urdf(f"arm{joints}", parts, rng))
    friction = np.array([part.friction for part in parts])
    friction = friction * np.exp(rng.normal(0.0, 0.25, friction.shape))
    viscous, dry, rotor = friction.T
    inertia = _mean_inertia(robot, rng)
    bandwidth = 2 * np.pi * rng.uniform(3.0, 6.0)
    kp = bandwidth**2 * (inertia + rotor)
    kd = 2 * bandwidth * (inertia + rotor)
    controller = Controller(
        kind="pd",
        rate_hz=rate_hz,
        kp=tuple(float(f"{x:.3g}") for x in kp),
        kd=tuple(float(f"{x:.3g}") for x in kd),
        derivative_cutoff_hz=min(80.0, rate_hz / 5),
    )
    # Scaling a whole body leaves it one that can exist.
    factors = np.repeat(rng.uniform(0.8, 1.2, robot.n), 10)
    amplitude = np.array([0.8 * part.range for part in parts])
    speed = np.array([0.9 * part.speed for part in parts])
    nominal = robot.with_theta(robot.theta * factors)
    return Specimen(
        robot, nominal, controller, viscous, dry, rotor, inertia, amplitude, speed, planar
    )


def _two(rng: np.random.Generator, planar: bool) -> list[_Part]:
    roll, pitch, twist = HALF_TURN, 0.0, 0.0
    if not planar:
        roll += rng.uniform(-0.5, 0.5)
        pitch = rng.uniform(-0.3, 0.3)
        twist = rng.choice([-1, 1]) * rng.uniform(0.3, 1.4)
    upper, fore = 0.4 * rng.uniform(0.8, 1.25), 0.3 * rng.uniform(0.8, 1.25)
    return [
        _Part((0, 0, 0), (roll, pitch, 0), "0 0 1", 2.0, 2.8, 4.0, (upper, 0, 0), (1.2, 1.5, 0.25)),
        _Part((upper, 0, 0), (twist, 0, 0), "0 0 1", 2.2, 3.3, 2.0, (fore, 0, 0), (0.5, 0.6, 0.08)),
    ]


def _many(rng: np.random.Generator, joints: int) -> list[_Part]:
    base, upper, fore, hand = np.array([0.35, 0.42, 0.40, 0.12]) * rng.uniform(0.85, 1.2, 4)
    none = (0.0, 0.0, 0.0)
    side = 0.03 * rng.uniform(-1, 1)
    if joints == 6:
        return [
            _Part((0, 0, 0.1), none, "0 0 1", 2.8, 1.6, 8.0, (0, side, base), (6.0, 2.5, 2.2)),
            _Part((0, 0, base), none, "0 1 0", 1.9, 1.5, 9.0, (0.02, 0, upper), (6.0, 2.5, 2.2)),
            _Part((0, 0, upper), none, "0 1 0", 2.2, 1.6, 5.0, (fore / 2, side, 0), (4, 1.5, 1.2)),
            _Part(
                (fore / 2, 0, 0), none, "1 0 0", 2.8, 2.2, 2.8, (fore / 2, 0, 0.02), (2, 0.7, 0.5)
            ),
            _Part(
                (fore / 2, 0, 0), none, "0 1 0", 2.0, 2.2, 1.8, (hand, 0.01, 0), (1.2, 0.45, 0.3)
            ),
            _Part((hand, 0, 0), none, "1 0 0", 2.9, 2.4, 0.8, (0.06, 0.01, 0.02), (0.8, 0.3, 0.15)),
        ]
    return [
        _Part((0, 0, 0.16), none, "0 0 1", 2.9, 1.48, 5.1, (0, -0.03, base / 2), (7, 2.5, 2.4)),
        _Part((0, 0, base / 2), none, "0 1 0", 2.0, 1.48, 4.6, (0, 0.04, upper / 2), (7, 2.5, 2.4)),
        _Part((0, 0, upper / 2), none, "0 0 1", 2.9, 1.7, 3.4, (0, 0.03, upper / 2), (4, 1.5, 1.3)),
        _Part((0, 0, upper / 2), none, "0 -1 0", 2.0, 1.3, 3.1, (0, 0.04, fore / 2), (4, 1.5, 1.3)),
        _Part(
            (0, 0, fore / 2), none, "0 0 1", 2.9, 2.2, 2.2, (0.01, 0.02, fore / 2), (2, 0.6, 0.5)
        ),
        _Part((0, 0, fore / 2), none, "0 1 0", 2.0, 2.3, 1.9, (0.01, 0.01, hand), (1.2, 0.4, 0.3)),
        _Part((0, 0, hand), none, "0 0 1", 3.0, 2.3, 0.7, (0.015, 0.01, 0.06), (0.8, 0.25, 0.2)),
    ]


def _urdf(name: str, parts: list[_Part], rng: np.random.Generator) -> str:
    lines = [f'<robot name="{name}">', '  <link name="base"/>']
    parent = "base"
    for number, part in enumerate(parts, 1):
        mass = part.mass * np.exp(rng.normal(0.0, 0.2))
        reach = np.array(part.reach)
        centre = reach / 2 + rng.uniform(-0.02, 0.02, 3)
        axes = np.abs(reach) / 2 + rng.uniform(0.05, 0.08, 3)
        a, b, c = axes**2 * mass / 5
        lines += [
            f'  <link name="link{number}"><inertial><origin xyz="{_text(centre)}"/>'
            f'<mass value="{mass:.5g}"/>',
            f'    <inertia ixx="{b + c:.5g}" ixy="0" ixz="0" iyy="{a + c:.5g}" iyz="0" '
            f'izz="{a + b:.5g}"/></inertial></link>',
            f'  <joint name="joint{number}" type="revolute"><parent link="{parent}"/>'
            f'<child link="link{number}"/>',
            f'    <origin xyz="{_text(part.xyz)}" rpy="{_text(part.rpy)}"/>'
            f'<axis xyz="{part.axis}"/>',
            f'    <limit lower="{-part.range}" upper="{part.range}" velocity="{part.speed}" '
            'effort="500"/></joint>',
        ]
        parent = f"link{number}"
    return "\n".join([*lines, "</robot>", ""])


def _text(numbers) -> str:
    return " ".join(f"{x:.7g}" for x in numbers)


def _mean_inertia(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Diagonal of the joint-space inertia in the mean over postures, (n,)."""
    q = rng.uniform(-1.5, 1.5, (50, robot.n))
    still = np.zeros_like(q)
    at_rest = robot.inverse_dynamics(q, still, still)
    found = np.empty(robot.n)
    for j in range(robot.n):
        pushed = still.copy()
        pushed[:, j] = 1.0
        found[j] = (robot.inverse_dynamics(q, still, pushed) - at_rest)[:, j].mean()
    return found
