"""The closed loop in Drake: continuous plants under sampled controllers.

The plant is a `MultibodyPlant`; a small system beside it takes off the force of the effects. All
motions of an experiment run side by side, as robots that do not feel each other in one plant: what
Python and Drake spend on a step is then spent once for all of them. Drake's error-controlled
Runge-Kutta 3(2) integrates from sample to sample, so that no step crosses a change of the command.
Stepping the simulator sample by sample is as fast as a hold and a logger inside the diagram, and
cannot log a held value one sample late.

`ACCURACY` is Drake's error per step. Against 1e-9, on a two-link arm at 1 kHz with Coulomb friction
of width 0.01 rad/s and Stribeck friction, 1e-3 leaves at worst (at reversals) 9e-7 rad, 5e-4 rad/s
and 4e-4 of the command, and 7e-6 of the command in the mean: far below what encoders show. 1e-4
costs half as much again and leaves a tenth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.loop import Loop
from dynident.closed_loop.rollout import LEAD_IN, Rollout, Task
from dynident.closed_loop.sensors import Sensors, rounded
from dynident.errors import SimulationError

ACCURACY = 1e-3
_POSES = 50


def simulate(
    tasks: Sequence[Task],
    controller: Controller,
    sensors: Sensors | None = None,
    *,
    lead_in: float = LEAD_IN,
    accuracy: float = ACCURACY,
    progress: Callable[[float, float], None] | None = None,
) -> tuple[Rollout, ...]:
    """Simulate loops that follow their trajectories, side by side.

    Each motion starts on its reference, `lead_in` before the first sample that is kept, so that
    what is kept is the periodic steady state.

    Parameters
    ----------
    tasks : the motions, of robots with the same number of joints.
    controller : of every one of them.
    sensors : of position; ideal by default.
    lead_in : s, simulated and thrown away.
    accuracy : of the integrator, see above.
    progress : called now and then with the seconds done and the seconds to do.

    Raises
    ------
    SimulationError
        If a setting does not fit, a joint-space inertia is not positive, or a loop diverges: the
        message says when, in which motion, and which joint.
    """
    if not tasks:
        return ()
    sensors = sensors or Sensors()
    n = tasks[0].mechanism.robot.n
    for task in tasks:
        _check(task, n, controller)
    rate = controller.simulated_rate()
    before = _samples(lead_in, rate, "lead_in", 0)
    kept = [_samples(task.duration, rate, "duration", 2) for task in tasks]
    total = before + max(kept)
    # One sample more at each end: the controller remembers one, and the last is held to the next.
    time = (np.arange(-1, total + 1) - before) / rate
    references = [task.trajectory.at(time) for task in tasks]
    q_ref, v_ref = (np.hstack([one[i] for one in references]) for i in (0, 1))
    noise = np.hstack(
        [sensors.each("position_std", n) * _normal(task.rng, (total, n)) for task in tasks]
    )
    resolution = np.tile(sensors.each("position_resolution", n), len(tasks))
    loop = Loop(tasks, controller, accuracy)
    loop.check_inertia(q_ref[:: max(1, total // _POSES)])
    q, v, measured, u = loop.run(time[1:], q_ref[:-1], v_ref[:-1], noise, resolution, progress)

    found = []
    for k, length in enumerate(kept):
        own = (slice(before, before + length), slice(k * n, k * n + n))
        found.append(
            Rollout(
                t=np.arange(length) / rate,
                q=q[own],
                v=v[own],
                q_measured=rounded(measured[own], resolution[:n]),
                q_ref=q_ref[1:][own],
                v_ref=v_ref[1:][own],
                u=u[own],
                u_before=u[before - 1, own[1]] if before else np.zeros(n),
            )
        )
    return tuple(found)


def _check(task: Task, n: int, controller: Controller) -> None:
    robot = task.mechanism.robot
    for what, count in (("robot", robot.n), ("trajectory", task.trajectory.n)):
        if count != controller.n or count != n:
            what = f"a {what} of {count} joints under a controller of {controller.n}"
            raise SimulationError(what, task.name or None, "give each as many joints as the robot")
    if not np.isfinite(robot.theta).all():
        mend = "mend the inertial elements of its description"
        raise SimulationError("has inertial values that are not finite", robot.name, mend)


def _samples(seconds: float, rate: float, name: str, least: int) -> int:
    if not (np.isfinite(seconds) and round(seconds * rate) >= least):
        mend = f"choose {least / rate:g} s or more"
        raise SimulationError(f"{name} = {seconds:g} s at {rate:g} Hz", mend=mend)
    return round(seconds * rate)


def _normal(rng: np.random.Generator | None, shape: tuple[int, int]) -> np.ndarray:
    return np.zeros(shape) if rng is None else rng.standard_normal(shape)
