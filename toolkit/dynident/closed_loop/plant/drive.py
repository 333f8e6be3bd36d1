"""A controller at work: from measured positions to torques, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.mechanism import Mechanism
from dynident.robot import Robot


@dataclass(frozen=True, eq=False)
class ReferenceSamples:
    """The reference of K robots of n joints side by side, at the controller's samples.

    Attributes
    ----------
    q, v, a : (T, K n) rad or m, and derivatives.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class DriveNumbers:
    """What a controller computes with on its N = K n joints.

    Attributes
    ----------
    kp, kd, ki : (N,) of the measured position, of speed, and of the error in a sample.
    ahead : (T, N) all that the reference adds to the command, known beforehand.
    q_ref : (T, N)
    limit : (N,) of the command; infinite without one.
    blend : share of a new difference in the speed; None without a low-pass.
    before, speed : (N,) position and speed before the first sample.
    integral : (N,) what it begins with.
    """

    kp: np.ndarray
    kd: np.ndarray
    ki: np.ndarray
    ahead: np.ndarray
    q_ref: np.ndarray
    limit: np.ndarray
    blend: float | None
    before: np.ndarray
    speed: np.ndarray
    integral: np.ndarray

    @property
    def integrates(self) -> bool:
        """Whether there is an integral."""
        return bool(np.any(self.ki))


class Drive:
    """The same controller on K robots of n joints side by side; vectors are (K n,).

    At the sample before the first the robots were a sample's motion behind the reference's start.

    Parameters
    ----------
    controller : of n joints.
    reference : what all of them follow.
    nominal : the model inside the controller, for each robot. Used by a computed torque and by a
        feed-forward only.
    scale : (n,) factor of the feedback; None for 1.
    steady : (K n,) first command of a controller with an integral, which begins with what makes
        it so: an integral that begins at zero takes long to find the weight. None for zero.

    Attributes
    ----------
    limited : whether its torques have a limit.
    numbers : what it computes with.
    """

    def __init__(
        self,
        controller: Controller,
        reference: ReferenceSamples,
        nominal: Sequence[Robot | Mechanism],
        scale: np.ndarray | None = None,
        steady: np.ndarray | None = None,
    ) -> None:
        n, rate, count = controller.n, controller.simulated_rate(), len(nominal)
        feedback, factor = controller.feedback(), np.ones(n) if scale is None else scale
        self._rate, self._n = rate, n
        kp, kd = np.tile(factor * feedback.position, count), np.tile(factor * feedback.speed, count)
        ki = np.tile(factor * feedback.integral / rate, count)
        self._robots = _distinct(nominal)
        self._through_model = controller.law.through_model
        ahead = kp * reference.q + feedback.follow * kd * reference.v
        if self._through_model:
            ahead += reference.a
        elif controller.feedforward:
            for robot, rows in self._robots:
                for row in rows:
                    own = slice(row * n, row * n + n)
                    motion = (x[:, own] for x in (reference.q, reference.v, reference.a))
                    ahead[:, own] += robot.inverse_dynamics(*motion)
        limit, cutoff = controller.limit, controller.derivative_cutoff_hz
        self.limited = limit is not None
        integral = np.zeros(n * count)
        if steady is not None and np.any(ki):
            integral = steady - (ahead[0] - kp * reference.q[0] - kd * reference.v[0])
        self.numbers = DriveNumbers(
            kp=kp,
            kd=kd,
            ki=ki,
            ahead=ahead,
            q_ref=reference.q,
            limit=np.full(n * count, np.inf) if limit is None else np.tile(limit, count),
            # Exact for a velocity that is constant from sample to sample.
            blend=None if cutoff is None else -math.expm1(-2 * math.pi * cutoff / rate),
            before=reference.q[0] - reference.v[0] / rate,
            speed=reference.v[0],
            integral=integral,
        )
        self._integrates = self.numbers.integrates
        self._saturated = np.zeros(n * count, dtype=bool)
        self._q, self._v, self._integral = self.numbers.before, self.numbers.speed, integral

    @property
    def saturated(self) -> np.ndarray:
        """Which of the last command's torques are at their limit, (K n,) bool."""
        return self._saturated

    def command(self, k: int, q: np.ndarray) -> np.ndarray:
        """Return the torque of sample k, (K n,) N m or N, from the measured position q."""
        known = self.numbers
        speed = (q - self._q) * self._rate
        self._q = q
        if known.blend is None:
            self._v = speed
        else:
            self._v = self._v + known.blend * (speed - self._v)
        u = known.ahead[k] - known.kp * q - known.kd * self._v
        integral = self._integral
        if self._integrates:
            integral = integral + known.ki * (known.q_ref[k] - q)
            u += integral
        if self._through_model:
            u = self._inverse_dynamics(q, u)
        if self.limited:
            self._saturated = np.abs(u) >= known.limit
            integral = np.where(self._saturated, self._integral, integral)
            u = np.minimum(np.maximum(u, -known.limit), known.limit)
        self._integral = integral
        return u

    def _inverse_dynamics(self, q: np.ndarray, a: np.ndarray) -> np.ndarray:
        shape = (-1, self._n)
        q, v, a = q.reshape(shape), self._v.reshape(shape), a.reshape(shape)
        torque = np.empty_like(q)
        for robot, rows in self._robots:
            torque[rows] = robot.inverse_dynamics(q[rows], v[rows], a[rows])
        return torque.ravel()


def _distinct(
    robots: Sequence[Robot | Mechanism],
) -> list[tuple[Robot | Mechanism, list[int]]]:
    """Return each robot once, with where it stands."""
    by_id = {id(robot): robot for robot in robots}
    return [
        (robot, [k for k, one in enumerate(robots) if one is robot]) for robot in by_id.values()
    ]
