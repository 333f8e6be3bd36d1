"""One simulation of a plant under its controllers, from sample to sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from dynident.closed_loop.plant.diagram import Plant
from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
from dynident.closed_loop.stepped_motion import (
    WINDOW,
    Hold,
    JointLoop,
    Measurement,
    SteppedMotion,
    chattering,
    rms,
    runaway,
)
from dynident.errors import SimulationError

_SMALLEST_STEP = 1e-4
"""Of a sample; a motion that needs smaller ones is on its way to infinity."""


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
        self._hold = Hold.of(delay, rate)

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
        beyond, pace = runaway(reference.q, reference.v), rms(reference.v)

        simulator, state, held = self._start(time[0], reference)
        # The object behind the input stays; asking for it is how Drake learns that it changes.
        data, torque = held.GetMutableData, held.GetMutableData().get_mutable_value()
        advance = simulator.AdvanceTo
        states = np.empty((total, state.size()))
        measured, commands = np.empty((total, size)), np.empty((total, size))
        saturated = np.zeros((total, size), dtype=bool)
        late, rest = self._hold.late, self._hold.rest
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
            if k % WINDOW == WINDOW - 1:
                self._check_chatter(time[k], states[k + 1 - WINDOW : k + 1], pace)
            if k % every == 0 or k + 1 == total:
                progress((k + 1) / rate)
        acting, mean = self._hold.arrived(commands)
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

    # --- what goes wrong -----------------------------------------------------------------------

    def _check_chatter(self, time: float, states: np.ndarray, pace: np.ndarray) -> None:
        """Refuse a loop whose speed swings from sample to sample by more than it follows."""
        worst = chattering(states[:, self._plant.speeds], pace)
        if worst is not None:
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
