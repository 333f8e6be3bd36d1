"""What a stated control law says on its own: its torque, and how soon its loop settles."""

from __future__ import annotations

import numpy as np

from dynident.closed_loop import Controller, Mechanism
from dynident.recording import Recording
from dynident.robot import Robot

_LEAST_DAMPING = 0.1
"""Damping ratio that a robot has by its friction alone."""
_POSES = 50
_RUN_UP = 10
"""Samples before the first."""
_ROUNDING = 1e-6
"""Of a sample: instants this near to the controller's are the controller's."""


def time_constant(controller: Controller, mechanism: Mechanism, q: np.ndarray) -> float:
    """Time constant of the slowest joint's loop, s.

    Of the slowest pole of J s^2 + kd s + kp, J the joint's largest inertia over the motion (Janot
    et al., equations 45 to 47): 1 / w_n where the damping is critical. An integral is left out:
    it is slower, and what it holds hardly changes the motion.

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
        times = np.where(stiffness > 0, 1.0 / slow, np.inf)
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
    recording : T samples with a reference.
    controller : the law.
    nominal : the robot inside a computed torque or a feed-forward.

    Returns
    -------
    (T, n) N m or N.
    """
    from scipy.interpolate import CubicSpline

    from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
    from dynident.closed_loop.references import SampledReference

    # On the controller's clock, which as a rule is the record's; followed as the simulator does.
    rate, t = controller.simulated_rate(), recording.t - recording.t[0]
    clock = np.arange(int(np.floor(t[-1] * rate + _ROUNDING)) + 1) / rate
    # The drive derives its speed from sample to sample: it is given some before the first.
    early = np.maximum(np.arange(-_RUN_UP, len(clock)), 0)
    references = [x[early] for x in SampledReference.of(recording).at(clock)]
    positions = CubicSpline(t, recording.q)(clock)
    slope = (positions[min(_RUN_UP, len(clock) - 1)] - positions[0]) / min(_RUN_UP, len(clock) - 1)
    before = positions[0] + np.arange(-_RUN_UP, 0)[:, None] * slope
    drive = Drive(controller, ReferenceSamples(*references), [nominal])
    followed = np.vstack([before, positions])
    command = np.array([drive.command(k, q) for k, q in enumerate(followed)])[_RUN_UP:]
    if recording.torque == "measured":
        # The command that acted, in the mean over a sample before and a sample after.
        impulse = np.concatenate([np.zeros((1, controller.n)), np.cumsum(command, axis=0)])
        late = (t - controller.delay_s) * rate
        ends = [_at(impulse, late + side) for side in (-1.0, 1.0)]
        torque = (ends[1] - ends[0]) / 2.0
    else:
        last = np.floor(t * rate + _ROUNDING).astype(int)
        torque = command[np.minimum(last, len(command) - 1)]
    if controller.ki:
        torque = torque + np.median(recording.tau - torque, axis=0)
    return torque


def _at(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return y (T, n) at x samples, in straight lines."""
    places = np.arange(len(y))
    return np.column_stack([np.interp(x, places, column) for column in y.T])
