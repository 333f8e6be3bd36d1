"""A study file read into a model, recordings and settings; and written back with an effect more."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomlkit
from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from dynident import files
from dynident.closed_loop import Controller, ControllerFile
from dynident.criteria import DEFAULTS, Criteria
from dynident.data_files import find_all
from dynident.effects import FRICTION_WIDTH, Effect, effects_of
from dynident.errors import DynidentError, EffectError, RobotError, StudyError
from dynident.fitting.drive_gains import (
    DriveGains,
    GainProblem,
    Load,
    LoadEntry,
    PayloadEntry,
    fit_drive_gains,
    in_newton_metres,
    loads_of,
)
from dynident.model import Model
from dynident.recording import (
    Column,
    Dataset,
    FileLayout,
    Filter,
    Noise,
    Recording,
    default_position_cutoff,
    read,
    require_motion,
    require_torque,
    warn_of_missing_torque,
)
from dynident.robot import Robot
from dynident.settings import Duration, Rate, SettingsTable, Time, read_toml

_NARROWEST, _WIDEST = 1e-9, 1e3
"""rad/s or m/s over which dry friction changes its sign."""
_Gravity = Annotated[float, Field(ge=-100, le=100)]


class _RecordingEntry(SettingsTable):
    """A file of data, or several that have the rest in common.

    Attributes
    ----------
    file : its name, from the folder of the study; a pattern, as `"runs/train_*.csv"`, one
        recording for each file that matches, in the order of the numbers in their names; or a list
        of either.
    record : which one of an NPZ or MAT file that holds several; then it is one file.
    columns : names of the columns of a text file without a header line, by position, as
        `["t", "q.joint1", "-"]`; "" or "-" skips one.
    rate_hz : sampling rate, where the file has no column of time.
    topic : of a bag that holds the joints on several, as `"/joint_states"`.
    use : "train" to fit, "test" to judge by.
    period : s after which the excitation repeats.
    start : s, when the recording began in the session, for what warms up.
    window : [t0, t1] in s of the file's clock: what is used of it once the whole is filtered.
    payload : whether the load under study was on board, true or false; "unknown" asks for it. Or
        the name of one of several loads, see `LoadEntry`, or what is known of a load without one:
        `payload = { mass = 2.8, centre = [0.0, 0.02, 0.05] }`.
    """

    file: str | list[str]
    record: str | None = None
    columns: list[str] | None = None
    rate_hz: Rate | None = None
    topic: str = ""
    use: Literal["train", "test"] = "train"
    period: Duration | None = None
    start: Time = 0.0
    window: tuple[Time, Time] | None = None
    payload: PayloadEntry = None


class _FilterEntry(SettingsTable):
    position_cutoff_hz: Rate | Literal["default", "none"] = "default"
    cutoff_hz: Rate | None = None
    rate_hz: Rate | None = None
    decimation: Literal["pick", "chebyshev"] = "pick"
    edge_s: tuple[Time, Time] = (0.0, 0.0)
    ends: Literal["drop", "keep"] = "drop"


class _NoiseEntry(SettingsTable):
    position_std: float | list[float]
    torque_std: float | list[float]


class _ColumnEntry(SettingsTable):
    """Where a column is found in files that use other names, units or coordinates.

    `name` (or a bare string in its place) is the file's name, `name[2]` the third column of a
    table of numbers. What is no name in the file is read as a linear expression of its columns:
    `"q.joint6" = "motor_position[5]/32 - motor_position[4]/45 - 1.5707963"`, with numbers, `pi`,
    `+ - * /`, signs and parentheses, at most 300 characters. A name that such an expression could
    not hold goes between backticks: "0.5 * `left current (A)` - 0.5 * `right current (A)`". It is
    read by rules and never evaluated as code. Ours is `scale` times the whole.
    """

    name: str
    scale: float = 1.0


class _StudyFile(SettingsTable):
    """A study.

    Attributes
    ----------
    robot : its description (URDF, SDF, MJCF), a path from the folder of the study.
    joints : names, the order of columns; by default every joint that moves.
    effects : that the robot is said to have, `name` or `name@joint`.
    torque : "measured", or "held_command" where a command acts from its sample to the next.
    torque_unit : "N m" (and N, of prismatic joints), or the unit of the drives, "A" or "%": then
        each joint's gain is identified, and torques are converted before anything else is done.
    drive_gains : joint -> its gain where that is known, N m (or N) per unit; one fixes the scale.
    loads : name -> a load that recordings carry, see `LoadEntry`; a known one fixes the scale.
    friction_width : speed (rad/s or m/s) within which dry friction turns over; one, or by joint.
    gravity : m/s^2, in the axes of the description's base.
    recordings : files of data, see `_RecordingEntry`.
    filter : how positions are differentiated, and what is filtered alike; see `Filter`.
    noise : standard deviations of a raw sample, where nothing repeats, in rad or m, and in the
        unit of the torques; see `Noise`.
    controller : of the closed loop; see `Controller`.
    columns : ours -> the files' names of columns, or linear expressions of them.
    criteria : numbers that decide a diagnosis, otherwise than by default; see `Criteria`.
    """

    robot: str
    joints: list[str] | None = None
    effects: list[str] = Field(default_factory=list)
    torque: Literal["measured", "held_command"] = "measured"
    torque_unit: Literal["N m", "A", "%"] = "N m"
    drive_gains: dict[str, float] = Field(default_factory=dict)
    loads: dict[str, LoadEntry] = Field(default_factory=dict)
    friction_width: float | dict[str, float] = FRICTION_WIDTH
    gravity: tuple[_Gravity, _Gravity, _Gravity] | None = None
    recordings: list[_RecordingEntry]
    filter: _FilterEntry | None = None
    noise: _NoiseEntry | None = None
    controller: ControllerFile | None = None
    columns: dict[str, str | _ColumnEntry] = Field(default_factory=dict)
    criteria: dict[str, Any] = Field(default_factory=dict)

    @field_validator("friction_width")
    @classmethod
    def _positive(cls, width: float | dict[str, float]) -> float | dict[str, float]:
        """Refuse a width that is no width."""
        for one in width.values() if isinstance(width, dict) else (width,):
            if not one > 0:
                raise PydanticCustomError("width", "input should be greater than 0")  # pyright: ignore
            if not _NARROWEST <= one <= _WIDEST:
                what = f"input should be from {_NARROWEST:g} to {_WIDEST:g} rad/s or m/s"
                raise PydanticCustomError("width", what)  # pyright: ignore
        return width

    @field_validator("columns", mode="before")
    @classmethod
    def _quoted(cls, columns: Any) -> Any:
        """Refuse `q.elbow = ...` without quotes, which TOML reads as a table `q`."""
        for ours, theirs in columns.items() if isinstance(columns, dict) else ():
            if isinstance(theirs, dict) and "name" not in theirs:
                inner = next(iter(theirs), "joint")
                what = f'a name with a dot needs quotes: "{ours}.{inner}" = ...'
                raise PydanticCustomError("quotes", what)  # pyright: ignore
        return columns


@dataclass(frozen=True, kw_only=True)
class Study:
    """What a study file says.

    Attributes
    ----------
    path : the file.
    model : the robot and the effects that it is said to have.
    train, test : recordings to fit and recordings to judge by; `test` is empty where the study
        names none, and the diagnosis then holds out blocks of time. Their torques are in N m, and
        those of the robot alone where loads have names.
    drives : gains by which torques were converted, and loads that were identified; None where the
        recordings are in N m and no load has a name.
    controller : of the closed loop, where the study states one.
    criteria : the numbers that decide a diagnosis, with those that the study wants otherwise: a
        table for each group, as `[criteria.gates] level = 0.005`; see `dynident.criteria`.
    """

    path: Path
    model: Model
    train: Dataset
    test: Dataset
    drives: DriveGains | None = None
    controller: Controller | None = None
    criteria: Criteria = DEFAULTS

    @property
    def robot(self) -> Robot:
        """The robot as its description gives it."""
        return self.model.robot


def load(path: str | Path) -> Study:
    """Read a study file and everything that it names.

    Raises
    ------
    StudyError
        If the file is not a study: it names the key, and the remedy.
    DynidentError
        If the robot or a recording that it names is unusable.
    """
    path = Path(path)
    said = read_toml(path, _StudyFile)
    if not said.recordings:
        raise StudyError("no [[recordings]]", str(path), "add at least one")
    robot = _robot(said, path)
    try:
        effects = tuple(effect for label in said.effects for effect in effects_of(label, robot))
        model = Model(robot, effects, _widths(said.friction_width, robot))
    except DynidentError as error:
        raise StudyError(str(error), f"{path}: effects") from None
    recordings, loads = _recordings(said, path, robot)
    with _in(path, "filter"):
        settings = _filter(said.filter, recordings) if said.filter else None
    with _in(path, "criteria"):
        criteria = Criteria.with_values(said.criteria)
    noise = None
    if said.noise:
        noise = Noise(
            _per_joint(said.noise.position_std, robot, f"{path}: noise.position_std"),
            _per_joint(said.noise.torque_std, robot, f"{path}: noise.torque_std"),
        )
    sets = {
        use: Dataset(tuple(r for r in recordings if r.use == use), settings, noise)
        for use in ("train", "test")
    }
    if not sets["train"].recordings:
        remedy = 'set use = "train" for some of them'
        raise StudyError("no recording is for training", str(path), remedy)
    for dataset in sets.values():
        require_torque(dataset.recordings)
    warn_of_missing_torque(recordings)
    require_motion(sets["train"].recordings, robot.kinds)
    controller = None
    if said.controller:
        controller = said.controller.controller(robot, f"{path}: controller")
    drives = None
    if said.torque_unit != "N m" or said.drive_gains or loads:
        known = said.drive_gains
        if said.torque_unit == "N m":
            known = dict.fromkeys(robot.names, 1.0)
        drives = _drives(said, path, GainProblem(model, sets["train"], known, loads))
        sets = {use: in_newton_metres(one, drives, robot) for use, one in sets.items()}
    return Study(
        path=path,
        model=model,
        train=sets["train"],
        test=sets["test"],
        drives=drives,
        controller=controller,
        criteria=criteria,
    )


def add_effects(path: str | Path, effects: tuple[Effect, ...]) -> None:
    """Write effects into a study file, comments and order untouched.

    Parameters
    ----------
    path : the study file.
    effects : to add to its list.

    Raises
    ------
    StudyError
        If there is no way to do so that leaves all else in the file as it is.
    """
    path = Path(path)
    text = files.read_text(path)
    labels = [effect.label for effect in effects]
    wanted = tomllib.loads(text)
    wanted["effects"] = sorted([*wanted.get("effects", []), *labels])
    for candidate in _with_effects(text, labels):
        try:
            said = tomllib.loads(candidate)
        except tomllib.TOMLDecodeError:
            continue
        if {**said, "effects": sorted(said.get("effects", []))} == wanted:
            files.write_text(path, candidate)
            return
    remedy = f"write them into it: {', '.join(labels)}"
    raise StudyError("the effects cannot be added to this file", str(path), remedy)


def _with_effects(text: str, labels: list[str]) -> Iterator[str]:
    """Yield texts of a study with more effects, nicest first; not every one need be valid."""
    document = tomlkit.parse(text)
    if "effects" not in document:
        # A top-level key comes before the first table; `robot` is always there.
        line = f"effects = {json.dumps(labels)}"
        newline = "\r\n" if "\r\n" in text else "\n"
        yield re.sub(
            r"^[ \t]*robot[ \t]*=[^\r\n]*",
            lambda found: found[0] + newline + line,
            text,
            count=1,
            flags=re.MULTILINE,
        )
        yield line + newline + text
        return
    document["effects"].extend(labels)  # type: ignore[union-attr]
    yield tomlkit.dumps(document)
    # tomlkit 0.15 forgets the comma after a last item with a comment behind it.
    document = tomlkit.parse(text)
    for label in reversed(labels):
        document["effects"].insert(0, label)  # type: ignore[union-attr]
    yield tomlkit.dumps(document)


@contextmanager
def _in(path: Path, key: str) -> Iterator[None]:
    """Name the file in complaints about one of its tables."""
    try:
        yield
    except DynidentError as error:
        raise StudyError(error.what, f"{path}: {key}", error.remedy) from None


def _robot(said: _StudyFile, path: Path) -> Robot:
    file = path.parent / said.robot
    try:
        robot = Robot.from_file(file, said.joints, said.gravity)
    except RobotError as error:
        if said.joints is None:
            raise
        Robot.from_file(file)  # it is either unusable, or it is the choice of joints
        raise StudyError(str(error), f"{path}: joints") from None
    for link in robot.links:
        if not np.all(np.isfinite(link.phi)):
            what, remedy = "its inertia is not finite", "fix the numbers of its inertial element"
            raise RobotError(what, f"{file}: link '{link.name}'", remedy)
    return robot


def _filter(said: _FilterEntry, recordings: list[Recording]) -> Filter:
    """Filter of a study; positions are never differentiated unfiltered unless it says "none"."""
    values = said.model_dump()
    match said.position_cutoff_hz:
        case "default":
            rate = min(recording.rate_hz for recording in recordings)
            values["position_cutoff_hz"] = default_position_cutoff(rate, said.cutoff_hz)
        case "none":
            values["position_cutoff_hz"] = None
    return Filter(**values)


def _widths(said: float | dict[str, float], robot: Robot) -> float | tuple[float, ...]:
    """Friction width of all joints, or of each: of those that are not named, the default."""
    if not isinstance(said, dict):
        return said
    for name in said:
        if name not in robot.names:
            remedy = f"joints: {', '.join(robot.names)}"
            raise EffectError(f"the robot has no joint '{name}'", "friction_width", remedy)
    return tuple(said.get(name, FRICTION_WIDTH) for name in robot.names)


def _drives(said: _StudyFile, path: Path, problem: GainProblem) -> DriveGains:
    """Gains and loads that the training recordings tell."""
    if said.torque_unit == "N m" and said.drive_gains:
        what, remedy = "gains of drives, and torques in N m", 'state torque_unit = "A" or "%"'
        raise StudyError(what, f"{path}: drive_gains", remedy)
    trained = {recording.load for recording in problem.dataset.recordings}
    for load in problem.loads:
        if load.name not in trained and not load.is_known:
            what = f"no training recording carries the load '{load.name}', which is not known"
            remedy = "state all of it, or train with a recording that carries it"
            raise StudyError(what, str(path), remedy)
    return fit_drive_gains(problem, said.torque_unit)


def _recordings(
    said: _StudyFile, path: Path, robot: Robot
) -> tuple[list[Recording], tuple[Load, ...]]:
    """Every recording, and the loads that they name."""
    with _in(path, "columns"):
        columns = {
            ours: Column(theirs, 1.0) if isinstance(theirs, str) else Column(**theirs.model_dump())
            for ours, theirs in said.columns.items()
        }
    names, loads = loads_of((one.payload for one in said.recordings), said.loads, str(path))
    payloads = [one.payload for one in said.recordings if not loads]
    if "unknown" in payloads and any(isinstance(one, bool) for one in payloads):
        remedy = 'state true or false for every recording, or "unknown" for all of them'
        raise StudyError("a payload is known and unknown", f"{path}: recordings", remedy)
    known: dict[tuple[Path, str | None, FileLayout], Recording] = {}
    found: list[Recording] = []
    for place, entry in enumerate(said.recordings):
        where = f"{path}: recordings.{place}"
        with _in(path, f"recordings.{place}"):
            layout = FileLayout(
                names=tuple(entry.columns or ()), rate_hz=entry.rate_hz, topic=entry.topic
            )
        matched = _files(entry, path.parent, where)
        for name, file in matched.items():
            key = (file, entry.record, layout)
            if key not in known:
                known[key] = read(
                    file, robot.names, columns, robot.kinds, entry.record, layout=layout
                )
            found.append(
                known[key].replace(
                    name=entry.record or name,
                    use=entry.use,
                    period=entry.period,
                    start=entry.start,
                    window=entry.window,
                    payload=entry.payload if isinstance(entry.payload, bool) else None,
                    load=names[place],
                    torque=said.torque,
                    number=len(found) + 1,
                )
            )
    return found, loads


def _files(entry: _RecordingEntry, folder: Path, where: str) -> dict[str, Path]:
    """Name of each file that an entry names -> where it is."""
    patterns = [entry.file] if isinstance(entry.file, str) else entry.file
    found: dict[str, Path] = {}
    for pattern in patterns:
        found |= find_all(pattern, folder)
    if not found:
        raise StudyError("file = [] names no file", where, "name at least one")
    if entry.record is not None and len(found) > 1:
        what = f"record = {entry.record!r} is of one file, and {len(found)} are named"
        raise StudyError(what, where, "write an entry for each file")
    return found


def _per_joint(value: float | list[float], robot: Robot, where: str) -> np.ndarray:
    values = np.full(robot.n, value) if isinstance(value, float) else np.array(value)
    if values.shape != (robot.n,):
        raise StudyError(f"{len(values)} values for {robot.n} joints", where, "give one per joint")
    if not np.all(values > 0):
        raise StudyError("a standard deviation is not positive", where)
    return values
