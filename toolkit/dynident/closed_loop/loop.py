"""`ClosedLoop`: a simulator that keeps what it builds, for robots whose parameters change.

Where the accelerations are formulas and it pays, each motion is made by a C function of the whole
loop (`dynident.closed_loop.compiled`), many in as many threads as there are processors. All else is
simulated by Drake, which is the reference for the former.

There the plant is a `MultibodyPlant`; effects are Drake systems beside it, in C++ where they can
be. All motions run side by side, as robots that do not feel each other in one plant: what Python
and Drake spend on a step is then spent once for all of them. Drake's error-controlled Runge-Kutta
3(2) integrates from sample to sample, so that no step crosses a change of the command. Stepping the
simulator sample by sample is as fast as a hold and a logger inside the diagram, and cannot log a
held value one sample late.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from dynident.closed_loop.compiled.many_rollouts import CompiledLoops
from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.motion_plan import Plan, PlanSettings, Stacked
from dynident.closed_loop.plant.side_by_side import structure
from dynident.closed_loop.rollout import LEAD_IN, Rollout, Task
from dynident.closed_loop.sensors import Sensors
from dynident.closed_loop.stepped_motion import JointLoop
from dynident.errors import SimulationError

if TYPE_CHECKING:
    from dynident.closed_loop.plant.diagram import Plant

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
MOST_SAMPLES = 1e7
"""Samples of one motion: nearly three hours at 1 kHz."""
_KEPT = 4
"""Diagrams kept; a fit that goes back and forth between structures needs few."""

Integrator = Literal["auto", "drake"]
Progress = Callable[[float, float], None]
"""(seconds done, seconds to do)."""


class ClosedLoop:
    """Simulates closed loops; nothing is built before the first simulation.

    Diagrams and C functions are built once for a structure (the robots' joints, the number of
    motions, the kinds of effects) and then only given other parameters.

    Parameters
    ----------
    accuracy : of the integrator, see `ACCURACY`.
    integrator : "auto": compiled where the motion's accelerations are formulas and the samples pay
        for compiling, as the environment variable DYNIDENT_COMPILE allows; motions that the
        compiled loop cannot make go to Drake. Which of the two it is changes a motion by as much
        as their errors. "drake": always Drake, the reference.
    repeats : about as many simulations like each one are to come: more make compiling pay.

    Raises
    ------
    SimulationError
        If there is no such integrator, or the accuracy is not between 0 and 1.
    """

    def __init__(
        self, *, accuracy: float = ACCURACY, integrator: Integrator = "auto", repeats: int = 1
    ) -> None:
        if not (0 < accuracy < 1):
            raise SimulationError(f"accuracy = {accuracy:g}", remedy="choose it between 0 and 1")
        if integrator not in get_args(Integrator):
            remedy = f"integrators: {', '.join(get_args(Integrator))}"
            raise SimulationError(f"no integrator '{integrator}'", remedy=remedy)
        self._accuracy, self._integrator = accuracy, integrator
        self._plants: dict[Hashable, Plant] = {}
        self._compiled = CompiledLoops(repeats)
        self._notes: dict[str, None] = {}
        self._builds = 0

    @property
    def builds(self) -> int:
        """Diagrams and compiled loops in use so far."""
        return self._builds + self._compiled.builds

    @property
    def notes(self) -> tuple[str, ...]:
        """What made the simulations so far slower than they need be."""
        return (*self._notes, *self._compiled.notes)

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
        """Simulate loops that follow their references, as many at once as are given.

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
        rate = controller.simulated_rate()
        run = PlanSettings(
            controller=controller,
            position_std=sensors.each("position_std", controller.n),
            resolution=sensors.each("position_resolution", controller.n),
            scale=_scale(feedback_scale, controller.n),
            before=_samples(lead_in, rate, "lead_in", 0),
            accuracy=self._accuracy,
        )
        plans = [Plan(task, _samples(task.duration, rate, "duration", 2), run) for task in tasks]
        whole = sum(max(one.samples for one in group) for group in _groups(plans)) / rate
        found: dict[Plan, Rollout] = {}

        def advance(share: float) -> None:
            if progress is not None:
                progress(share * whole, whole)

        # Robots on their way to infinity are noticed by where they are, not by NumPy.
        with np.errstate(all="ignore"):
            if self._integrator == "auto":
                found |= self._compiled.rollouts(plans, advance)
            left = [one for one in plans if one not in found]
            for group in _groups(left):
                begun, own = len(found) / len(plans), len(group) / len(plans)
                rollouts = self._by_drake(group, lambda x, a=begun, b=own: advance(a + b * x))
                found |= zip(group, rollouts, strict=True)
        return tuple(found[one] for one in plans)

    def _by_drake(self, plans: Sequence[Plan], advance: Callable[[float], None]) -> list[Rollout]:
        """Return the rollouts of motions side by side; `advance` takes the share that is done."""
        from dynident.closed_loop.plant.stepping import Stepper

        run, tasks = plans[0].run, [one.task for one in plans]
        stacked = Stacked.of(plans)
        time = run.time(max(one.kept for one in plans))
        total = len(time) - 1
        plant = self._plant(tasks)
        plant.require_inertia(stacked.reference.q[:: max(1, total // _POSES)])
        joints = [
            JointLoop(task.name, name, unit)
            for task in tasks
            for name, unit in zip(
                task.mechanism.robot.names, task.mechanism.robot.units, strict=True
            )
        ]
        stepper = Stepper(plant, joints, run.rate, run.controller.delay_s, run.accuracy)
        motion = stepper.run(
            time,
            stacked.reference,
            stacked.drive,
            stacked.measurement,
            lambda seconds: advance(seconds * run.rate / total),
        )
        return [
            one.rollout(motion.of_memory(_memory(tasks, k)), stacked.reference, k)
            for k, one in enumerate(plans)
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


def _groups(plans: Sequence[Plan]) -> list[Sequence[Plan]]:
    return [plans[k : k + SIDE_BY_SIDE] for k in range(0, len(plans), SIDE_BY_SIDE)]


def _memory(tasks: Sequence[Task], k: int) -> slice:
    """Columns of one task's internal states."""
    first = sum(one.mechanism.memory for one in tasks[:k])
    return slice(first, first + tasks[k].mechanism.memory)


def _scale(given: np.ndarray | None, n: int) -> np.ndarray:
    scale = np.ones(n) if given is None else np.asarray(given, dtype=float)
    if scale.shape != (n,) or not (np.isfinite(scale).all() and (scale >= 0).all()):
        remedy = f"give {n} finite numbers of 0 or above"
        raise SimulationError(f"feedback_scale = {scale.tolist()}", remedy=remedy)
    return scale


def _samples(seconds: float, rate: float, name: str, least: int) -> int:
    if not (np.isfinite(seconds) and round(seconds * rate) >= least):
        remedy = f"choose {least / rate:g} s or more"
        raise SimulationError(f"{name} = {seconds:g} s at {rate:g} Hz", remedy=remedy)
    if seconds * rate > MOST_SAMPLES:
        what = f"{name} = {seconds:g} s at {rate:g} Hz are more than {MOST_SAMPLES:.0e} samples"
        raise SimulationError(what, remedy="simulate a shorter time, or at a lower rate")
    return round(seconds * rate)
