"""Recordings in the unit of the drives as recordings in N m, without the loads that have names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.recording import (
    Dataset,
    Filter,
    MotionInParts,
    Noise,
    Recording,
    default_filter,
    uniform,
)
from dynident.robot import Robot


def in_newton_metres(dataset: Dataset, drives: DriveGains, robot: Robot) -> Dataset:
    """Return a dataset whose torques are those of the robot alone, in N m and N.

    Each torque is multiplied by its joint's gain, and what the recording's load takes is taken off.
    Relative errors of a joint do not depend on its gain.

    Parameters
    ----------
    dataset : in the unit of the drives.
    drives : what they were found to be.
    robot : that carries the loads.
    """
    acting = {load.load.name: load.acting for load in drives.loads}

    def converted(recording: Recording) -> Recording:
        tau, done = recording.tau * drives.gains, []
        if drives.unit != "N m":
            done.append(drives.words)
        if recording.load:
            recording = uniform(recording)
            tau = recording.tau * drives.gains
            tau = tau - _load_torque(recording, dataset.filter, acting[recording.load], robot)
            done.append(f"less the torque of the load '{recording.load}'")
        source = recording.provenance
        history = ", ".join(filter(None, (source.filter, *done)))
        return recording.replace(tau=tau, load="", provenance=replace(source, filter=history))

    noise = dataset.noise
    if noise is not None:
        noise = Noise(noise.position_std, noise.torque_std * np.abs(drives.gains))
    return Dataset(tuple(map(converted, dataset.recordings)), dataset.filter, noise)


def _load_torque(
    recording: Recording, settings: Filter | None, phi: np.ndarray, robot: Robot
) -> np.ndarray:
    """Torque of a body on the last joint at every sample, (T, n) N m or N."""
    settings = settings or default_filter(recording.rate_hz)
    every = replace(settings, ends="keep", edge_s=(0.0, 0.0))
    motion = MotionInParts(recording, every).whole
    theta = np.zeros(10 * robot.n)
    theta[10 * robot.tip : 10 * robot.tip + 10] = phi
    torque = robot.with_theta(theta).inverse_dynamics(motion.q, motion.v, motion.a)
    if recording.torque == "held_command":
        # A command acts from its sample to the next: so must what is taken off it.
        torque = np.concatenate([(torque[:-1] + torque[1:]) / 2, torque[-1:]])
    return torque
