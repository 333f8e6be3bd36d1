"""The robot on which effects are tried, its motions, and samples of them as effects see them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from dynident.effects import FRICTION_WIDTH, Block, Effect, Needs
from dynident.robot import Robot

CRANE = """<robot name="crane">
  <link name="rail"/>
  <link name="trolley"><inertial><origin xyz="0.05 0 0.1"/><mass value="6"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial></link>
  <link name="cab"><inertial><origin xyz="0.1 0.03 0.2"/><mass value="4"/>
    <inertia ixx="0.06" ixy="0" ixz="0.002" iyy="0.07" iyz="0" izz="0.05"/></inertial></link>
  <link name="boom"><inertial><origin xyz="0.3 0.02 -0.05"/><mass value="3"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.05" iyz="0" izz="0.06"/></inertial></link>
  <link name="hook"><inertial><origin xyz="0 0.01 -0.2"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0.001" iyy="0.012" iyz="0" izz="0.004"/></inertial></link>
  <joint name="travel" type="prismatic"><parent link="rail"/><child link="trolley"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="500"/></joint>
  <joint name="slew" type="revolute"><parent link="trolley"/><child link="cab"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="150"/></joint>
  <joint name="swing" type="revolute"><parent link="cab"/><child link="boom"/>
    <origin xyz="0 0 0.3" rpy="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="100"/></joint>
  <joint name="hoist" type="prismatic"><parent link="boom"/><child link="hook"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.5" upper="0.5" velocity="1" effort="200"/></joint>
</robot>"""
"""A trolley, a cab that turns on it, a boom that swings below, and a hook drawn along the boom."""

SAMPLES = 25
ROTOR = np.array([0.5, 0.03, 0.02, 0.1])
"""kg or kg m^2, of each joint."""
ARRAYS = ("t", "q", "v", "a", "rigid", "torque", "temperature")
"""What a block holds sample by sample."""
_RATE, _DURATION, _PERIOD, _AMPLITUDE = 200.0, 0.6, 2.0, 0.2  # Hz, s, s, rad or m
_HARMONICS = 5


@cache
def crane() -> Robot:
    """Return the robot."""
    return Robot.from_text(CRANE)


@dataclass(frozen=True)
class World:
    """Units in which the crane and its motion are told, as parts of the usual ones.

    In the world of `time` = 2 the unit of time is half a second: times are twice as large, speeds
    half. The crane and its motion are the same ones.

    Attributes
    ----------
    time, force, length : numbers there for one s, one N and one m.
    """

    time: float = 1.0
    force: float = 1.0
    length: float = 1.0

    @property
    def inertia(self) -> np.ndarray:
        """Numbers for each unit of the ten inertial parameters, (10,)."""
        moment = self.force * self.time**2  # kg m
        return moment * np.repeat([1.0 / self.length, 1.0, self.length], [1, 3, 6])

    @property
    def positions(self) -> np.ndarray:
        """Numbers for each unit of the positions, (n,)."""
        return np.array([self.length if unit == "m" else 1.0 for unit in crane().units])

    @property
    def torques(self) -> np.ndarray:
        """Numbers for each unit of the torques, (n,)."""
        return np.array(
            [self.force * (1.0 if unit == "N" else self.length) for unit in crane().torque_units]
        )


PLAIN = World()


@cache
def crane_in(world: World) -> Robot:
    """Return the crane in the numbers of a world."""
    plain = crane()
    joints = tuple(replace(one, p=world.length * one.p) for one in plain.joints)
    links = tuple(
        replace(one, p=world.length * one.p, phi=world.inertia * one.phi) for one in plain.links
    )
    gravity = world.length / world.time**2 * plain.gravity
    return replace(plain, joints=joints, links=links, gravity=gravity)


def places(kind: type[Effect]) -> tuple[Effect, ...]:
    """Return a class's effects at every place of the crane."""
    return tuple(one.on(crane()) for one in kind.candidates(crane()))


def motion(seed: int) -> tuple[np.ndarray, ...]:
    """Return t, q, v and a of instants; speeds from far below the width of dry friction to full."""
    q, v, a = crane().random_motion(seed, SAMPLES)
    rng = np.random.default_rng(seed)
    v = v * rng.choice([1e-3, 1e-2, 0.1, 1.0], (SAMPLES, 1))
    return np.sort(np.append(0.0, rng.uniform(0, 100, SAMPLES - 1))), q, v, a


def recorded_motion(seed: int) -> tuple[np.ndarray, ...]:
    """Return t, q, v and a of a whole recording: smooth, of a few harmonics, on an even clock."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(_DURATION * _RATE) + 1) / _RATE
    k = 2 * np.pi / _PERIOD * np.arange(1, _HARMONICS + 1)
    s, c = rng.normal(size=(2, crane().n, _HARMONICS)) * _AMPLITUDE / np.arange(1, _HARMONICS + 1)
    sin, cos = np.sin(t[:, None] * k), np.cos(t[:, None] * k)
    q = sin @ s.T + cos @ c.T
    v = (cos * k) @ s.T - (sin * k) @ c.T
    a = -(sin * k**2) @ s.T - (cos * k**2) @ c.T
    return t, q, v, a


def block_of(
    effect: Effect | type[Effect],
    seed: int,
    world: World = PLAIN,
    *,
    carries_payload: bool = True,
) -> Block:
    """Return samples with everything that some effect needs of them, made anew at each call.

    Parameters
    ----------
    effect : decides whether they are a whole recording.
    seed : of the motion.
    world : in whose units the numbers are.
    carries_payload : whether the payload is on board.
    """
    robot, length = crane_in(world), world.positions
    t, q, v, a = (recorded_motion if Needs.RECORDING in effect.needs else motion)(seed)
    t, q, v, a = world.time * t, length * q, length * v / world.time, length * a / world.time**2
    return Block(
        t,
        q,
        v,
        a,
        names=robot.names,
        friction_width=FRICTION_WIDTH * length / world.time,
        carries_payload=carries_payload,
        rigid=robot.regressor(q, v, a),
        torque=robot.inverse_dynamics(q, v, a),
        body=robot,
        rotor=ROTOR * world.torques / length * world.time**2,
        number=1,
    )


def warm(block: Block) -> Block:
    """Return the same samples with recorded temperatures of the motors."""
    rng = np.random.default_rng(11)
    return replace(block, temperature=rng.uniform(20.0, 60.0, block.q.shape))


def random_values(effect: Effect, seed: int) -> np.ndarray:
    """Return values within an effect's bounds, and within 3 of its units, (k,)."""
    rng = np.random.default_rng(seed)
    parameters = effect.parameters(crane())
    lower = np.array([max(one.lower, -3.0) for one in parameters])
    upper = np.array([min(one.upper, 3.0) for one in parameters])
    return rng.uniform(lower, upper)
