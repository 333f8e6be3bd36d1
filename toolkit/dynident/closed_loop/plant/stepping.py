"""One simulation of a plant under its controllers, from sample to sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from dynident.closed_loop.mechanism import Past
from dynident.closed_loop.plant.diagram import Plant
from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
from dynident.errors import SimulationError

_SMALLEST_STEP = 1e-4
"""Of a sample; a motion that needs smaller ones is on its way to infinity."""
_WINDOW = 200
"""Samples between looks at the whole motion."""
_RUNAWAY = 100.0
"""A state this many times beyond the reference's has left the earth."""
_ROUNDING = 1e-6
"""Of a sample; a delay this near to a whole number of samples is one."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the encoders add to the positions of N joints.

    Attributes
    ----------
    noise : (T, N) rad or m.
    resolution : (N,) rad or m; 0 for none.
    """

    noise: np.ndarray
    resolution: np.ndarray

    def of(self, k: int, q: np.ndarray) -> np.ndarray:
        """Return positions q (N,) as they are measured at sample k."""
        if self._noisy:
            q = q + self.noise[k]
        if self._coarse:
            q = np.where(self.resolution == 0, q, np.rint(q / self._step) * self._step)
        return q

    @cached_property
    def _noisy(self) -> bool:
        return bool(np.any(self.noise))

    @cached_property
    def _coarse(self) -> bool:
        return bool(np.any(self.resolution > 0))

    @cached_property
    def _step(self) -> np.ndarray:
        return np.where(self.resolution == 0, 1.0, self.resolution)


@dataclass(frozen=True, eq=False, kw_only=True)
class SteppedMotion:
    """What came of it, (T, N) each.

    Attributes
    ----------
    q, v : true motion.
    measured : position as the controller gets it.
    u : command as the controller gives it.
    acting, mean : command that acts just after a sample, and in the mean until the next one.
    saturated : whether the command is at its limit.
    past : what else the accelerations depend on; None where that is nothing.
    """

    q: np.ndarray
    v: np.ndarray
    measured: np.ndarray
    u: np.ndarray
    acting: np.ndarray
    mean: np.ndarray
    saturated: np.ndarray
    past: Past | None = None


@dataclass(frozen=True)
class JointLoop:
    """How messages call a joint: the motion's name, the joint's, and its unit."""

    task: str
    name: str
    unit: str


class Stepper:
    """Steps a plant through T samples; stacked vectors are (N,).

    Parameters
    ----------
    plant : with the parameters of this simulation.
    joints : what they are called.
    rate : samples per second.
    delay : s, from a sample to when its command acts.
    accuracy : of the integrator.
    """

    def __init__(
        self, plant: Plant, joints: Sequence[JointLoop], rate: float, delay: float, accuracy: float
    ) -> None:
        self._plant, self._joints, self._rate, self._accuracy = plant, joints, rate, accuracy
        samples = delay * rate
        self._late = int(np.floor(samples + _ROUNDING))
        rest = samples - self._late
        self._rest = rest if rest > _ROUNDING else 0.0

    def run(
        self,
        time: np.ndarray,
        reference: ReferenceSamples,
        drive: Drive,
        measurement: Measurement,
        progress: Callable[[float], None],
    ) -> SteppedMotion:
        """Start on the reference and follow it.

        Parameters
        ----------
        time : (T + 1,) s, of the samples and of the end of the last.
        reference, drive, measurement : of these samples.
        progress : called now and then with the seconds done.

        Returns
        -------
        The motion at the samples, and the commands that made it.

        Raises
        ------
        SimulationError
            If the loop diverges, oscillates, or meets an inertia that is not positive definite.
        """
        plant, rate = self._plant, self._rate
        place, order = plant.positions, np.argsort(plant.inputs)
        effect = (1.0 / plant.gain)[order]
        total, size = measurement.noise.shape
        beyond = (_RUNAWAY * (1.0 + np.abs(reference.q).max() + np.abs(reference.v).max())) ** 2

        simulator, state, held = self._start(time[0], reference)
        # The object behind the input stays; asking for it is how Drake learns that it changes.
        data, torque = held.GetMutableData, held.GetMutableData().get_mutable_value()
        advance = simulator.AdvanceTo
        states = np.empty((total, state.size()))
        measured, commands = np.empty((total, size)), np.empty((total, size))
        saturated = np.zeros((total, size), dtype=bool)
        late, rest = self._late, self._rest
        every = max(1, total // 200)
        for k in range(total):
            states[k] = x = state.CopyToVector()
            if not x.dot(x) < beyond:  # true of NaN too
                raise self._diverged(time[k], x)
            measured[k] = q = measurement.of(k, x[place])
            commands[k] = u = drive.command(k, q)
            if drive.limited:
                saturated[k] = drive.saturated
            if late:
                u = commands[max(k - late, 0)]
            try:
                # Before the first command acts, it is as if it did.
                if rest and k:
                    data()
                    torque.SetFromVector(commands[max(k - late - 1, 0)][order] * effect)
                    advance(time[k] + rest / rate)
                data()
                torque.SetFromVector(u[order] * effect)
                advance(time[k + 1])
            except (RuntimeError, np.linalg.LinAlgError) as error:
                raise self._diverged(time[k], state.CopyToVector(), error) from None
            if k % _WINDOW == _WINDOW - 1:
                self._check_chatter(time[k], states[k + 1 - _WINDOW : k + 1], reference.v)
            if k % every == 0 or k + 1 == total:
                progress((k + 1) / rate)
        acting, mean = self._arrived(commands)
        return SteppedMotion(
            q=states[:, place],
            v=states[:, plant.speeds],
            measured=measured,
            u=commands,
            acting=acting,
            mean=mean,
            saturated=saturated,
            past=plant.past(states) if plant.remembers else None,
        )

    def _start(self, time: float, reference: ReferenceSamples) -> tuple[Any, Any, Any]:
        diagram, context, place = self._plant.diagram, self._plant.context, self._plant.place
        context.SetTime(time)
        held: Any = diagram.get_input_port().FixValue(context, np.zeros(len(place)))
        first = (reference.q[0], reference.v[0], reference.a[0])
        context.SetContinuousState(self._plant.start(*first))
        simulator: Any = Simulator(diagram, context)
        # Above one sample, or rounding of the time would leave a second, tiny step.
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 2.0 / self._rate)
        integrator = simulator.get_mutable_integrator()
        integrator.set_target_accuracy(self._accuracy)
        integrator.set_requested_minimum_step_size(_SMALLEST_STEP / self._rate)
        simulator.Initialize()
        return simulator, context.get_continuous_state_vector(), held

    def _arrived(self, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return `SteppedMotion.acting` and `SteppedMotion.mean` of the commands."""
        rows = np.arange(len(commands)) - self._late
        now, before = commands[np.maximum(rows, 0)], commands[np.maximum(rows - 1, 0)]
        return before if self._rest else now, (1.0 - self._rest) * now + self._rest * before

    # --- what goes wrong -----------------------------------------------------------------------

    def _check_chatter(self, time: float, states: np.ndarray, v_ref: np.ndarray) -> None:
        """Refuse a loop whose speed swings from sample to sample by more than it follows."""
        v = states[:, self._plant.speeds]
        swing, pace = _rms(np.diff(v, 2, axis=0)), _rms(v_ref)
        # A joint that stands still swings by its encoder's noise alone.
        worst = int(np.argmax(swing / np.maximum(pace, 0.1 * pace.max() + 1e-9)))
        if swing[worst] > max(pace[worst], 0.1 * pace.max()) > 0:
            raise self._failure(worst, time, "the loop oscillates from sample to sample")

    def _diverged(
        self, time: float, x: np.ndarray, cause: Exception | None = None
    ) -> SimulationError:
        place = self._plant.place
        speeds = x[self._plant.speeds]
        worst = int(np.argmax(np.where(np.isfinite(speeds), np.abs(speeds), np.inf)))
        task = self._joints[worst].task
        n = len(self._joints) // self._plant.count
        if (cause is not None and "positive-definite" in str(cause)) or (
            self._plant.inertia_is_lost(x[place], worst // n)
        ):
            return SimulationError(
                "the joint-space inertia is not positive where the motion went",
                f"{task}, t = {time:.4g} s" if task else f"t = {time:.4g} s",
                "check the inertias of the robot (dynident check) and of its effects",
                reason="inertia",
            )
        what = "the loop diverges"
        if cause is not None:
            what = "the loop cannot be integrated"
            what += f" ({str(cause).strip().splitlines()[0].rstrip('.')})"
        return self._failure(worst, time, what, speeds[worst])

    def _failure(
        self, joint: int, time: float, what: str, speed: float | None = None
    ) -> SimulationError:
        one = self._joints[joint]
        what += f": joint '{one.name}'"
        what += "" if speed is None else f" moves at {speed:.3g} {one.unit}/s"
        where = f"{one.task}, t = {time:.4g} s" if one.task else f"t = {time:.4g} s"
        remedy = "lower the controller's gains, or raise its rate_hz"
        return SimulationError(what, where, remedy, reason="unstable")


def _rms(x: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(x**2, axis=0))
