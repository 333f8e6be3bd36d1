"""Joint controllers as drives have them: sampled, held, and fed by the measured position alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from pydantic import Field

from dynident.errors import DynidentError, SimulationError, StudyError
from dynident.settings import Table

if TYPE_CHECKING:
    from dynident.robot import Robot

Kind = Literal["pd", "pid", "cascade", "computed_torque"]
KINDS: tuple[str, ...] = get_args(Kind)
GAINS: dict[str, tuple[str, ...]] = {
    "pd": ("kp", "kd"),
    "pid": ("kp", "ki", "kd"),
    "cascade": ("kp", "kv"),
    "computed_torque": ("kp", "kd"),
}
"""The gains of each kind."""


@dataclass(frozen=True)
class Controller:
    """A position controller of every joint, with a zero-order hold.

    At each sample, with e = q_ref - q:

    - "pd": u = kp e + kd (v_ref - v)
    - "pid": u = kp e + ki (integral of e) + kd (v_ref - v)
    - "cascade": u = kv (kp e - v)
    - "computed_torque": u = M(q) (a_ref + kp e + kd (v_ref - v)) + h(q, v), M and h of the given
      robot; it can be stated, and is not simulated yet

    v is the backward difference of the measured position, through a first-order low-pass where
    `derivative_cutoff_hz` is given. The integral stands still while the torque is at its limit.

    Attributes
    ----------
    kind : "pd", "pid", "cascade" or "computed_torque".
    rate_hz : samples per second; each command is held from its sample to the next. None where it
        is not stated: such a loop cannot be simulated.
    kp, ki, kd, kv : (n,) gains of each joint, none negative. kp, ki, kd in N m/rad, N m/(rad s)
        and N m s/rad (N/m, ... for prismatic joints); of a cascade, kp in 1/s and kv in N m s/rad;
        of a computed torque, kp in 1/s^2 and kd in 1/s.
    velocity_reference : False sets v_ref = 0 (a cascade has no v_ref).
    derivative_cutoff_hz : Hz, or None for the bare difference.
    limit : (n,) N m or N, greatest magnitude of the command, or None.
    delay_s : s from a sample to its command. Stated for the record; it is not simulated yet.
    feedforward : whether the torque of the given robot along the reference is added. Likewise.

    Raises
    ------
    SimulationError
        If a gain is missing, superfluous, negative or not finite, or a setting out of its range.
    """

    kind: Kind
    rate_hz: float | None
    kp: tuple[float, ...]
    kd: tuple[float, ...] = ()
    kv: tuple[float, ...] = ()
    ki: tuple[float, ...] = ()
    velocity_reference: bool = True
    derivative_cutoff_hz: float | None = None
    limit: tuple[float, ...] | None = None
    delay_s: float = 0.0
    feedforward: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise SimulationError(
                f"no controller of kind '{self.kind}'", "controller", f"kinds: {', '.join(KINDS)}"
            )
        for name in ("kp", "kd", "kv", "ki", "limit"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(float(x) for x in np.atleast_1d(value)))
        for name in ("kp", "kd", "kv", "ki"):
            self._check_gain(name, getattr(self, name))
        if self.limit is not None and (
            len(self.limit) != len(self.kp) or not all(x > 0 for x in self.limit)
        ):
            mend = "give one positive number per joint"
            raise SimulationError(f"limit = {list(self.limit)}", "controller.limit", mend)
        for name in ("rate_hz", "derivative_cutoff_hz"):
            value = getattr(self, name)
            if value is not None and not (value > 0 and math.isfinite(value)):
                mend = "choose a positive number"
                raise SimulationError(f"{name} = {value:g}", f"controller.{name}", mend)
        if not (self.delay_s >= 0 and math.isfinite(self.delay_s)):
            mend = "choose it 0 or above"
            raise SimulationError(f"delay_s = {self.delay_s:g}", "controller.delay_s", mend)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.kp)

    def simulated_rate(self) -> float:
        """Return `rate_hz`, if this controller can be simulated.

        Raises
        ------
        SimulationError
            If `rate_hz` is not stated, or something is that cannot be simulated yet.
        """
        if self.kind == "computed_torque":
            mend = "simulate a pd, pid or cascade controller"
            what = "a computed torque cannot be simulated yet"
            raise SimulationError(what, "controller.kind", mend)
        if self.feedforward:
            what = "feedforward cannot be simulated yet"
            raise SimulationError(what, "controller.feedforward", "leave it out")
        if self.delay_s > 0:
            what = f"a delay of {self.delay_s:g} s cannot be simulated yet"
            raise SimulationError(what, "controller.delay_s", "leave it out")
        if self.rate_hz is None:
            what = "the controller's rate is not stated"
            raise SimulationError(what, "controller.rate_hz", "give its samples per second")
        return self.rate_hz

    def _check_gain(self, name: str, value: tuple[float, ...]) -> None:
        where, wanted = f"controller.{name}", name in GAINS[self.kind]
        if bool(value) != wanted:
            verb = "needs" if wanted else "takes no"
            mend = f"its gains are {', '.join(GAINS[self.kind])}"
            raise SimulationError(f'a "{self.kind}" controller {verb} {name}', where, mend)
        if wanted and len(value) != self.n:
            mend = "give one gain per joint"
            raise SimulationError(f"{len(value)} gains for {self.n} joints", where, mend)
        if not all(x >= 0 and math.isfinite(x) for x in value):
            mend = "gains are finite and not negative"
            raise SimulationError(f"{name} = {list(value)}", where, mend)


class Drive:
    """A controller at work: its state from sample to sample.

    Parameters
    ----------
    controller : Controller
    q, v : (n,) position and velocity at the sample before the first.
    """

    def __init__(self, controller: Controller, q: np.ndarray, v: np.ndarray) -> None:
        n, self._rate = controller.n, controller.simulated_rate()
        self._kp = np.array(controller.kp)
        if controller.kind == "cascade":
            # kv (kp e - v) is a PD law without reference velocity.
            self._kd = np.array(controller.kv)
            self._kp = self._kp * self._kd
        else:
            self._kd = np.array(controller.kd)
        follows = controller.velocity_reference and controller.kind != "cascade"
        self._follow = 1.0 if follows else 0.0
        self._ki = np.array(controller.ki) / self._rate if controller.ki else None
        self._integral = np.zeros(n)
        self._limit = None if controller.limit is None else np.array(controller.limit)
        cutoff = controller.derivative_cutoff_hz
        # Exact for a velocity that is constant from sample to sample.
        self._blend = None if cutoff is None else -math.expm1(-2 * math.pi * cutoff / self._rate)
        self._q, self._v = np.array(q, dtype=float), np.array(v, dtype=float)

    def command(self, q: np.ndarray, q_ref: np.ndarray, v_ref: np.ndarray) -> np.ndarray:
        """Return the torque held from this sample to the next, (n,) N m or N.

        Parameters
        ----------
        q : (n,) measured position.
        q_ref, v_ref : (n,) reference.
        """
        speed = (q - self._q) * self._rate
        self._q = q
        if self._blend is None:
            self._v = speed
        else:
            self._v = self._v + self._blend * (speed - self._v)
        error = q_ref - q
        u = self._kp * error + self._kd * (self._follow * v_ref - self._v)
        if self._ki is not None:
            integral = self._integral + self._ki * error
            u = u + integral
            if self._limit is not None:
                integral = np.where(np.abs(u) < self._limit, integral, self._integral)
            self._integral = integral
        if self._limit is not None:
            u = np.minimum(np.maximum(u, -self._limit), self._limit)
        return u


class ControllerFile(Table):
    """The table [controller] of a study or an experiment file."""

    kind: Kind
    rate_hz: float | None = Field(default=None, gt=0)
    kp: float | list[float]
    kd: float | list[float] | None = None
    kv: float | list[float] | None = None
    ki: float | list[float] | None = None
    velocity_reference: bool = True
    derivative_cutoff_hz: float | None = Field(default=None, gt=0)
    limit: float | list[float] | None = None
    delay_s: float = Field(default=0.0, ge=0)
    feedforward: bool = False

    def controller(self, robot: Robot, where: str) -> Controller:
        """Return the controller of a robot; a single number stands for every joint.

        Raises
        ------
        StudyError
            If it does not fit the robot; `where` is the place in the file.
        """

        def spread(name: str) -> tuple[float, ...]:
            value = getattr(self, name)
            if value is None:
                return ()
            if not isinstance(value, Sequence):
                return (float(value),) * robot.n
            if len(value) != robot.n:
                what, mend = f"{len(value)} values for {robot.n} joints", "give one per joint"
                raise StudyError(what, f"{where}.{name}", mend)
            return tuple(value)

        kp, kd, kv, ki = (spread(name) for name in ("kp", "kd", "kv", "ki"))
        try:
            return Controller(
                self.kind,
                self.rate_hz,
                kp,
                kd,
                kv,
                ki,
                self.velocity_reference,
                self.derivative_cutoff_hz,
                spread("limit") or None,
                self.delay_s,
                self.feedforward,
            )
        except DynidentError as error:
            key = (error.where or "").partition(".")[2]
            raise StudyError(error.what, f"{where}.{key}".rstrip("."), error.mend) from None
