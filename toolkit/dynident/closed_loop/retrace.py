"""Recordings run again: their references, through models of their robots, in the same loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.loop import ClosedLoop, Progress
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.references import SampledReference
from dynident.closed_loop.rollout import Rollout, Task
from dynident.closed_loop.sensors import Sensors
from dynident.errors import SimulationError
from dynident.recording import Recording
from dynident.robot import Robot

_ROUNDING = 1e-6
"""Of a sample: time stamps this near to the controller's are the controller's."""


@dataclass(frozen=True, eq=False, kw_only=True)
class EncoderNoise:
    """White noise of the encoders in recordings that are run again.

    Attributes
    ----------
    std : (n,) rad or m.
    seed : of the first recording's noise; the others' follow from it.
    sign : 1, or -1 for the mirror image.
    """

    std: np.ndarray
    seed: tuple[int, ...]
    sign: float = 1.0


@dataclass(frozen=True, eq=False)
class Retraced:
    """A recording, and what the model makes of its reference.

    Attributes
    ----------
    recording : as the measured one (time stamps, settings, convention of the torque), with the
        simulated motion and torque; velocity and acceleration only where the measured one has
        them.
    rollout : at the controller's samples.
    saturated : (n,) share of the commands at the controller's limit.
    """

    recording: Recording
    rollout: Rollout
    saturated: np.ndarray


def retrace(
    loop: ClosedLoop,
    mechanisms: Sequence[Mechanism],
    recordings: Sequence[Recording],
    controller: Controller,
    *,
    nominal: Robot | None = None,
    feedback_scale: np.ndarray | None = None,
    noise: EncoderNoise | None = None,
    progress: Progress | None = None,
) -> tuple[Retraced, ...]:
    """Run the references of recordings again, in closed loop.

    Each starts on its reference, with the reference's velocity, at the recording's first sample.

    Parameters
    ----------
    loop : that simulates; its diagram is used again.
    mechanisms : the robot of each recording (its payload may differ).
    recordings : with references.
    controller : of the loop in which they were made.
    nominal : the model inside the controller; None for each mechanism's own.
    noise : of the encoders, which the loop follows; None for ideal sensors.
    feedback_scale, progress : see `ClosedLoop.simulate`.

    Returns
    -------
    One `Retraced` a recording, in their order.

    Raises
    ------
    SimulationError
        If a recording has no reference, its joints are not the robot's, or a loop cannot be
        simulated; see `ClosedLoop.simulate`.
    """
    if len(mechanisms) != len(recordings):
        what = f"{len(mechanisms)} mechanisms for {len(recordings)} recordings"
        raise SimulationError(what, remedy="give one for each recording")
    rate = controller.simulated_rate()
    tasks = []
    for index, (mechanism, recording) in enumerate(zip(mechanisms, recordings, strict=True)):
        if recording.joints != mechanism.robot.names:
            remedy = f"the robot's are {', '.join(mechanism.robot.names)}"
            raise SimulationError("the recording has other joints", recording.where, remedy)
        reference = SampledReference.of(recording)
        # One sample beyond the last time stamp, to interpolate to it.
        samples = int(np.ceil(recording.duration * rate - _ROUNDING)) + 2
        tasks.append(
            Task(
                mechanism.numbered(recording.number),
                reference,
                samples / rate,
                start=recording.start,
                rng=None if noise is None else np.random.default_rng((*noise.seed, index)),
                noise_sign=1.0 if noise is None else noise.sign,
                name=recording.name or recording.where,
                nominal=nominal,
            )
        )
    sensors = None if noise is None else Sensors(position_std=tuple(noise.std))
    try:
        rollouts = loop.simulate(
            tasks,
            controller,
            sensors,
            lead_in=0.0,
            feedback_scale=feedback_scale,
            progress=progress,
        )
    except SimulationError as error:
        if error.reason != "unstable":
            raise
        # The recorded loop did run: it is not its gains that are to be lowered.
        remedy = "are gains, rate_hz and delay_s those of the recorded loop?"
        raise SimulationError(error.what, error.where, remedy, reason=error.reason) from error
    return tuple(
        Retraced(_resampled(recording, rollout, rate), rollout, rollout.saturated)
        for recording, rollout in zip(recordings, rollouts, strict=True)
    )


def _resampled(recording: Recording, rollout: Rollout, rate: float) -> Recording:
    """Return a rollout at the time stamps of a recording."""
    from scipy.interpolate import CubicHermiteSpline

    x = (recording.t - recording.t[0]) * rate
    nearest = np.rint(x)
    # Where the clocks agree there is nothing to interpolate.
    x = np.where(np.abs(x - nearest) < _ROUNDING, nearest, x)
    changes = {}
    derivatives = [name for name in ("v", "a") if getattr(recording, name) is not None]
    if np.array_equal(x, nearest):
        rows = x.astype(int)
        q, held, torque = rollout.q_measured[rows], rollout.u[rows], rollout.torque[rows]
        changes = {name: getattr(rollout, name)[rows] for name in derivatives}
    else:
        q = CubicHermiteSpline(rollout.t, rollout.q, rollout.v)(x / rate)
        k = np.minimum(np.floor(x).astype(int), len(rollout.t) - 2)
        q = q + (rollout.q_measured - rollout.q)[k]
        share = (x - k)[:, None]
        if derivatives:
            # The acceleration jumps at samples: only the one just after belongs to the interval.
            bend = rollout.v[k + 1] - rollout.v[k] - rollout.a[k] / rate
            v = rollout.v[k] + rollout.a[k] * share / rate + bend * share**2
            both = {"v": v, "a": rollout.a[k] + 2.0 * bend * share * rate}
            changes = {name: both[name] for name in derivatives}
        torque = (1.0 - share) * rollout.torque[k] + share * rollout.torque[k + 1]
        held = rollout.u[k]
    tau = held if recording.torque == "held_command" else torque
    return recording.replace(q=q, tau=tau, **changes)
