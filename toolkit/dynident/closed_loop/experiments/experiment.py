"""Virtual measurements: a robot as it truly is, under control, measured with real sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import PurePosixPath
from typing import Literal

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.loop import simulate
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.rollout import LEAD_IN, Rollout, Task
from dynident.closed_loop.sensors import Sensors, delayed, rounded
from dynident.closed_loop.splines import Trajectory
from dynident.closed_loop.true_effects import TrueEffect
from dynident.effects import FRICTION_WIDTH
from dynident.effects.friction.thermal_friction import ThermalFriction
from dynident.errors import SimulationError
from dynident.recording import Recording
from dynident.robot import Robot

Progress = Callable[[str, float, float], None]
"""(what is being done, how much is done, how much there is to do)."""

_SUFFIXES = (".csv", ".npz", ".mat", ".parquet")


@dataclass(frozen=True, eq=False, kw_only=True)
class ExperimentRun:
    """One recording to be made.

    Attributes
    ----------
    trajectory : Trajectory
    duration : s.
    file : name of the recording, in the folder of the study; its suffix is its format.
    use : "train" or "test".
    start : s, when it begins in the session.
    payload : whether the payload is on board.
    """

    trajectory: Trajectory
    duration: float
    file: str = "run.csv"
    use: Literal["train", "test"] = "train"
    start: float = 0.0
    payload: bool = False

    def __post_init__(self) -> None:
        path = PurePosixPath(self.file)
        is_name = len(path.parts) == 1 and not {"\\", "\0"} & set(self.file)
        if not is_name or path.suffix.lower() not in _SUFFIXES:
            remedy = f"give a name without folder that ends in {', '.join(_SUFFIXES)}"
            raise SimulationError(f"'{self.file}' cannot be the file of a recording", remedy=remedy)
        if self.use not in ("train", "test"):
            raise SimulationError(f'use = "{self.use}"', self.file, 'write "train" or "test"')
        if not np.isfinite(self.start):
            raise SimulationError(f"start = {self.start}", self.file, "give a time in s")


@dataclass(frozen=True, eq=False, kw_only=True)
class Experiment:
    """A robot as it truly is, and the recordings to be made of it.

    Attributes
    ----------
    robot : with its true inertias.
    controller : Controller
    runs : the recordings.
    effects : that the robot has; `TrueEffect.of` makes them from a label.
    sensors : ideal by default.
    seed : of all noise. Each recording has streams of its own: adding one changes no other's
        noise (its motion changes within the integrator's accuracy).
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`.
    nominal : the robot that the user of the recordings is given; None for the true one.
    torque : "held_command": the command, held from its sample to the next. "measured": its mean
        over the sample before and the one after, as a sensor of limited bandwidth has it.
    lead_in : s, simulated before each recording, for its transient to decay.
    """

    robot: Robot
    controller: Controller
    runs: tuple[ExperimentRun, ...]
    effects: tuple[TrueEffect, ...] = ()
    sensors: Sensors = field(default_factory=Sensors)
    seed: int = 0
    friction_width: float = FRICTION_WIDTH
    nominal: Robot | None = None
    torque: Literal["held_command", "measured"] = "held_command"
    lead_in: float = LEAD_IN

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", tuple(self.runs))
        object.__setattr__(self, "effects", tuple(self.effects))
        if not self.runs:
            raise SimulationError("no recordings are asked for", remedy="ask for at least one")
        files = [run.file for run in self.runs]
        for file in files:
            if files.count(file) > 1:
                raise SimulationError("two recordings have this name", file, "rename one of them")
        if self.torque not in ("held_command", "measured"):
            remedy = 'write "held_command" or "measured"'
            raise SimulationError(f'torque = "{self.torque}"', remedy=remedy)
        if not (self.friction_width > 0 and np.isfinite(self.friction_width)):
            remedy = "choose it above 0"
            raise SimulationError(f"friction_width = {self.friction_width}", remedy=remedy)
        if self.nominal is not None and self.nominal.names != self.robot.names:
            remedy = f"the true robot has {', '.join(self.robot.names)}"
            raise SimulationError("the nominal robot has other joints", self.nominal.name, remedy)
        for part in fields(self.sensors):
            self.sensors.each(part.name, self.robot.n)
        self.controller.simulated_rate()
        # Effects that do not fit the robot are refused here, before anything is simulated.
        checked = [replace(one, effect=one.effect.on(self.robot)) for one in self.effects]
        object.__setattr__(self, "effects", tuple(checked))
        self.mechanism(carries_payload=True)

    def mechanism(self, *, carries_payload: bool = False) -> Mechanism:
        """Return the robot with its effects, with or without the payload on board."""
        return Mechanism.of(
            self.robot, self.effects, self.friction_width, carries_payload=carries_payload
        )

    @property
    def known_effects(self) -> tuple[TrueEffect, ...]:
        """The effects that are in the study of the recordings."""
        return tuple(one for one in self.effects if not one.hidden)

    @property
    def states_payload(self) -> bool:
        """Whether the recordings say which of them carry the payload."""
        return any(one.effect.is_payload for one in self.known_effects)

    def rollouts(self, progress: Progress | None = None) -> tuple[Rollout, ...]:
        """Simulate the runs: true motions, measured positions, commands without noise.

        Raises
        ------
        SimulationError
            See `ClosedLoop.simulate`.
        """
        bodies = {
            carries: self.mechanism(carries_payload=carries)
            for carries in {run.payload for run in self.runs}
        }
        tasks = [
            Task(
                bodies[run.payload].numbered(index + 1),
                run.trajectory,
                run.duration,
                start=run.start,
                rng=self._stream(index, 0),
                name=run.file,
                nominal=self.nominal or self.robot,
            )
            for index, run in enumerate(self.runs)
        ]
        names = tasks[0].name + (f" to {tasks[-1].name}" if len(tasks) > 1 else "")

        def advance(done: float, whole: float) -> None:
            if progress is not None:
                progress(names, done, whole)

        return simulate(
            tasks, self.controller, self.sensors, lead_in=self.lead_in, progress=advance
        )

    def run(self, progress: Progress | None = None) -> tuple[Recording, ...]:
        """Simulate the runs and record them.

        Parameters
        ----------
        progress : called now and then, see `Progress`.

        Returns
        -------
        One `Recording` a run, with measured positions, torque and reference. They carry no trace
        of what is hidden.

        Raises
        ------
        SimulationError
            If the loop diverges or a setting does not fit.
        """
        rollouts = self.rollouts(progress)
        return tuple(
            self._record(index, run, rollout)
            for index, (run, rollout) in enumerate(zip(self.runs, rollouts, strict=True))
        )

    def _record(self, index: int, run: ExperimentRun, rollout: Rollout) -> Recording:
        n = self.robot.n
        tau = rollout.torque if self.torque == "measured" else rollout.u
        tau = delayed(tau, rollout.t, rollout.mechanism.delay, run.trajectory.period)
        noise = self._stream(index, 1).standard_normal(tau.shape)
        tau = tau + self.sensors.each("torque_std", n) * noise
        return Recording(
            t=rollout.t,
            q=rollout.q_measured,
            tau=rounded(tau, self.sensors.each("torque_resolution", n)),
            joints=self.robot.names,
            continuous=self.robot.continuous,
            temperature=self._temperature(index, rollout),
            # The reference is known in steps of the encoder too.
            q_ref=rounded(rollout.q_ref, self.sensors.each("position_resolution", n)),
            period=run.trajectory.period,
            start=run.start,
            use=run.use,
            payload=run.payload if self.states_payload else None,
            torque=self.torque,
            name=run.file,
            number=index + 1,
        )

    def _temperature(self, index: int, rollout: Rollout) -> np.ndarray | None:
        """Recorded temperatures, (T, n) C: of thermal friction's own law, at every joint."""
        if self.sensors.temperature_std is None:
            return None
        t, names = rollout.t + rollout.start, self.robot.names
        laws = {joint: ThermalFriction(joint).on(self.robot) for joint in names}
        laws |= {
            str(one.effect.joint): one.effect
            for one in self.effects
            if isinstance(one.effect, ThermalFriction)
        }
        true = np.column_stack([laws[joint].temperature(t) for joint in names])
        noise = self._stream(index, 2).standard_normal(true.shape)
        return true + self.sensors.each("temperature_std", len(names)) * noise

    def _stream(self, index: int, purpose: int) -> np.random.Generator:
        """Return the noise of one recording and one sensor, independent of all others."""
        seeds: Sequence[int] = (self.seed, index, purpose)
        return np.random.default_rng(seeds)
