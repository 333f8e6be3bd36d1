"""Laws that MuJoCo does not have: torques applied from step to step, and parameters that change.

Dry friction is either MuJoCo's constraint, whose level may follow state and time, or a torque of
tanh(v / w). Whatever changes its level (Stribeck's, Dahl's, load, temperature) does so to both.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from blind_study.drawn_laws import DrawnEffect, DrawnLaw
from dynident.closed_loop import TrueEffect

State = list[float]
Torque = Callable[[float, State, State], float]
"""(session's time, q, v) to a torque on the joint, N m."""
Level = Callable[[float, State, State], float]
"""(session's time, v, command) to a level of dry friction, N m."""


@dataclass(eq=False)
class Bristle:
    """A deflection z with z' = (v - |v| z / level(v)) / distance, in units of its last value.

    Attributes
    ----------
    joint : column.
    distance : rad.
    rise, speed : 1 and rad/s, of the Stribeck curve on which it settles.
    z : deflection, from -1 to 1 where nothing rises.
    """

    joint: int
    distance: float
    rise: float = 0.0
    speed: float = 1.0
    z: float = 0.0

    def advance(self, step: float, v: float) -> None:
        """Go one step of time; implicit, so that no speed is too fast for it."""
        level = 1.0 + self.rise * math.exp(-((v / self.speed) ** 2))
        pace = step / self.distance
        self.z = (self.z + pace * v) / (1.0 + pace * abs(v) / level)


@dataclass(eq=False)
class Drawn:
    """A law drawn at random, with its internal state.

    Attributes
    ----------
    law, amount : the law, and units of it.
    memory : its state.
    """

    law: DrawnLaw
    amount: float
    memory: float = 0.0

    def torque(self, step: float, q: State, v: State, u: State) -> float:
        """Go one step of time, and return what it takes from the command, N m."""
        if self.law.has_memory:
            self.memory += step * float(self.law.rate(v, self.memory))
        command = u[self.law.joint]
        return float(self.law.beside(command, q, v, self.amount, self.memory))


@dataclass(eq=False)
class Laws:
    """What acts besides MuJoCo's own laws, by joint.

    Attributes
    ----------
    torques : on a joint.
    levels : added to the dry friction of a joint.
    dampings : (joint, function of the session's time): added to the viscosity, N m s/rad.
    bristles : internal states, advanced from step to step.
    both : (joint, source, level) of dry friction that turns with the sum of two joints.
    drawn : laws drawn at random.
    """

    torques: list[tuple[int, Torque]] = field(default_factory=list)
    levels: list[tuple[int, Level]] = field(default_factory=list)
    dampings: list[tuple[int, Callable[[float], float]]] = field(default_factory=list)
    bristles: list[Bristle] = field(default_factory=list)
    both: list[tuple[int, int, float]] = field(default_factory=list)
    drawn: list[Drawn] = field(default_factory=list)

    def add(self, one: TrueEffect, j: int, i: int, number: int) -> None:
        """Take the law of an effect, if it has one here.

        Parameters
        ----------
        one : the effect.
        j, i : columns of its joint and its source; -1 for none.
        number : of the recording, from 1.
        """
        if isinstance(one.effect, DrawnEffect):
            self.drawn.append(Drawn(one.effect.drawn, one.values[0]))
        law = _LAWS.get(one.effect.name)
        if law is not None:
            law(self, one.values, one.effect.shape, j, i, number)


def _stribeck(laws, values, shape, j, i, number) -> None:
    (height,), (vs,) = values, shape
    laws.levels.append((j, lambda t, v, u: height * math.exp(-((v[j] / vs) ** 2))))


def _asymmetric(laws, values, shape, j, i, number) -> None:
    slope, constant = values
    laws.torques.append((j, lambda t, q, v: -slope * abs(v[j]) - constant))


def _drag(laws, values, shape, j, i, number) -> None:
    (c,) = values
    laws.torques.append((j, lambda t, q, v: -c * v[j] * abs(v[j])))


def _load(laws, values, shape, j, i, number) -> None:
    (mu,) = values

    def level(t: float, v: State, u: State) -> float:
        # The command is what the load takes and the friction that it makes.
        helped = math.copysign(mu, u[j]) * math.copysign(1.0, v[j])
        return mu * abs(u[j]) / (1.0 + helped)

    laws.levels.append((j, level))


def _thermal(laws, values, shape, j, i, number) -> None:
    (viscous, dry), (constant,) = values, shape
    laws.dampings.append((j, lambda t: viscous * math.exp(-t / constant)))
    laws.levels.append((j, lambda t, v, u: dry * math.exp(-t / constant)))


def _presliding(laws, values, shape, j, i, number) -> None:
    (height,), (distance,) = values, shape
    bristle = Bristle(j, distance)
    laws.bristles.append(bristle)
    laws.levels.append((j, lambda t, v, u: -height))
    laws.torques.append((j, lambda t, q, v: -height * bristle.z))


def _lugre(laws, values, shape, j, i, number) -> None:
    (height,), (distance, rise, speed) = values, shape
    bristle = Bristle(j, distance, rise, speed)
    laws.bristles.append(bristle)
    laws.torques.append((j, lambda t, q, v: -height * bristle.z))


def _offset(laws, values, shape, j, i, number) -> None:
    (offset,) = values
    laws.torques.append((j, lambda t, q, v: -offset))


def _drift(laws, values, shape, j, i, number) -> None:
    (rate,) = values
    laws.torques.append((j, lambda t, q, v: -rate * t))


def _ripple(laws, values, shape, j, i, number) -> None:
    (a, b), (k,) = values, shape
    laws.torques.append((j, lambda t, q, v: -a * math.sin(k * q[j]) - b * math.cos(k * q[j])))


def _contact(laws, values, shape, j, i, number) -> None:
    (height,), (where, time, width) = values, shape
    if number == round(where):
        laws.torques.append(
            (j, lambda t, q, v: -height * math.exp(-(((t - time) / width) ** 2) / 2))
        )


def _coupling(laws, values, shape, j, i, number) -> None:
    laws.both.append((j, i, values[3]))


def _uneven(laws, values, shape, j, i, number) -> None:
    (c,) = values
    laws.torques.append((j, lambda t, q, v: -c * v[j] * math.sin(3.0 * q[j])))


def _product(laws, values, shape, j, i, number) -> None:
    (c,) = values
    laws.torques.append((j, lambda t, q, v: -c * v[i] * v[j]))


_LAWS: dict[str, Callable] = {
    "stribeck_friction": _stribeck,
    "asymmetric_friction": _asymmetric,
    "quadratic_drag": _drag,
    "load_friction": _load,
    "thermal_friction": _thermal,
    "presliding": _presliding,
    "lugre_friction": _lugre,
    "torque_offset": _offset,
    "torque_drift": _drift,
    "torque_ripple": _ripple,
    "contact": _contact,
    "joint_coupling": _coupling,
    "position_dependent_viscosity": _uneven,
    "speed_product": _product,
}
