"""Where the values of hidden effects start from, and how far they may be scaled.

Torques are in units of the joint's own Coulomb friction, so that one table serves every robot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from blind_study.robots import Specimen

Draw = np.random.Generator


@dataclass(frozen=True)
class Start:
    """Values of an effect to begin with.

    Attributes
    ----------
    values : of its parameters.
    shape : of its shape parameters.
    most, least : factors between which the values may be multiplied; physics ends there.
    """

    values: tuple[float, ...]
    shape: tuple[float, ...] = ()
    most: float = np.inf
    least: float = 0.0


def _log(rng: Draw, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _sign(rng: Draw) -> float:
    return float(rng.choice([-1.0, 1.0]))


def start(name: str, made: Specimen, joint: int, source: int, rng: Draw, width: float) -> Start:
    """Draw an effect's first values at columns `joint` and `source`; the scale comes later.

    `width` is that of dry friction, rad/s.
    """
    return _STARTS[name](_At(made, joint, source, rng, width))


@dataclass(frozen=True)
class _At:
    made: Specimen
    joint: int
    source: int
    rng: Draw
    width: float

    @property
    def dry(self) -> float:
        return float(self.made.dry[self.joint])

    @property
    def viscous(self) -> float:
        return float(self.made.viscous[self.joint])

    @property
    def rotor(self) -> float:
        return float(self.made.rotor[self.joint])


def _ball(at: _At) -> Start:
    """A small ball on the last link; inertia about the origin of the last joint."""
    mass, radius = 0.05 * float(at.made.robot.theta[-10]) + 0.05, 0.03
    x, y, z = at.rng.uniform(-0.05, 0.05), at.rng.uniform(-0.05, 0.05), at.rng.uniform(0.05, 0.2)
    if at.made.robot.n == 2:
        x, z = z + 0.15, 0.0
    own = 0.4 * radius**2
    second = (y * y + z * z + own, -x * y, x * x + z * z + own, -x * z, -y * z, x * x + y * y + own)
    values = mass * np.array([1.0, x, y, z, *_ordered(second)])
    return Start(tuple(float(v) for v in values), (), 60.0)


def _ordered(second: tuple[float, ...]) -> list[float]:
    """Second moments in the order of the package's parameters."""
    from dynident.inertia import PARAMETERS

    xx, xy, yy, xz, yz, zz = second
    by_name = {"Ixx": xx, "Ixy": xy, "Iyy": yy, "Ixz": xz, "Iyz": yz, "Izz": zz}
    return [by_name[name] for name in PARAMETERS[4:]]


def _coupling(at: _At) -> Start:
    f = 0.1 * at.dry * _sign(at.rng)
    inertias = at.made.inertia + at.made.rotor
    both = float(np.sqrt(inertias[at.joint] * inertias[at.source]))
    kind = at.rng.integers(3)
    if kind == 0:
        return Start((f, 0.5 * f, 0.0, 0.0))
    if kind == 1:
        return Start((0.0, 0.0, 0.03 * both * _sign(at.rng), 0.0), (), 10.0)
    # More dry friction than there is at the joint would push it.
    return Start((0.0, 0.0, 0.0, abs(f)), (), 20.0)


def _elastic(at: _At) -> Start:
    """Compliance from the resonance of the link against the locked motor."""
    resonance = _log(at.rng, 8.0, 40.0)
    link = float(at.made.inertia[at.joint])
    compliance = 1.0 / (link * (2 * np.pi * resonance) ** 2)
    share = float(np.clip(at.rotor / (at.rotor + link), 0.02, 0.9))
    shape = (resonance, _log(at.rng, 0.02, 0.2), share)
    return Start((compliance,), shape, (resonance / 3.0) ** 2, (resonance / 120.0) ** 2)


def _gap(at: _At) -> Start:
    link = float(at.made.inertia[at.joint])
    share = float(np.clip(at.rotor / (at.rotor + link), 0.02, 0.9))
    return Start((0.002,), (_log(at.rng, 15.0, 40.0), _log(at.rng, 0.05, 0.3), share), 25.0)


def _tilt(at: _At) -> Start:
    if at.made.planar:
        # About the other axis a planar arm does not feel it.
        return Start((0.0, 0.02 * _sign(at.rng)), (), 15.0)
    angle = at.rng.uniform(0, 2 * np.pi)
    return Start((float(0.02 * np.cos(angle)), float(0.02 * np.sin(angle))), (), 15.0)


def _pulse(at: _At) -> Start:
    """Its number and time are of the first recording, that others are moved to it."""
    time = float(at.rng.uniform(1.0, 7.0))
    return Start((0.3 * at.dry * _sign(at.rng),), (1.0, time, _log(at.rng, 0.05, 0.5)))


_STARTS: dict[str, Callable[[_At], Start]] = {
    "asymmetric_friction": lambda at: Start(
        (0.1 * at.viscous * _sign(at.rng), 0.05 * at.dry * _sign(at.rng)), (), 9.0
    ),
    "backlash": _gap,
    "base_tilt": _tilt,
    "contact": _pulse,
    "coulomb_friction": lambda at: Start((0.3 * at.dry,)),
    "drive_gain": lambda at: Start((0.03 * _sign(at.rng),), (), 15.0),
    "joint_coupling": _coupling,
    "joint_elasticity": _elastic,
    "joint_spring": lambda at: Start((0.15 * at.dry, 0.1 * at.dry * at.rng.uniform(-1, 1))),
    "joint_zero": lambda at: Start((0.02 * _sign(at.rng),), (), 15.0),
    "load_friction": lambda at: Start((0.03,), (), 12.0),
    "payload": _ball,
    # No more than the whole of the dry friction builds up over a distance.
    "presliding": lambda at: Start((0.3 * at.dry,), (_log(at.rng, 2e-3, 5e-2),), 1.0 / 0.3),
    "quadratic_drag": lambda at: Start((0.1 * at.viscous,)),
    "rotor_inertia": lambda at: Start((0.3 * at.rotor,), (), 20.0),
    # Friction that falls faster than the loop can hold it would make it stick and slip.
    "stribeck_friction": lambda at: Start((0.2 * at.dry,), (_log(at.rng, 0.05, 0.3),), 8.0),
    "thermal_friction": lambda at: Start(
        (0.2 * at.viscous, 0.1 * at.dry), (_log(at.rng, 60.0, 400.0),)
    ),
    "torque_delay": lambda at: Start((0.003,), (), 10.0),
    "torque_drift": lambda at: Start((5e-4 * at.dry * _sign(at.rng),)),
    "torque_offset": lambda at: Start((0.1 * at.dry * _sign(at.rng),)),
    "torque_ripple": lambda at: Start(
        tuple(0.1 * at.dry * x for x in at.rng.uniform(-1, 1, 2)), (_log(at.rng, 4.0, 24.0),)
    ),
    "viscous_friction": lambda at: Start((0.3 * at.viscous,)),
    # Laws of no catalogue.
    "position_dependent_viscosity": lambda at: Start((0.1 * at.viscous,), (), 9.0),
    "speed_product": lambda at: Start((0.05 * at.viscous * _sign(at.rng),), (), 15.0),
    "lugre_friction": lambda at: Start(
        (at.dry,),
        (_log(at.rng, 2e-3, 3e-2), at.rng.uniform(0.2, 1.0), _log(at.rng, 0.03, 0.2)),
        8.0,
    ),
    "cubic_sensor_error": lambda at: Start((0.002 * _sign(at.rng),), (), 50.0),
    "periodic_sensor_error": lambda at: Start((0.003 * _sign(at.rng),), (), 50.0),
}

KNOWN = tuple(
    sorted(
        name
        for name in _STARTS
        if name
        not in (
            "position_dependent_viscosity",
            "speed_product",
            "lugre_friction",
            "cubic_sensor_error",
            "periodic_sensor_error",
        )
    )
)
"""Effects of the catalogue that are hidden: all that make a torque without another one."""
