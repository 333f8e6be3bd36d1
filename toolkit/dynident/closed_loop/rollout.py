"""What is to be simulated, and what comes of it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np

from dynident.closed_loop.mechanism import Mechanism, Past
from dynident.closed_loop.references import Reference
from dynident.errors import SimulationError
from dynident.robot import Robot

LEAD_IN = 2.0
"""s that a motion is simulated before it is recorded, for its transient to decay."""


@dataclass(frozen=True, eq=False)
class Task:
    """A mechanism that follows a trajectory.

    Attributes
    ----------
    mechanism : Mechanism
    trajectory : any `Reference`; its time is zero at the first sample.
    duration : s.
    start : s, when the first sample is taken in the session.
    rng : of the encoder's noise; None for none.
    noise_sign : 1, or -1 for the mirror image of that noise.
    name : for messages.
    nominal : the model inside the controller (a computed torque, a feed-forward): bodies alone, or
        with effects; None for the mechanism's own robot.
    """

    mechanism: Mechanism
    trajectory: Reference
    duration: float
    _: KW_ONLY
    start: float = 0.0
    rng: np.random.Generator | None = None
    noise_sign: float = 1.0
    name: str = ""
    nominal: Robot | Mechanism | None = None

    def require_fit(self, controlled: int, n: int) -> None:
        """Refuse what cannot be simulated.

        Parameters
        ----------
        controlled : number of the controller's joints.
        n : number of joints of the robots beside it.

        Raises
        ------
        SimulationError
            If a number of joints differs from these, or a value is not finite.
        """
        robot = self.mechanism.robot
        counts = [("robot", robot.n), ("trajectory", self.trajectory.n)]
        nominal = self.nominal.robot if isinstance(self.nominal, Mechanism) else self.nominal
        if nominal is not None:
            counts.append(("nominal robot", nominal.n))
        for what, count in counts:
            if count != controlled or count != n:
                what = f"a {what} of {count} joints under a controller of {controlled}"
                raise SimulationError(
                    what, self.name or None, "give each as many joints as the robot"
                )
        for one in (robot, nominal or robot):
            if not np.isfinite(one.theta).all():
                remedy = "fix the inertial elements of its description"
                raise SimulationError("has inertial values that are not finite", one.name, remedy)
        for one in self.mechanism.effects:
            if not np.isfinite(one.values).all():
                values = ", ".join(f"{x:g}" for x in one.values)
                raise SimulationError(f"values {values}", one.effect.label, "give finite values")


@dataclass(frozen=True, eq=False, kw_only=True)
class Rollout:
    """A simulated motion, at the controller's samples.

    Attributes
    ----------
    t : (T,) s, from the first sample.
    q, v : (T, n) true position and velocity, rad or m.
    q_measured : (T, n) position as the encoder gives it.
    q_ref, v_ref : (T, n) reference.
    u : (T, n) command; N m or N. It acts, after the controller's delay, until the next one does.
    u_before : (n,) command of the sample before the first.
    torque : (T, n) command that acted, in the mean over the sample before and the one after, as a
        sensor of limited bandwidth has it.
    acting : (T, n) command that acts just after each sample.
    saturated : (n,) share of the commands that are at the controller's limit.
    start : s, when the first sample is taken in the session.
    mechanism : what moved.
    past : what `a` depends on besides the motion and what acts; None where that is nothing.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    q_measured: np.ndarray
    q_ref: np.ndarray
    v_ref: np.ndarray
    u: np.ndarray
    u_before: np.ndarray
    torque: np.ndarray
    acting: np.ndarray
    saturated: np.ndarray
    start: float
    mechanism: Mechanism
    past: Past | None = None

    @cached_property
    def a(self) -> np.ndarray:
        """True acceleration, (T, n) rad/s^2 or m/s^2; it jumps where a command begins to act.

        At a sample it is the one just after.
        """
        t = self.t + self.start
        return self.mechanism.acceleration(t, self.q, self.v, self.acting, self.past)
