"""What a stated control law says on its own: its torque, and how soon its loop settles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.closed_loop import Controller, Mechanism
from dynident.recording import Recording, central_difference
from dynident.robot import Robot

_TIME_CONSTANTS = 5.0
"""After which a loop has forgotten where it began (to 1 %)."""
_LEAST_DAMPING = 0.1
"""Damping ratio that a robot has by its friction alone."""
_POSES = 50


def settling_time(controller: Controller, mechanism: Mechanism, q: np.ndarray) -> float:
    """Time after which the slowest joint's loop has settled, s.

    Five time constants of the slowest pole of J s^2 + kd s + kp, J the joint's largest inertia
    over the motion (Janot et al., equations 45 to 47): 5 / w_n where the damping is critical.

    Parameters
    ----------
    controller, mechanism : of the loop.
    q : (T, n) a motion, rad or m.

    Returns
    -------
    s; infinite where a joint's position is not controlled.
    """
    feedback = controller.feedback()
    inertia = 1.0 if controller.law.through_model else largest_inertia(mechanism, q)
    stiffness, damping = feedback.position / inertia, feedback.speed / inertia
    with np.errstate(divide="ignore", invalid="ignore"):
        natural = np.sqrt(stiffness)
        ratio = np.maximum(damping / (2 * natural), _LEAST_DAMPING)
        slow = natural * np.where(ratio > 1, ratio - np.sqrt(np.maximum(ratio**2 - 1, 0)), ratio)
        times = np.where(stiffness > 0, _TIME_CONSTANTS / slow, np.inf)
    return float(np.max(times))


def largest_inertia(mechanism: Mechanism, q: np.ndarray) -> np.ndarray:
    """Largest diagonal of the joint-space inertia over poses (T, n): (n,) kg m^2 or kg."""
    poses = q[:: max(1, len(q) // _POSES)]
    still, found = np.zeros_like(poses), []
    rest = mechanism.robot.inverse_dynamics(poses, still, still)
    for j in range(poses.shape[1]):
        unit = still.copy()
        unit[:, j] = 1.0
        found.append((mechanism.robot.inverse_dynamics(poses, still, unit) - rest)[:, j].max())
    return np.array(found) + np.diag(mechanism.inertia)


def law_torque(recording: Recording, controller: Controller, nominal: Robot) -> np.ndarray:
    """Torque that a control law gives for the recorded positions and reference, (T, n).

    In the recording's convention (held command, or measured: the mean of the command before and
    after a sample). No model of the robot enters, but for the one inside the controller: where
    this is not the recorded torque, another law ran. The unknown start of an integral is taken
    out as a constant.

    Parameters
    ----------
    recording : T samples with a reference; the law runs at their rate.
    controller : the law.
    nominal : the robot inside a computed torque or a feed-forward.
    """
    from dynident.closed_loop.drive import Drive, ReferenceSamples

    assert recording.q_ref is not None
    t, rate, q_ref = recording.t, recording.rate_hz, recording.q_ref
    v_ref = central_difference(q_ref, rate)
    followed = ReferenceSamples(q_ref, v_ref, central_difference(v_ref, rate))
    drive = Drive(replace(controller, rate_hz=rate), followed, [nominal])
    command = np.array([drive.command(k, q) for k, q in enumerate(recording.q)])
    if controller.delay_s > 0:
        late = t - controller.delay_s
        command = np.column_stack([np.interp(late, t, column) for column in command.T])
    if recording.torque == "measured":
        command = np.concatenate([command[:1], (command[:-1] + command[1:]) / 2])
    if controller.ki:
        command = command + (recording.tau - command).mean(axis=0)
    return command
