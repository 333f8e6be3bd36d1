"""Joint controllers as drives have them: sampled, held, and fed by the measured position alone.

In: gains and settings, as arguments or as the table [controller] of a file. Out: a `Controller`,
whose `feedback` the simulator applies. Every kind is a torque (or, through the model, an
acceleration) that is linear in the errors of position, of its integral and of velocity; a new kind
is one entry of `LAWS`, which says how its gains make these three and whether the result goes
through the nominal robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from dynident.errors import DynidentError, SimulationError, StudyError
from dynident.robot import Robot
from dynident.settings import Rate, SettingsTable, Time, in_unit


@dataclass(frozen=True, eq=False)
class Feedback:
    """position (q_ref - q) + integral (its integral) + speed (follow v_ref - v).

    Attributes
    ----------
    position, integral, speed : (n,) gains, in N m/rad, N m/(rad s) and N m s/rad (N/m, ... for
        prismatic joints); of a law through the model 1/s^2, 1/s^3 and 1/s.
    follow : 1 where the reference's velocity is followed, else 0.
    """

    position: np.ndarray
    integral: np.ndarray
    speed: np.ndarray
    follow: float


@dataclass(frozen=True)
class ControlLaw:
    """One kind of controller.

    Attributes
    ----------
    gains : the names of its gains.
    powers : of a natural frequency that each gain goes with, its damping kept.
    feedback : what they make of the errors.
    through_model : whether the feedback is an acceleration, to which that of the reference is
        added before the nominal robot's inverse dynamics turns it into a torque.
    """

    gains: tuple[str, ...]
    powers: tuple[int, ...]
    feedback: Callable[[Controller], Feedback]
    through_model: bool = False


@dataclass(frozen=True, kw_only=True)
class Controller:
    """A position controller of every joint, with a zero-order hold.

    At each sample, with e = q_ref - q:

    - "pd": u = kp e + kd (v_ref - v)
    - "pid": u = kp e + ki (integral of e) + kd (v_ref - v)
    - "cascade": u = kv (kp e - v)
    - "computed_torque": u = M(q) (a_ref + kp e + kd (v_ref - v)) + h(q, v), with M and h of the
      rigid body that is the controller's nominal model (`Task.nominal`)

    v is the backward difference of the measured position, through a first-order low-pass where
    `derivative_cutoff_hz` is given. The integral stands still while the torque is at its limit.

    A drive whose loops work on a signal before an amplifier is stated with `drive_gain`: the loop
    v_tau = k_p k_v (q_ref - q) - k_v v, tau = g_tau v_tau (Janot, Vandanjon and Gautier, equations
    40 and 41) is a "cascade" with kp = k_p, kv = k_v and drive_gain = g_tau, or with kv = g_tau k_v
    alone.

    Attributes
    ----------
    kind, rate_hz, velocity_reference, derivative_cutoff_hz, delay_s, feedforward : as the keys of
        a file, see `ControllerFile`; without a rate such a loop cannot be simulated.
    kp, ki, kd, kv : (n,) gains of each joint, in the units of `ControllerFile`.
    limit, drive_gain : (n,) as there, or None.

    Raises
    ------
    SimulationError
        If a gain is missing, superfluous, negative or not finite, or a setting out of its range.
    """

    kind: str
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
    drive_gain: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.kind not in LAWS:
            remedy = f"kinds: {', '.join(LAWS)}"
            raise SimulationError(f"no controller of kind '{self.kind}'", "controller.kind", remedy)
        for name in (*GAINS, "limit", "drive_gain"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(float(x) for x in np.atleast_1d(value)))
        for name in GAINS:
            self._check_gain(name, getattr(self, name))
        for name in ("limit", "drive_gain"):
            value = getattr(self, name)
            if value is not None and (len(value) != self.n or not all(x > 0 for x in value)):
                remedy = "give one positive number per joint"
                raise SimulationError(f"{name} = {list(value)}", f"controller.{name}", remedy)
        if self.law.through_model and self.drive_gain is not None:
            what = f"the model of a {self.kind} makes torques, not signals"
            raise SimulationError(what, "controller.drive_gain", "leave it out")
        for name in ("rate_hz", "derivative_cutoff_hz"):
            value = getattr(self, name)
            if value is not None and not (value > 0 and math.isfinite(value)):
                remedy = "choose a positive number"
                raise SimulationError(f"{name} = {value:g}", f"controller.{name}", remedy)
        if not (self.delay_s >= 0 and math.isfinite(self.delay_s)):
            remedy = "choose it 0 or above"
            raise SimulationError(f"delay_s = {self.delay_s:g}", "controller.delay_s", remedy)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.kp)

    @property
    def law(self) -> ControlLaw:
        """What its kind does."""
        return LAWS[self.kind]

    def feedback(self) -> Feedback:
        """Return what it makes of the errors, with the gain of the drive."""
        found = self.law.feedback(self)
        if self.drive_gain is None:
            return found
        g = np.array(self.drive_gain)
        return Feedback(g * found.position, g * found.integral, g * found.speed, found.follow)

    def simulated_rate(self) -> float:
        """Return `rate_hz`, if this controller can be simulated.

        Raises
        ------
        SimulationError
            If `rate_hz` is not stated.
        """
        if self.rate_hz is None:
            what = "the controller's rate is not stated"
            remedy = "give its samples per second"
            raise SimulationError(what, "controller.rate_hz", remedy, reason="clock")
        return self.rate_hz

    def _check_gain(self, name: str, value: tuple[float, ...]) -> None:
        where, wanted = f"controller.{name}", name in self.law.gains
        if bool(value) != wanted:
            verb = "needs" if wanted else "takes no"
            remedy = f"its gains are {', '.join(self.law.gains)}"
            raise SimulationError(f'a "{self.kind}" controller {verb} {name}', where, remedy)
        if wanted and len(value) != self.n:
            remedy = "give one gain per joint"
            raise SimulationError(f"{len(value)} gains for {self.n} joints", where, remedy)
        if not all(x >= 0 and math.isfinite(x) for x in value):
            remedy = "gains are finite and not negative"
            raise SimulationError(f"{name} = {list(value)}", where, remedy)


def _parallel(controller: Controller) -> Feedback:
    kp, kd = np.array(controller.kp), np.array(controller.kd)
    ki = np.array(controller.ki) if controller.ki else np.zeros(len(kp))
    return Feedback(kp, ki, kd, float(controller.velocity_reference))


def _cascade(controller: Controller) -> Feedback:
    # kv (kp e - v) is a PD law without reference velocity.
    kp, kv = np.array(controller.kp), np.array(controller.kv)
    return Feedback(kv * kp, np.zeros(len(kp)), kv, 0.0)


LAWS: dict[str, ControlLaw] = {
    "pd": ControlLaw(("kp", "kd"), (2, 1), _parallel),
    "pid": ControlLaw(("kp", "ki", "kd"), (2, 3, 1), _parallel),
    "cascade": ControlLaw(("kp", "kv"), (1, 1), _cascade),
    "computed_torque": ControlLaw(("kp", "kd"), (2, 1), _parallel, through_model=True),
}
"""The kinds by name."""
GAINS = tuple(dict.fromkeys(name for law in LAWS.values() for name in law.gains))
"""The names of all gains."""


def _gain(unit: str):
    return Field(default=None, json_schema_extra=in_unit(unit))


class ControllerFile(SettingsTable):
    """The table [controller] of a study or an experiment file: the loop that moved the robot.

    A number in the place of a list stands for every joint. At each sample, with e = q_ref - q:

    - "pd": u = kp e + kd (v_ref - v)
    - "pid": u = kp e + ki (integral of e) + kd (v_ref - v)
    - "cascade": u = kv (kp e - v)
    - "computed_torque": u = M(q) (a_ref + kp e + kd (v_ref - v)) + h(q, v)
    """

    kind: str = Field(json_schema_extra={"enum": [*LAWS]})
    """The law, see above."""
    rate_hz: Rate | None = None
    """Samples per second; each command is held from its sample to the next. Needed to simulate the
    loop."""
    kp: float | list[float] = Field(
        json_schema_extra=in_unit("N m/rad, N/m; cascade 1/s; computed torque 1/s^2")
    )
    """Gain of the error of position, not negative; one, or one per joint."""
    kd: float | list[float] | None = _gain("N m s/rad, N s/m; computed torque 1/s")
    """Gain of the error of velocity, of every kind but a cascade."""
    kv: float | list[float] | None = _gain("N m s/rad, N s/m")
    """Gain of the inner loop of a cascade."""
    ki: float | list[float] | None = _gain("N m/(rad s), N/(m s)")
    """Gain of the integral, of a pid. The integral stands still while the torque is at its
    limit."""
    velocity_reference: bool = True
    """False sets v_ref = 0 (a cascade has no v_ref)."""
    derivative_cutoff_hz: Rate | None = None
    """First-order low-pass of the measured velocity; by default the bare backward difference of
    the position."""
    limit: float | list[float] | None = _gain("N m or N")
    """Greatest magnitude of the command, above zero; one, or one per joint."""
    delay_s: Annotated[Time, Field(ge=0)] = 0.0
    """From a sample to when its command acts; any fraction or multiple of a sample."""
    feedforward: bool = False
    """Whether the torque of the controller's nominal model, along the reference, is added (a
    computed torque has it already: there it changes nothing)."""
    drive_gain: float | list[float] | None = _gain("N m or N per unit of control signal")
    """Of a drive whose loops work on a signal before an amplifier, above zero; the gains are then
    per unit of torque above, in units of that signal. By default the gains make torques."""

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
                what, remedy = f"{len(value)} values for {robot.n} joints", "give one per joint"
                raise StudyError(what, f"{where}.{name}", remedy)
            return tuple(value)

        said = self.model_dump()
        said |= {name: spread(name) for name in GAINS}
        said |= {name: spread(name) or None for name in ("limit", "drive_gain")}
        try:
            return Controller(**said)
        except DynidentError as error:
            key = (error.where or "").partition(".")[2]
            raise StudyError(error.what, f"{where}.{key}".rstrip("."), error.remedy) from None
