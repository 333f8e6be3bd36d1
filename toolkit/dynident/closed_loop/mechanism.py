"""A robot as it truly is: bodies, and effects with their values, acting in four ways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np

from dynident.closed_loop.true_effect import TrueEffect, ordered
from dynident.effects import FRICTION_WIDTH, Block, Term, Transmission
from dynident.errors import EffectError, SimulationError
from dynident.model import Model
from dynident.robot import Robot


@dataclass(frozen=True, eq=False)
class Past:
    """What accelerations depend on besides the motors' motion: left by what went before.

    Attributes
    ----------
    q, v : (T, n) of the links, rad or m, and per s.
    memory : (T, m) internal states of the effects.
    """

    q: np.ndarray
    v: np.ndarray
    memory: np.ndarray

    def of(self, rows: slice, joints: slice, memory: slice) -> Past:
        """Return that of one mechanism among others."""
        return Past(self.q[rows, joints], self.v[rows, joints], self.memory[rows, memory])


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A robot and its true effects, ready to compute torques.

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
    friction_width: float = FRICTION_WIDTH
    carries_payload: bool = False
    number: int = 0

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
            if effect.is_payload and not carries_payload:
                continue
            values = ordered(effect, robot, one.values)
            acting.append(TrueEffect(effect, values, one.hidden))
            robot = effect.simulated_robot(values, robot)
        made = cls(
            robot, tuple(acting), friction_width=friction_width, carries_payload=carries_payload
        )
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
            raise SimulationError(what, remedy="give them in the order of Model.names")
        for name, value in zip(model.names, values, strict=True):
            if not np.isfinite(value):
                raise SimulationError(f"{name} = {value:g}", remedy="give finite values")
        robot = model.robot
        if theta is None:
            rigid = values[: len(model.base.independent)]
            theta = model.base.lift(rigid, robot.theta)
        robot = robot.with_theta(theta)
        acting = []
        for effect in model.effects:
            if effect.is_payload and not carries_payload:
                continue
            own = tuple(float(x) for x in values[model.slices[effect.label]])
            acting.append(TrueEffect(effect, own))
            robot = effect.simulated_robot(own, robot)
        made = cls(
            robot,
            tuple(acting),
            friction_width=model.friction_width,
            carries_payload=carries_payload,
        )
        made._check_gain()
        return made

    def numbered(self, number: int) -> Mechanism:
        """Return it as it is in one recording; itself where no effect tells recordings apart."""
        if any(one.effect.found_by == "repetition" for one in self.effects):
            return replace(self, number=number)
        return self

    def _check_gain(self) -> None:
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
        """Return samples as effects see them; no force depends on the acceleration."""
        return Block(
            t,
            q,
            v,
            np.zeros_like(q),
            self.robot.names,
            self.friction_width,
            self.carries_payload,
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
        """Return what effects take from the torque that acts.

        Parameters
        ----------
        t : (T,) s.
        q, v : (T, n) of the motors.
        memory : (T, m) internal states; None for zero.
        """
        total = np.zeros(q.shape)
        for one, block in self._blocks(t, q, v, memory):
            total = total + one.effect.simulated_force(one.values, block)
        return total

    def memory_rate(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, memory: np.ndarray
    ) -> np.ndarray:
        """Return the rates of the internal states (T, m), per s; see `force`."""
        rates = [np.zeros((len(q), 0))]
        for one, block in self._blocks(t, q, v, memory):
            if one.effect.memory:
                rates.append(one.effect.simulated_rate(one.values, block))
        return np.hstack(rates)

    def _blocks(self, t, q, v, memory):
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

    def command(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the recorded torque that a motion takes, (T, n) N m or N.

        Raises
        ------
        SimulationError
            If it depends on what went before: a transmission gives way, or an effect remembers.
        """
        self._require_no_past()
        return self.stiff_command(t, q, v, a)

    def inverse_dynamics(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the command at time zero, as a controller that believes in it has it, (T, n)."""
        return self.command(np.zeros(len(q)), q, v, a)

    def stiff_command(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> np.ndarray:
        """Return `command` as if nothing gave way and internal states were zero."""
        rigid = self.robot.inverse_dynamics(q, v, a)
        load = rigid + a @ self.inertia.T + self.force(t, q, v)
        return self.gain * (load + self.loss * np.abs(load) * self._sign(v))

    def _sign(self, v: np.ndarray) -> np.ndarray:
        return np.tanh(v / self.friction_width)

    def _require_no_past(self) -> None:
        if self._with_a_past is not None:
            raise SimulationError(
                "its torque is not a function of the motion at an instant",
                self._with_a_past,
                "simulate it in a closed loop",
            )

    @cached_property
    def _with_a_past(self) -> str | None:
        """The first effect whose torque depends on what went before."""
        for one in self.effects:
            gives = one.effect.simulated_transmission(one.values, self.robot) is not None
            if np.any(one.values) and (gives or one.effect.memory):
                return one.effect.label
        return None

    def acceleration(
        self,
        t: np.ndarray,
        q: np.ndarray,
        v: np.ndarray,
        u: np.ndarray,
        past: Past | None = None,
    ) -> np.ndarray:
        """Return the acceleration of the motors under a recorded torque, (T, n).

        The inverse of `command`; where that needs it, with the past.

        Raises
        ------
        SimulationError
            See `command`.
        """
        if past is None:
            self._require_no_past()
            past = Past(q, v, np.zeros((len(q), self.memory)))
        still, unit = np.zeros_like(q), np.eye(self.robot.n)
        weight = self.robot.inverse_dynamics(past.q, still, still)
        mass = [self.robot.inverse_dynamics(past.q, still, still + e) - weight for e in unit]
        inertia = np.stack(mass, axis=2) + self.inertia
        acting = u / self.gain
        if np.any(self.loss):
            acting = acting / (1.0 + self.loss * self._sign(v) * np.sign(acting))
        load = acting - self.force(t, q, v, past.memory)
        motors = {}
        for gear in self.transmissions:
            j = gear.joint
            carried = gear.torque(q[:, j] - past.q[:, j], v[:, j] - past.v[:, j])
            motors[j] = (load[:, j] - carried) / gear.rotor
            load[:, j] = carried
            inertia[:, j, j] -= self.inertia[j, j]  # the motor is not the link's
        load = load - self.robot.inverse_dynamics(past.q, past.v, still)
        a = np.linalg.solve(inertia, load[:, :, None])[:, :, 0]
        for j, own in motors.items():
            a[:, j] = own
        return a
