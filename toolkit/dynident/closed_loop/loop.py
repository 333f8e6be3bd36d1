"""`ClosedLoop`: a simulator that keeps its diagrams, for robots whose parameters change.

The plant is a `MultibodyPlant`; effects are Drake systems beside it, in C++ where they can be. All
motions run side by side, as robots that do not feel each other in one plant: what Python and Drake
spend on a step is then spent once for all of them. Drake's error-controlled Runge-Kutta 3(2)
integrates from sample to sample, so that no step crosses a change of the command. Stepping the
simulator sample by sample is as fast as a hold and a logger inside the diagram, and cannot log a
held value one sample late.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.plant.side_by_side import structure
from dynident.closed_loop.rollout import LEAD_IN, Rollout, Task
from dynident.closed_loop.sensors import Sensors, rounded
from dynident.errors import SimulationError

if TYPE_CHECKING:
    from dynident.closed_loop.plant.diagram import Plant
    from dynident.closed_loop.plant.stepping import SteppedMotion

ACCURACY = 1e-3
"""Drake's error per step.

Against 1e-9, on a two-link arm at 1 kHz with Coulomb friction of width 0.01 rad/s and Stribeck
friction, 1e-3 leaves at worst (at reversals) 9e-7 rad, 5e-4 rad/s and 4e-4 of the command, and 7e-6
of the command in the mean: far below what encoders show. At 200 Hz, on a seven-joint arm whose
wrists are nothing but friction, it leaves 8e-6 rad, 3e-3 rad/s and 0.7 % of the command in the mean
at the worst joint. 1e-4 costs a quarter to a half more and leaves a tenth to a sixth.
"""
SIDE_BY_SIDE = 8
"""Motions simulated in one plant; beyond that their reversals shorten each other's steps."""
_POSES = 50
_KEPT = 4
"""Diagrams kept; a fit that goes back and forth between structures needs few."""
LARGEST = 1e6
"""Largest position (rad, m), speed and acceleration of a reference."""

Progress = Callable[[float, float], None]
"""(seconds done, seconds to do)."""


class ClosedLoop:
    """Simulates closed loops; nothing is built before the first simulation.

    Diagrams are built once for a structure (the robots' joints, the number of motions, the kinds
    of effects) and then only given other parameters through their Context.

    Parameters
    ----------
    accuracy : of the integrator, see `ACCURACY`.
    """

    def __init__(self, *, accuracy: float = ACCURACY) -> None:
        if not (0 < accuracy < 1):
            raise SimulationError(f"accuracy = {accuracy:g}", remedy="choose it between 0 and 1")
        self._accuracy = accuracy
        self._plants: dict[Hashable, Plant] = {}
        self._notes: dict[str, None] = {}
        self._builds = 0

    @property
    def builds(self) -> int:
        """Diagrams built so far."""
        return self._builds

    @property
    def notes(self) -> tuple[str, ...]:
        """What made the simulations so far slower than they need be."""
        return tuple(self._notes)

    def simulate(
        self,
        tasks: Sequence[Task],
        controller: Controller,
        sensors: Sensors | None = None,
        *,
        lead_in: float = LEAD_IN,
        feedback_scale: np.ndarray | None = None,
        progress: Progress | None = None,
    ) -> tuple[Rollout, ...]:
        """Simulate loops that follow their references, side by side, at most 8 in one plant.

        Each motion starts on its reference (an integral with the torque that it needs there),
        `lead_in` before the first sample that is kept, so that what is kept of a periodic
        reference is the steady state.

        Parameters
        ----------
        tasks : the motions, of robots with the same number of joints.
        controller : of every one of them.
        sensors : of position; ideal by default.
        lead_in : s, simulated and thrown away.
        feedback_scale : (n,) factor of the feedback (all gains, not the feed-forward); 1 if None.
        progress : called now and then, see `Progress`.

        Returns
        -------
        One `Rollout` a task, in their order.

        Raises
        ------
        SimulationError
            If a setting does not fit, a joint-space inertia is not positive, or a loop diverges:
            the message says when, in which motion, and which joint; `reason` says it in a word.
        """
        if not tasks:
            return ()
        sensors = sensors or Sensors()
        for task in tasks:
            task.require_fit(controller.n, tasks[0].mechanism.robot.n)
        scale = _scale(feedback_scale, controller.n)
        rate = controller.simulated_rate()
        before = _samples(lead_in, rate, "lead_in", 0)
        kept = [_samples(task.duration, rate, "duration", 2) for task in tasks]
        starts = range(0, len(tasks), SIDE_BY_SIDE)
        groups = [slice(k, k + SIDE_BY_SIDE) for k in starts]
        lengths = [(before + max(kept[group])) / rate for group in groups]
        found: list[Rollout] = []
        for number, group in enumerate(groups):
            past = sum(lengths[:number])

            def advance(done: float, past: float = past) -> None:
                if progress is not None:
                    progress(past + done, sum(lengths))

            # Robots on their way to infinity are noticed by where they are, not by NumPy.
            with np.errstate(all="ignore"):
                found += self._simulate(
                    tasks[group], kept[group], before, controller, sensors, scale, advance
                )
        return tuple(found)

    def _simulate(
        self,
        tasks: Sequence[Task],
        kept: Sequence[int],
        before: int,
        controller: Controller,
        sensors: Sensors,
        scale: np.ndarray,
        advance: Callable[[float], None],
    ) -> list[Rollout]:
        from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
        from dynident.closed_loop.plant.stepping import JointLoop, Measurement, Stepper

        n, rate = controller.n, controller.simulated_rate()
        total = before + max(kept)
        # The last command is held to one sample more.
        time = (np.arange(total + 1) - before) / rate
        references = [_reference(task, time[:-1]) for task in tasks]
        reference = ReferenceSamples(*(np.hstack(one) for one in zip(*references, strict=True)))
        noise = np.hstack(
            [
                sensors.each("position_std", n) * task.noise_sign * _normal(task.rng, (total, n))
                for task in tasks
            ]
        )
        resolution = sensors.each("position_resolution", n)
        plant = self._plant(tasks)
        plant.require_inertia(reference.q[:: max(1, total // _POSES)])
        joints = [
            JointLoop(task.name, name, unit)
            for task in tasks
            for name, unit in zip(
                task.mechanism.robot.names, task.mechanism.robot.units, strict=True
            )
        ]
        nominal = [task.nominal or task.mechanism.robot for task in tasks]
        steady = _needed(tasks, references, time[:1]) if controller.ki else None
        drive = Drive(controller, reference, nominal, scale, steady)
        stepper = Stepper(plant, joints, rate, controller.delay_s, self._accuracy)
        measurement = Measurement(noise, np.tile(resolution, len(tasks)))
        motion = stepper.run(time, reference, drive, measurement, advance)
        return [
            _rollout(motion, reference, slice(before, before + length), k, tasks, rate, resolution)
            for k, length in enumerate(kept)
        ]

    def _plant(self, tasks: Sequence[Task]) -> Plant:
        """Return the diagram of some tasks, with their parameters."""
        # Drake is loaded when something is simulated.
        from dynident.closed_loop.plant.diagram import Plant

        mechanisms = [task.mechanism for task in tasks]
        key = structure(mechanisms)
        plant = self._plants.pop(key, None)
        if plant is None:
            plant = Plant(mechanisms)
            self._builds += 1
        while len(self._plants) >= _KEPT:
            del self._plants[next(iter(self._plants))]
        self._plants[key] = plant
        plant.set(mechanisms, [task.start for task in tasks])
        self._notes |= dict.fromkeys(plant.notes())
        return plant


def simulate(
    tasks: Sequence[Task],
    controller: Controller,
    sensors: Sensors | None = None,
    *,
    lead_in: float = LEAD_IN,
    accuracy: float = ACCURACY,
    progress: Progress | None = None,
) -> tuple[Rollout, ...]:
    """Simulate loops that follow their references, on a fresh `ClosedLoop`.

    Parameters
    ----------
    tasks : the motions, of robots with the same number of joints.
    controller : of every one of them.
    sensors : of position; ideal by default.
    lead_in : s, simulated and thrown away.
    accuracy : of the integrator, see `ACCURACY`.
    progress : called now and then, see `Progress`.

    Returns
    -------
    One `Rollout` a task, in their order.

    Raises
    ------
    SimulationError
        See `ClosedLoop.simulate`.
    """
    loop = ClosedLoop(accuracy=accuracy)
    return loop.simulate(tasks, controller, sensors, lead_in=lead_in, progress=progress)


def _rollout(
    motion: SteppedMotion,
    reference,
    rows: slice,
    k: int,
    tasks: Sequence[Task],
    rate: float,
    resolution: np.ndarray,
) -> Rollout:
    task = tasks[k]
    n = task.mechanism.robot.n
    first_state = sum(one.mechanism.memory for one in tasks[:k])
    memory = slice(first_state, first_state + task.mechanism.memory)
    columns = slice(k * n, k * n + n)
    own = (rows, columns)
    first = rows.start
    mean = motion.mean[max(first - 1, 0) : rows.stop, columns]
    if not first:
        mean = np.vstack([mean[:1], mean])
    return Rollout(
        t=np.arange(rows.stop - first) / rate,
        q=motion.q[own],
        v=motion.v[own],
        q_measured=rounded(motion.measured[own], resolution),
        q_ref=reference.q[own],
        v_ref=reference.v[own],
        u=motion.u[own],
        u_before=motion.u[max(first - 1, 0), columns],
        torque=(mean[:-1] + mean[1:]) / 2,
        acting=motion.acting[own],
        saturated=motion.saturated[own].mean(axis=0),
        start=task.start,
        mechanism=task.mechanism,
        past=None if motion.past is None else motion.past.of(rows, columns, memory),
    )


def _scale(given: np.ndarray | None, n: int) -> np.ndarray:
    scale = np.ones(n) if given is None else np.asarray(given, dtype=float)
    if scale.shape != (n,) or not (np.isfinite(scale).all() and (scale >= 0).all()):
        remedy = f"give {n} finite numbers of 0 or above"
        raise SimulationError(f"feedback_scale = {scale.tolist()}", remedy=remedy)
    return scale


def _reference(task: Task, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    found = task.trajectory.at(time)
    for name, x in zip(("position", "velocity", "acceleration"), found, strict=True):
        if not (np.abs(x) < LARGEST).all():  # false of NaN too
            what = f"its {name} is not finite, or beyond {LARGEST:g}"
            raise SimulationError(what, task.name or "reference", reason="reference")
    return found


def _needed(
    tasks: Sequence[Task], references: Sequence[tuple[np.ndarray, ...]], time: np.ndarray
) -> np.ndarray:
    """Return the torques that the references need at their first sample, (K n,)."""
    starts = (
        (task, *(x[:1] for x in found)) for task, found in zip(tasks, references, strict=True)
    )
    return np.concatenate(
        [task.mechanism.stiff_command(time + task.start, q, v, a)[0] for task, q, v, a in starts]
    )


def _samples(seconds: float, rate: float, name: str, least: int) -> int:
    if not (np.isfinite(seconds) and round(seconds * rate) >= least):
        remedy = f"choose {least / rate:g} s or more"
        raise SimulationError(f"{name} = {seconds:g} s at {rate:g} Hz", remedy=remedy)
    return round(seconds * rate)


def _normal(rng: np.random.Generator | None, shape: tuple[int, int]) -> np.ndarray:
    return np.zeros(shape) if rng is None else rng.standard_normal(shape)
