"""True effects sorted into what MuJoCo has laws for, and what is applied beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from blind_study.circumstances import Circumstances
from blind_study.mujoco_laws import Laws
from blind_study.mujoco_model import Gear, Machine, Tendon
from dynident.closed_loop import TrueEffect
from dynident.effects import Transmission
from dynident.robot import Robot


@dataclass(eq=False)
class Built:
    """A robot with its effects, ready to be simulated.

    Attributes
    ----------
    machine : what MuJoCo has laws for.
    laws : what it has not.
    dry : (n,) N m of Coulomb friction, the smooth kind; zero where MuJoCo's constraint does it.
    zero : (n,) rad that the true position is ahead of the encoder's.
    delay : (n,) s by which the torque is recorded late.
    """

    machine: Machine
    laws: Laws
    dry: np.ndarray
    zero: np.ndarray
    delay: np.ndarray


def build(
    robot: Robot,
    effects: Sequence[TrueEffect],
    circumstances: Circumstances,
    number: int,
    *,
    carries_payload: bool,
) -> Built:
    """Return a robot with its true effects, in the recording of a number (from 1)."""
    n = robot.n
    column = {name: k for k, name in enumerate(robot.names)}
    by_name = _by_name(effects, column)
    zero = _each(by_name, "joint_zero", n)
    dry = _each(by_name, "coulomb_friction", n)
    tight = circumstances.friction == "constraint"
    stiffness, rest = _springs(by_name, n)
    armature = _each(by_name, "rotor_inertia", n)
    gears = {}
    for name in ("joint_elasticity", "backlash"):
        for j, _, one in by_name.get(name, ()):
            found = one.effect.simulated_transmission(one.values, robot)
            if found is not None:
                armature[j] = armature[j] or found.rotor
                resonance = 2.0 * np.pi * one.effect.shape[0]
                gears[j] = _gear(found, float(armature[j]), resonance)
    payload = None
    for _, _, one in by_name.get("payload", ()):
        payload = np.array(one.values) if carries_payload else None
    couplings = by_name.get("joint_coupling", ())
    tendons = tuple(_tendon(one.values, j, i, tight=tight) for j, i, one in couplings)
    machine = Machine(
        robot=robot,
        armature=armature,
        damping=_each(by_name, "viscous_friction", n),
        friction=dry if tight else np.zeros(n),
        time_constant=circumstances.time_constant,
        stiffness=stiffness,
        # Springs are known by where the encoder sees them.
        rest=rest + zero,
        drive=1.0 / (1.0 + _each(by_name, "drive_gain", n)),
        gears=gears,
        tendons=tendons,
        payload=payload,
        gravity=_gravity(robot, by_name),
    )
    laws = Laws()
    for effect in effects:
        j, i = (column.get(str(x), -1) for x in (effect.effect.joint, effect.effect.source))
        if not (tight and effect.effect.name == "joint_coupling"):
            laws.add(effect, j, i, number)
    delay = np.zeros(n)
    for j, _, one in by_name.get("torque_delay", ()):
        delay[slice(None) if j < 0 else j] += one.values[0]
    return Built(machine, laws, np.zeros(n) if tight else dry, zero, delay)


def bare(robot: Robot) -> Built:
    """Return the rigid bodies of a robot, without any friction or rotor."""
    none = Circumstances(
        friction="constraint",
        time_constant=1e-3,
        rate_hz=1000.0,
        repetition="none",
        jitter=0.0,
        feedforward="none",
    )
    return build(robot, (), none, 1, carries_payload=False)


_Placed = tuple[int, int, TrueEffect]


def _by_name(effects: Sequence[TrueEffect], column: dict[str, int]) -> dict[str, list[_Placed]]:
    found: dict[str, list[_Placed]] = {}
    for one in effects:
        j, i = (column.get(str(x), -1) for x in (one.effect.joint, one.effect.source))
        found.setdefault(one.effect.name, []).append((j, i, one))
    return found


def _each(by_name: dict[str, list[_Placed]], name: str, n: int) -> np.ndarray:
    """Return the first value of an effect at each joint, (n,); 0 where it is not."""
    found = np.zeros(n)
    for j, _, one in by_name.get(name, ()):
        found[j] += one.values[0]
    return found


def _springs(by_name: dict[str, list[_Placed]], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness of springs, and where they rest, (n,) each."""
    stiffness, rest = np.zeros(n), np.zeros(n)
    for j, _, one in by_name.get("joint_spring", ()):
        stiffness[j], constant = one.values
        rest[j] = -constant / stiffness[j] if stiffness[j] else 0.0
    return stiffness, rest


def _gear(said: Transmission, rotor: float, resonance: float) -> Gear:
    """Return a transmission as MuJoCo's spring, or as its soft limit.

    Parameters
    ----------
    said : what it is.
    rotor : kg m^2, inertia on the motor's side.
    resonance : rad/s, of the link against the locked motor, which says what inertia it has.
    """
    if not said.gap:
        return Gear(stiffness=said.stiffness, damping=said.damping)
    # A limit is stated by how both inertias swing against each other, 1 / A of them together:
    # stiffness = resonance^2 / A, damping = 2 ratio resonance / A.
    together = resonance**2 / said.stiffness + 1.0 / rotor
    swing = float(np.sqrt(said.stiffness * together))
    ratio = said.damping * together / (2.0 * swing)
    return Gear(
        stiffness=said.stiffness,
        damping=said.damping,
        gap=said.gap,
        resonance=swing,
        ratio=ratio,
    )


def _tendon(values: tuple[float, ...], j: int, i: int, *, tight: bool) -> Tendon:
    """Return a coupling as a tendon: what joint `i` does to `j`, `j` does to `i`.

    Damping or armature K of a tendon of ratio g puts K g of the source's speed or acceleration on
    the joint, and the same the other way; what it puts on each joint itself is friction and rotor.
    """
    viscous, _, inertia, both = values
    ratio = -1.0 if viscous + inertia < 0 else 1.0
    return Tendon(
        joint=j,
        source=i,
        ratio=ratio,
        damping=abs(viscous),
        armature=abs(inertia),
        friction=both if tight else 0.0,
    )


def _gravity(robot: Robot, by_name: dict[str, list[_Placed]]) -> np.ndarray:
    """Return gravity in the axes of a base that is tilted."""
    gravity = np.array(robot.gravity)
    for _, _, one in by_name.get("base_tilt", ()):
        turn = Rotation.from_rotvec([one.values[0], one.values[1], 0.0])
        gravity = turn.inv().apply(gravity)
    return gravity
