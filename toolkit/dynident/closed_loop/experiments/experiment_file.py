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
from dynident.closed_loop.splines import BSpline, Trajectory
from dynident.closed_loop.trajectories import MOST_HARMONICS, Fourier
from dynident.closed_loop.true_effects import TrueEffect
from dynident.effect_modules import Permission, import_effects, require_sound
from dynident.effects import FRICTION_WIDTH, LawsEntry, laws_of
from dynident.errors import DynidentError, SimulationError, StudyError
from dynident.robot import Robot
from dynident.settings import Duration, Gravity, SettingsTable, Time, in_unit, read_toml

_Number = float | list[float]


def _per_joint(unit: str):
    """A number, or one per joint, that the file may leave out."""
    return Field(default=None, json_schema_extra=in_unit(unit))


def _ideal(unit: str):
    """The same of a sensor, which by default adds nothing."""
    return Field(default=0.0, json_schema_extra=in_unit(unit))


class TrueEffectEntry(SettingsTable):
    """An effect that the robot truly has."""

    effect: str
    """`name@joint`, or `name` of an effect of the whole robot."""
    values: dict[str, float] = Field(default_factory=dict)
    """Its parameters, as `{ Fv = 0.9 }`, in their units (see the catalogue); others are zero."""
    shape: dict[str, float] = Field(default_factory=dict)
    """Its shape parameters, as `{ vs = 0.12 }`; by default the middle of their grid."""
    hidden: bool = False
    """Whether the study that is written does not mention it."""


class SensorsEntry(SettingsTable):
    """What is measured, and how well; a number, or one per joint."""

    position_std: _Number = _ideal("rad or m")
    """White noise of each position sample."""
    position_resolution: _Number = _ideal("rad or m")
    """One step of the encoder; 0 for none."""
    torque_std: _Number = _ideal("N m or N")
    """White noise of each recorded torque."""
    torque_resolution: _Number = _ideal("N m or N")
    """One step of the record; 0 for none."""
    temperature_std: _Number | None = _per_joint("K")
    """White noise of the motors' recorded temperatures; without it none are recorded."""


class TrajectoryEntry(SettingsTable):
    """A random Fourier series, as large as the robot's limits allow; or a motion by coefficients.

    A series is q(t) = centre + sum over k of sine_k sin(k w t) + cosine_k cos(k w t),
    w = 2 pi/period.
    """

    harmonics: int = Field(default=5, ge=1, le=MOST_HARMONICS)
    """How many; of a random series."""
    seed: int | None = Field(default=None, ge=0)
    """Of a random series; by default it follows from the seed of the experiment and the recording's
    place."""
    amplitude: _Number | None = _per_joint("rad or m")
    """Most that a random series leaves its centre; by default what the limits allow."""
    speed: _Number | None = _per_joint("rad/s or m/s")
    """Most that a random series reaches."""
    acceleration: _Number | None = _per_joint("rad/s^2 or m/s^2")
    """Most that a random series reaches."""
    centre: _Number | None = _per_joint("rad or m")
    """The middle; by default that of the limits."""
    sine: list[list[float]] | None = _per_joint("rad or m")
    """A row of amplitudes for each joint; with `cosine` and `centre`, in place of a random
    series."""
    cosine: list[list[float]] | None = _per_joint("rad or m")
    """The same of the cosines."""
    points: list[list[float]] | None = _per_joint("rad or m")
    """A row of points for each joint, alone: a B-spline of degree five with evenly spaced knots.
    The first three and the last three of a row are equal, at rest."""

    def trajectory(self, robot: Robot, period: float, seed: object) -> Trajectory:
        """Return the motion that is stated, or a random series.

        Parameters
        ----------
        robot : whose joints move, and whose limits a random series keeps.
        period : s.
        seed : of a random series.

        Raises
        ------
        SimulationError
            If the motion is stated in part only, twice, or does not fit the robot.
        """
        if self.points is not None:
            return self._spline(robot, period, self.points)
        settings = self.model_dump(exclude={"seed", "sine", "cosine", "points"})
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

    def _spline(self, robot: Robot, period: float, points: list[list[float]]) -> BSpline:
        if self.model_fields_set != {"points"}:
            others = ", ".join(sorted(self.model_fields_set - {"points"}))
            remedy = f"leave out points, or {others}"
            raise SimulationError("two motions at once", "trajectory", remedy)
        if len(points) != robot.n or len({len(row) for row in points}) != 1:
            remedy = f"give {robot.n} rows of as many points"
            raise SimulationError("its points do not fit the robot", "trajectory", remedy)
        return BSpline(period, np.array(points))


class ExperimentRecordingEntry(SettingsTable):
    """A recording to be made."""

    file: str
    """Its name, without a folder; the suffix (.csv, .npz, .mat or .parquet) is its format."""
    use: Literal["train", "test"] = "train"
    """As in a study."""
    duration: Duration
    """How long it is."""
    period: Duration
    """After which the motion repeats."""
    start: Time = 0.0
    """When it begins in the session, for what warms up or drifts."""
    payload: bool = False
    """Whether the payload is on board."""
    trajectory: TrajectoryEntry = TrajectoryEntry()
    """The motion that is asked for."""


class ExperimentFile(SettingsTable):
    """A robot as it truly is, its controller, and the recordings to be made of it."""

    robot: str
    """The true robot (URDF, SDF, MJCF), a path from the folder of the file."""
    nominal: str | None = None
    """The description that the user of the recordings is given; by default the true one."""
    joints: list[str] | None = None
    """Names, the order of columns; by default every joint that moves."""
    gravity: tuple[Gravity, Gravity, Gravity] | None = None
    """In the axes of the description's base; by default as in a study."""
    seed: int = Field(default=0, ge=0)
    """Of all noise, and of motions that state no seed of their own."""
    friction_width: float = Field(
        default=FRICTION_WIDTH, ge=1e-9, le=1e3, json_schema_extra=in_unit("rad/s or m/s")
    )
    """Speed within which dry friction turns over."""
    torque: Literal["held_command", "measured"] = "held_command"
    """What is recorded: the command, held from its sample to the next, or its mean over the sample
    before and the one after, as a sensor of limited bandwidth has it."""
    lead_in: Annotated[Time, Field(ge=0)] = LEAD_IN
    """Simulated before each recording, for its transient to decay."""
    effect_modules: list[str] = Field(default_factory=list)
    """Python files with effects of one's own, as in a study."""
    effects: list[TrueEffectEntry] = Field(default_factory=list)
    """Effects that the robot truly has."""
    laws: LawsEntry = Field(default_factory=dict)
    """Effects as formulas, as in a study."""
    controller: ControllerFile
    """The loop that moves the robot; it needs `rate_hz`."""
    sensors: SensorsEntry = SensorsEntry()
    """What is measured, and how well."""
    recordings: list[ExperimentRecordingEntry]
    """Those that are made."""


def load_experiment(path: str | Path, *, modules: Permission = "trusted") -> Experiment:
    """Read an experiment file and the robots that it names.

    Its keys are those of `ExperimentFile`.

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
    said = read_toml(path, ExperimentFile)
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


def _robot(said: ExperimentFile, path: Path, file: str) -> Robot:
    return Robot.from_file(path.parent / file, said.joints, said.gravity)


def _run(
    entry: ExperimentRecordingEntry, said: ExperimentFile, path: Path, robot: Robot, number: int
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
