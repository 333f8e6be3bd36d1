"""A robot as it truly is: bodies and effects, from motion to torque and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.closed_loop.true_effects import ActingEffects, TrueEffect, ordered
from dynident.effects import FRICTION_WIDTH
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
        """Return that of one mechanism among others side by side.

        Parameters
        ----------
        rows : samples that are kept.
        joints : the mechanism's columns of `q` and `v`.
        memory : its columns of `memory`.
        """
        return Past(self.q[rows, joints], self.v[rows, joints], self.memory[rows, memory])


@dataclass(frozen=True, eq=False)
class Mechanism(ActingEffects):
    """A robot and its true effects, ready to compute torques; attributes as of `ActingEffects`."""

    @classmethod
    def of(
        cls,
        robot: Robot,
        effects: Sequence[TrueEffect] = (),
        friction_width: float | tuple[float, ...] = FRICTION_WIDTH,
        *,
        carries_payload: bool = False,
    ) -> Mechanism:
        """Return the mechanism of a robot without effects and the effects that it has.

        Parameters
        ----------
        robot : with its true inertias.
        effects : that it has, each on this robot.
        friction_width : rad/s or m/s.
        carries_payload : whether the payload is on board.

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
            acting.append(replace(one, effect=effect, values=values))
            robot = effect.simulated_robot(values, robot)
        made = cls(
            robot, tuple(acting), friction_width=friction_width, carries_payload=carries_payload
        )
        made.require_possible()
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
        made.require_possible()
        return made

    def command(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the recorded torque that a motion takes, (T, n) N m or N.

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v, a : (T, n) rad or m, and derivatives, of the motors.

        Raises
        ------
        SimulationError
            If it depends on what went before: a transmission gives way, or an effect remembers.
        """
        self._require_no_past()
        return self.stiff_command(t, q, v, a)

    def inverse_dynamics(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the command at time zero (T, n), for a controller whose nominal model it is.

        Parameters
        ----------
        q, v, a : (T, n) rad or m, and derivatives.
        """
        return self.command(np.zeros(len(q)), q, v, a)

    def stiff_command(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> np.ndarray:
        """Return `command` (T, n) as if nothing gave way and internal states were zero.

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v, a : (T, n) rad or m, and derivatives, of the motors.
        """
        rigid = self.robot.inverse_dynamics(q, v, a)
        load = rigid + a @ self.inertia.T + self.force(t, q, v)
        return self.gain * (load + self.loss * np.abs(load) * self._sign(v))

    def _sign(self, v: np.ndarray) -> np.ndarray:
        return np.tanh(v / self.friction_widths)

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

        Parameters
        ----------
        t : (T,) s, in the session.
        q, v : (T, n) rad or m, and per s, of the motors.
        u : (T, n) recorded torque, N m or N.
        past : what the acceleration depends on besides; None where that is nothing.

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
