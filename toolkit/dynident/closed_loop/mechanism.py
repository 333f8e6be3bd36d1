"""A robot as it truly is: bodies, and effects with their values, acting in four ways."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynident.effects import FRICTION_WIDTH, Block, Effect, Term, effects_of
from dynident.errors import EffectError, SimulationError
from dynident.model import Model
from dynident.robot import Robot
from dynident.settings import nearest


@dataclass(frozen=True)
class TrueEffect:
    """An effect that a simulated robot really has.

    Attributes
    ----------
    effect : with its place and shape.
    values : of its parameters, in their order.
    hidden : whether the user of the recordings is to find it: it is left out of the study.
    """

    effect: Effect
    values: tuple[float, ...]
    hidden: bool = False

    @classmethod
    def of(
        cls,
        label: str,
        robot: Robot,
        values: Mapping[str, float] | Sequence[float],
        shape: Mapping[str, float] | Sequence[float] = (),
        *,
        hidden: bool = False,
    ) -> tuple[TrueEffect, ...]:
        """Return the effects of a label: `name@joint` one, `name` one per place.

        Parameters
        ----------
        label : as in a study file.
        robot : on which they sit.
        values, shape : by name (parameters left out are 0, shape parameters at their default) or
            all in order.
        hidden : see the class.

        Raises
        ------
        EffectError
            If the label, a name or a number of values does not fit, or a value is out of bounds.
        """
        return tuple(
            cls(effect, _ordered(effect, robot, values), hidden)
            for effect in (_shaped(one, robot, shape) for one in effects_of(label, robot))
        )


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A robot and its true effects, ready to compute torques.

    Attributes
    ----------
    robot : with the bodies that effects put on board.
    effects : that act.
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`.
    carries_payload : whether the payload is on board.
    """

    robot: Robot
    effects: tuple[TrueEffect, ...] = ()
    friction_width: float = FRICTION_WIDTH
    carries_payload: bool = False

    @classmethod
    def of(
        cls,
        robot: Robot,
        effects: Sequence[TrueEffect] = (),
        friction_width: float = FRICTION_WIDTH,
        *,
        carries_payload: bool = False,
    ) -> Mechanism:
        """Return the mechanism of a robot without effects and the effects that it has.

        Raises
        ------
        EffectError
            If an effect does not fit the robot, or is there twice.
        SimulationError
            If a torque gain is not positive.
        """
        acting = []
        for one in effects:
            effect = one.effect.on(robot)
            if effect.label in (other.effect.label for other in acting):
                raise EffectError("is there twice", effect.label, "name it once")
            if "payload" in effect.needs and not carries_payload:
                continue
            values = _ordered(effect, robot, one.values)
            acting.append(TrueEffect(effect, values, one.hidden))
            robot = effect.simulated_robot(values, robot)
        made = cls(robot, tuple(acting), friction_width, carries_payload)
        made._check_gain()
        return made

    @classmethod
    def of_model(
        cls,
        model: Model,
        values: np.ndarray,
        theta: np.ndarray | None = None,
        *,
        carries_payload: bool = False,
    ) -> Mechanism:
        """Return the mechanism that a model says the robot is.

        Bounds of effects are not enforced: an estimate on its way may have negative friction.

        Parameters
        ----------
        model : Model
        values : (p,) its parameters, in the order of `Model.names`.
        theta : (10 n,) the robot's standard parameters; None for those nearest to the given
            description that have the base parameters in `values`.
        carries_payload : whether the payload is on board.

        Raises
        ------
        SimulationError
            If a value is not finite, or a torque gain not positive.
        """
        values = np.asarray(values, dtype=float)
        if values.shape != (model.size,):
            what = f"values of shape {values.shape} for a model of {model.size} parameters"
            raise SimulationError(what, mend="give them in the order of Model.names")
        for name, value in zip(model.names, values, strict=True):
            if not np.isfinite(value):
                raise SimulationError(f"{name} = {value:g}", mend="give finite values")
        robot = model.robot
        if theta is None:
            rigid = values[: len(model.base.independent)]
            theta = model.base.lift(rigid, robot.theta)
        robot = robot.with_theta(theta)
        acting = []
        for effect in model.effects:
            if "payload" in effect.needs and not carries_payload:
                continue
            own = tuple(float(x) for x in values[model.slices[effect.label]])
            acting.append(TrueEffect(effect, own))
            robot = effect.simulated_robot(own, robot)
        made = cls(robot, tuple(acting), model.friction_width, carries_payload)
        made._check_gain()
        return made

    def _check_gain(self) -> None:
        for joint, gain in zip(self.robot.names, self.gain, strict=True):
            if not (gain > 0 and np.isfinite(gain)):
                what, mend = f"torque gain {gain:g}", "choose a gain error above -1"
                raise SimulationError(what, f"joint '{joint}'", mend)

    @cached_property
    def inertia(self) -> np.ndarray:
        """Joint-space inertia on top of the bodies', (n, n); not always symmetric."""
        total = np.zeros((self.robot.n, self.robot.n))
        for one in self.effects:
            total += one.effect.simulated_inertia(one.values, self.robot)
        return total

    @cached_property
    def gain(self) -> np.ndarray:
        """Recorded torque per torque that acts, (n,)."""
        total = np.ones(self.robot.n)
        for one in self.effects:
            total *= one.effect.simulated_gain(one.values, self.robot)
        return total

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """The force of all effects that a simulator evaluates natively."""
        return tuple(
            term
            for one in self.effects
            for term in one.effect.simulated_terms(one.values, self.robot) or ()
        )

    @cached_property
    def others(self) -> tuple[TrueEffect, ...]:
        """The effects whose force is more than terms."""
        return tuple(
            one
            for one in self.effects
            if one.effect.simulated_terms(one.values, self.robot) is None
        )

    def block(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> Block:
        """Return samples as effects see them; no force depends on the acceleration."""
        return Block(
            t,
            q,
            v,
            np.zeros_like(q),
            self.robot.names,
            self.friction_width,
            self.carries_payload,
        )

    def force(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return what effects take from the torque that acts, from t (T,), q and v (T, n)."""
        block = self.block(t, q, v)
        total = np.zeros(q.shape)
        for one in self.effects:
            total = total + one.effect.simulated_force(one.values, block)
        return total

    def command(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the recorded torque that a motion takes, (T, n) N m or N."""
        rigid = self.robot.inverse_dynamics(q, v, a)
        return self.gain * (rigid + a @ self.inertia.T + self.force(t, q, v))

    def acceleration(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, u: np.ndarray
    ) -> np.ndarray:
        """Return the acceleration that a recorded torque gives, (T, n); inverse of `command`."""
        still, unit = np.zeros_like(q), np.eye(self.robot.n)
        weight = self.robot.inverse_dynamics(q, still, still)
        mass = [self.robot.inverse_dynamics(q, still, still + e) - weight for e in unit]
        inertia = np.stack(mass, axis=2) + self.inertia
        load = u / self.gain - self.robot.inverse_dynamics(q, v, still) - self.force(t, q, v)
        return np.linalg.solve(inertia, load[:, :, None])[:, :, 0]


def _ordered(effect: Effect, robot: Robot, values) -> tuple[float, ...]:
    parameters = effect.parameters(robot)
    if isinstance(values, Mapping):
        names = tuple(parameter.name for parameter in parameters)
        for name in values:
            if name not in names:
                mend = nearest(name, names, "parameters")
                raise EffectError(f"no parameter '{name}'", effect.label, mend)
        values = [values.get(name, 0.0) for name in names]
    if len(values) != len(parameters):
        names = ", ".join(parameter.name for parameter in parameters)
        raise EffectError(f"{len(values)} values", effect.label, f"give {names}")
    for value, parameter in zip(values, parameters, strict=True):
        if not (np.isfinite(value) and parameter.lower <= value <= parameter.upper):
            limits = f"between {parameter.lower:g} and {parameter.upper:g} {parameter.unit}"
            mend = f"choose it {limits}"
            raise EffectError(f"{parameter.name} = {value:g}", effect.label, mend)
    return tuple(float(value) for value in values)


def _shaped(effect: Effect, robot: Robot, shape) -> Effect:
    if isinstance(shape, Mapping):
        names = tuple(one.name for one in effect.shape_parameters(robot))
        for name in shape:
            if name not in names:
                mend = nearest(name, names, "shape parameters")
                raise EffectError(f"no shape parameter '{name}'", effect.label, mend)
        shape = [shape.get(name, own) for name, own in zip(names, effect.shape, strict=True)]
    return effect.shaped(*shape).on(robot) if len(shape) else effect
