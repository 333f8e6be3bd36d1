"""The effects that a simulated robot truly has: one by one, and what they do together.

In: effects with their true values, on a robot. Out: inertia, gain, delay, loss, springs and forces
that all of them add, as a simulator asks for them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dynident.effects import FRICTION_WIDTH, Block, Effect, Law, Term, Transmission, effects_of
from dynident.errors import EffectError, SimulationError
from dynident.robot import Robot
from dynident.words import nearest


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
        laws: Sequence[Law] = (),
    ) -> tuple[TrueEffect, ...]:
        """Return the effects of a label: `name@joint` one, `name` one per place.

        Parameters
        ----------
        label : as in a study file.
        robot : on which they sit.
        values, shape : by name (parameters left out are 0, shape parameters at their default) or
            all in order.
        hidden : see the class.
        laws : that labels may name besides the catalogue.

        Raises
        ------
        EffectError
            If the label, a name or a number of values does not fit, or a value is out of bounds.
        """
        return tuple(
            cls(effect, ordered(effect, robot, values), hidden)
            for effect in (_shaped(one, robot, shape) for one in effects_of(label, robot, laws))
        )


def ordered(
    effect: Effect, robot: Robot, values: Mapping[str, float] | Sequence[float]
) -> tuple[float, ...]:
    """Return values in the order of an effect's parameters.

    Parameters
    ----------
    effect : on the robot.
    robot : whose places decide what parameters there are.
    values : by name (those left out are 0), or all in order.

    Raises
    ------
    EffectError
        If a name or the number does not fit, or a value is out of bounds.
    """
    parameters = effect.parameters(robot)
    if isinstance(values, Mapping):
        names = tuple(parameter.name for parameter in parameters)
        for name in values:
            if name not in names:
                remedy = nearest(name, names, "parameters")
                raise EffectError(f"no parameter '{name}'", effect.label, remedy)
        values = [values.get(name, 0.0) for name in names]
    if len(values) != len(parameters):
        names = ", ".join(parameter.name for parameter in parameters)
        raise EffectError(f"{len(values)} values", effect.label, f"give {names}")
    for value, parameter in zip(values, parameters, strict=True):
        if not (np.isfinite(value) and parameter.lower <= value <= parameter.upper):
            limits = f"between {parameter.lower:g} and {parameter.upper:g} {parameter.unit}"
            remedy = f"choose it {limits}"
            raise EffectError(f"{parameter.name} = {value:g}", effect.label, remedy)
    return tuple(float(value) for value in values)


def _shaped(effect: Effect, robot: Robot, shape) -> Effect:
    if isinstance(shape, Mapping):
        names = tuple(one.name for one in effect.shape_parameters(robot))
        for name in shape:
            if name not in names:
                remedy = nearest(name, names, "shape parameters")
                raise EffectError(f"no shape parameter '{name}'", effect.label, remedy)
        shape = [shape.get(name, own) for name, own in zip(names, effect.shape, strict=True)]
    return effect.shaped(*shape).on(robot) if len(shape) else effect


@dataclass(frozen=True, eq=False)
class ActingEffects:
    """A robot and all the effects that act on it.

    Attributes
    ----------
    robot : with the bodies that effects put on board.
    effects : that act.
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`.
    carries_payload : whether the payload is on board.
    number : of the recording that is made, from 1; 0 where no effect asks for it.
    """

    robot: Robot
    effects: tuple[TrueEffect, ...] = ()
    _: KW_ONLY
    friction_width: float | tuple[float, ...] = FRICTION_WIDTH
    carries_payload: bool = False
    number: int = 0

    @property
    def friction_widths(self) -> np.ndarray:
        """Friction width of each joint, (n,) rad/s or m/s."""
        return np.broadcast_to(self.friction_width, self.robot.n)

    def numbered(self, number: int) -> Self:
        """Return it as it is in one recording; itself where recordings do not differ."""
        if any(one.effect.found_by == "repetition" for one in self.effects):
            return replace(self, number=number)
        return self

    def require_possible(self) -> None:
        """Refuse effects that cannot be simulated, and torque gains that are not positive.

        Raises
        ------
        SimulationError
            Naming the effect or the joint.
        """
        for one in self.effects:
            if why := one.effect.not_simulated:
                remedy = "leave it out of what is simulated; fits can have it"
                raise SimulationError(f"cannot be simulated: {why}", one.effect.label, remedy)
        for joint, gain in zip(self.robot.names, self.gain, strict=True):
            if not (gain > 0 and np.isfinite(gain)):
                what, remedy = f"torque gain {gain:g}", "choose a gain error above -1"
                raise SimulationError(what, f"joint '{joint}'", remedy)

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
    def delay(self) -> np.ndarray:
        """Time by which the recorded torque is late, (n,) s."""
        total = np.zeros(self.robot.n)
        for one in self.effects:
            total += one.effect.simulated_delay(one.values, self.robot)
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
        """Return samples as effects see them; no force depends on the acceleration.

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v : (T, n) rad or m, and per s, of the motors.
        """
        return Block(
            t,
            q,
            v,
            np.zeros_like(q),
            names=self.robot.names,
            friction_width=self.friction_widths,
            carries_payload=self.carries_payload,
            number=self.number,
        )

    @cached_property
    def transmissions(self) -> tuple[Transmission, ...]:
        """What gives way between motors and links, with the inertia of each motor.

        Raises
        ------
        SimulationError
            If there are two at one joint, or a motor has no inertia.
        """
        found: dict[int, Transmission] = {}
        for one in self.effects:
            made = one.effect.simulated_transmission(one.values, self.robot)
            if made is None:
                continue
            where = f"joint '{self.robot.names[made.joint]}'"
            if made.joint in found:
                raise SimulationError("two transmissions give way", where, "leave one of them out")
            own = float(self.inertia[made.joint, made.joint])
            made = replace(made, rotor=own) if own > 0 else made
            if not made.rotor > 0:
                remedy = "give it rotor_inertia, or the effect a rotor share above 0"
                raise SimulationError("a motor without inertia before a spring", where, remedy)
            found[made.joint] = made
        return tuple(found[joint] for joint in sorted(found))

    @cached_property
    def loss(self) -> np.ndarray:
        """Dry friction per torque that acts, (n,)."""
        total = np.zeros(self.robot.n)
        for one in self.effects:
            total += one.effect.simulated_loss(one.values, self.robot)
        return total

    @property
    def memory(self) -> int:
        """Number of internal states of the effects, one effect after the other."""
        return sum(one.effect.memory for one in self.effects)

    def force(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, memory: np.ndarray | None = None
    ) -> np.ndarray:
        """Return what effects take from the torque that acts, (T, n) N m or N.

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v : (T, n) rad or m, and per s, of the motors.
        memory : (T, m) internal states; None for zero.
        """
        total = np.zeros(q.shape)
        for one, block in self._blocks(t, q, v, memory):
            total = total + one.effect.simulated_force(one.values, block)
        return total

    def memory_rate(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, memory: np.ndarray
    ) -> np.ndarray:
        """Return the rates of the internal states, (T, m) per s.

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v : (T, n) rad or m, and per s, of the motors.
        memory : (T, m) internal states.
        """
        rates = [np.zeros((len(q), 0))]
        for one, block in self._blocks(t, q, v, memory):
            if one.effect.memory:
                rates.append(one.effect.simulated_rate(one.values, block))
        return np.hstack(rates)

    def _blocks(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, memory: np.ndarray | None
    ) -> Iterator[tuple[TrueEffect, Block]]:
        """Yield each effect, and the samples as it sees them."""
        block, first = self.block(t, q, v), 0
        for one in self.effects:
            own = block
            if count := one.effect.memory:
                rows = np.zeros((len(q), count))
                if memory is not None:
                    rows = memory[:, first : first + count]
                own, first = replace(block, memory=rows), first + count
            yield one, own
