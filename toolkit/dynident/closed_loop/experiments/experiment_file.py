"""`experiment.toml`: an experiment as a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dynident.closed_loop.controllers import ControllerFile
from dynident.closed_loop.experiments.experiment import Experiment, ExperimentRun
from dynident.closed_loop.rollout import LEAD_IN
from dynident.closed_loop.sensors import Sensors
from dynident.closed_loop.trajectories import MOST_HARMONICS, Fourier
from dynident.closed_loop.true_effects import TrueEffect
from dynident.effect_modules import Permission, import_effects, require_sound
from dynident.effects import FRICTION_WIDTH, LawsEntry, laws_of
from dynident.errors import DynidentError, SimulationError, StudyError
from dynident.robot import Robot
from dynident.settings import Duration, Gravity, SettingsTable, Time, read_toml


class _EffectEntry(SettingsTable):
    effect: str
    values: dict[str, float] = Field(default_factory=dict)
    shape: dict[str, float] = Field(default_factory=dict)
    hidden: bool = False


class _SensorsEntry(SettingsTable):
    position_std: float | list[float] = 0.0
    position_resolution: float | list[float] = 0.0
    torque_std: float | list[float] = 0.0
    torque_resolution: float | list[float] = 0.0
    temperature_std: float | list[float] | None = None


class _TrajectoryEntry(SettingsTable):
    harmonics: int = Field(default=5, ge=1, le=MOST_HARMONICS)
    seed: int | None = Field(default=None, ge=0)
    amplitude: float | list[float] | None = None
    speed: float | list[float] | None = None
    acceleration: float | list[float] | None = None
    centre: float | list[float] | None = None
    sine: list[list[float]] | None = None
    cosine: list[list[float]] | None = None

    def trajectory(self, robot: Robot, period: float, seed: object) -> Fourier:
        """Return the series that is stated, or a random one."""
        settings = self.model_dump(exclude={"seed", "sine", "cosine"})
        if self.sine is None and self.cosine is None:
            return Fourier.random(robot, period, seed, **settings)  # type: ignore[arg-type]
        if self.sine is None or self.cosine is None or not isinstance(self.centre, list):
            remedy = "state centre, sine and cosine, or none of them"
            raise SimulationError("half of a series", "trajectory", remedy)
        rows = {len(row) for row in (*self.sine, *self.cosine)}
        if len(rows) != 1 or not len(self.sine) == len(self.cosine) == len(self.centre) == robot.n:
            remedy = f"give {robot.n} rows of as many amplitudes"
            raise SimulationError("its series do not fit the robot", "trajectory", remedy)
        arrays = (np.array(one) for one in (self.centre, self.sine, self.cosine))
        return Fourier(period, *arrays)


class _ExperimentRecordingEntry(SettingsTable):
    file: str
    use: Literal["train", "test"] = "train"
    duration: Duration
    period: Duration
    start: Time = 0.0
    payload: bool = False
    trajectory: _TrajectoryEntry = _TrajectoryEntry()


class _ExperimentFile(SettingsTable):
    robot: str
    nominal: str | None = None
    joints: list[str] | None = None
    gravity: tuple[Gravity, Gravity, Gravity] | None = None
    seed: int = Field(default=0, ge=0)
    friction_width: float = Field(default=FRICTION_WIDTH, ge=1e-9, le=1e3)
    torque: Literal["held_command", "measured"] = "held_command"
    lead_in: Annotated[Time, Field(ge=0)] = LEAD_IN
    effect_modules: list[str] = Field(default_factory=list)
    effects: list[_EffectEntry] = Field(default_factory=list)
    laws: LawsEntry = Field(default_factory=dict)
    controller: ControllerFile
    sensors: _SensorsEntry = _SensorsEntry()
    recordings: list[_ExperimentRecordingEntry]


def load_experiment(path: str | Path, *, modules: Permission = "trusted") -> Experiment:
    """Read an experiment file and the robots that it names.

    Keys: `robot` (the true one; paths are relative to the file), `nominal` (given to the user;
    default the true one), `joints`, `effect_modules` (as in a study), `gravity`, `seed`,
    `friction_width`, `torque`, `lead_in`;
    [[effects]] `effect`, `values`, `shape`, `hidden`; [laws] and [controller] as in a study;
    [sensors] `position_std`, `position_resolution`, `torque_std`, `torque_resolution`,
    `temperature_std` (a number, or one per joint; without the last there are no temperatures);
    [[recordings]] `file`, `use`, `duration`, `period`, `start`, `payload`, `trajectory` with
    `harmonics`, `seed`, `amplitude`, `speed`, `acceleration`, `centre`, or with `centre`, `sine`
    and `cosine`, rows of amplitudes of each joint.

    Parameters
    ----------
    path : the file.
    modules : what may be run of its `effect_modules`: "trusted", those that the user has said yes
        to before or that this process has imported already; "run", all of them.

    Raises
    ------
    UntrustedError
        If an effect module would have to be run that is not trusted.
    StudyError
        If a key is unknown, missing or out of range: it names the key, and the remedy.
    DynidentError
        If a robot description is unusable.
    """
    path = Path(path)
    said = read_toml(path, _ExperimentFile)
    brought = import_effects(said.effect_modules, path, modules)
    robot = _robot(said, path, said.robot)
    require_sound(brought, robot)
    nominal = None if said.nominal is None else _robot(said, path, said.nominal)
    controller = said.controller.controller(robot, f"{path}: controller")
    laws = laws_of(said.laws, path)
    effects = []
    for number, entry in enumerate(said.effects):
        try:
            effects += TrueEffect.of(
                entry.effect, robot, entry.values, entry.shape, hidden=entry.hidden, laws=laws
            )
        except DynidentError as error:
            raise _at(error, path, f"effects.{number}") from None
    runs = [_run(entry, said, path, robot, k) for k, entry in enumerate(said.recordings)]
    try:
        return Experiment(
            robot=robot,
            controller=controller,
            runs=tuple(runs),
            effects=tuple(effects),
            sensors=Sensors(**said.sensors.model_dump()),
            seed=said.seed,
            friction_width=said.friction_width,
            nominal=nominal,
            torque=said.torque,
            lead_in=said.lead_in,
        )
    except DynidentError as error:
        raise _at(error, path) from None


def _robot(said: _ExperimentFile, path: Path, file: str) -> Robot:
    return Robot.from_file(path.parent / file, said.joints, said.gravity)


def _run(
    entry: _ExperimentRecordingEntry, said: _ExperimentFile, path: Path, robot: Robot, number: int
) -> ExperimentRun:
    seed = entry.trajectory.seed
    # Recordings that name no seed differ from each other all the same.
    seeds = (said.seed, number) if seed is None else seed
    try:
        trajectory = entry.trajectory.trajectory(robot, entry.period, seeds)
        return ExperimentRun(
            trajectory=trajectory,
            duration=entry.duration,
            file=entry.file,
            use=entry.use,
            start=entry.start,
            payload=entry.payload,
        )
    except DynidentError as error:
        raise _at(error, path, f"recordings.{number}") from None


def _at(error: DynidentError, path: Path, key: str = "") -> StudyError:
    """Return the complaint with the file, and the key in it, in front."""
    where = ": ".join(part for part in (str(path), key, error.where or "") if part)
    return StudyError(error.what, where, error.remedy)
