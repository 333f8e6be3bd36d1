"""A study file read into a model, recordings and settings; and written back with an effect more."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import tomlkit
from pydantic import Field

from dynident import files
from dynident.closed_loop import Controller, ControllerFile
from dynident.effects import FRICTION_WIDTH, Effect, effects_of
from dynident.errors import DynidentError, StudyError
from dynident.model import Model
from dynident.places import find_data
from dynident.recording import Column, Dataset, Filter, Noise, Recording, read
from dynident.robot import Robot
from dynident.settings import Table, read_toml

Positive = Field(default=None, gt=0)


class _RecordingEntry(Table):
    file: str
    use: Literal["train", "test"] = "train"
    period: float | None = Positive
    start: float = 0.0
    window: tuple[float, float] | None = None
    payload: bool | None = None


class _FilterEntry(Table):
    position_cutoff_hz: float | None = Positive
    cutoff_hz: float | None = Positive
    rate_hz: float | None = Positive
    decimation: Literal["pick", "chebyshev"] = "pick"
    edge_s: tuple[float, float] = (0.0, 0.0)


class _NoiseEntry(Table):
    position_std: float | list[float]
    torque_std: float | list[float]


class _ColumnEntry(Table):
    name: str
    scale: float = 1.0


class _StudyFile(Table):
    robot: str
    joints: list[str] | None = None
    effects: list[str] = []
    torque: Literal["measured", "held_command"] = "measured"
    friction_width: float = Field(default=FRICTION_WIDTH, gt=0)
    gravity: tuple[float, float, float] | None = None
    recordings: list[_RecordingEntry]
    filter: _FilterEntry | None = None
    noise: _NoiseEntry | None = None
    controller: ControllerFile | None = None
    columns: dict[str, str | _ColumnEntry] = {}


@dataclass(frozen=True)
class Study:
    """What a study file says.

    Attributes
    ----------
    path : the file.
    model : the robot and the effects that it is said to have.
    train, test : recordings to fit and recordings to judge by; `test` is empty where the study
        names none, and the diagnosis then holds out blocks of time.
    controller : of the closed loop, where the study states one.
    """

    path: Path
    model: Model
    train: Dataset
    test: Dataset
    controller: Controller | None = None

    @property
    def robot(self) -> Robot:
        """The robot as its description gives it."""
        return self.model.robot


def load(path: str | Path) -> Study:
    """Read a study file and everything that it names.

    Raises
    ------
    StudyError
        If the file is not a study: it names the key, and the mend.
    DynidentError
        If the robot or a recording that it names is unusable.
    """
    path = Path(path)
    said = read_toml(path, _StudyFile)
    if not said.recordings:
        raise StudyError("no [[recordings]]", str(path), "add at least one")
    robot = Robot.from_file(path.parent / said.robot, said.joints)
    if said.gravity is not None:
        robot = robot.with_gravity(np.array(said.gravity))
    try:
        effects = tuple(effect for label in said.effects for effect in effects_of(label, robot))
        model = Model(robot, effects, said.friction_width)
    except DynidentError as error:
        raise StudyError(str(error), f"{path}: effects") from None
    recordings = _recordings(said, path, robot)
    settings = Filter(**said.filter.model_dump()) if said.filter else None
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
        mend = 'set use = "train" for some of them'
        raise StudyError("no recording is for training", str(path), mend)
    controller = None
    if said.controller:
        controller = said.controller.controller(robot, f"{path}: controller")
    return Study(path, model, sets["train"], sets["test"], controller)


def add_effects(path: str | Path, effects: tuple[Effect, ...], payload: dict[str, bool]) -> None:
    """Write effects into a study file, comments and order untouched.

    Parameters
    ----------
    path : the study file.
    effects : to add to its list.
    payload : file of a recording -> whether it carries the payload; written where not empty.
    """
    path = Path(path)
    document = tomlkit.parse(files.read_text(path))
    labels = document.get("effects")
    if labels is None:
        labels = tomlkit.array()
        # Top-level keys come before the first table.
        document.insert(0, tomlkit.key("effects"), labels)  # type: ignore[attr-defined]
    for effect in effects:
        labels.append(effect.label)  # type: ignore[union-attr]
    for entry in document.get("recordings", []):
        if entry["file"] in payload:
            entry["payload"] = payload[entry["file"]]
    files.write_text(path, tomlkit.dumps(document))


def _recordings(said: _StudyFile, path: Path, robot: Robot) -> list[Recording]:
    columns = {
        ours: Column(theirs, 1.0) if isinstance(theirs, str) else Column(**theirs.model_dump())
        for ours, theirs in said.columns.items()
    }
    known: dict[Path, Recording] = {}
    found = []
    for entry in said.recordings:
        file = find_data(entry.file, path.parent)
        if file not in known:
            known[file] = read(file, robot.names, columns, kinds=robot.kinds)
        found.append(
            known[file].replace(
                name=entry.file,
                use=entry.use,
                period=entry.period,
                start=entry.start,
                window=entry.window,
                payload=entry.payload,
                torque=said.torque,
            )
        )
    return found


def _per_joint(value: float | list[float], robot: Robot, where: str) -> np.ndarray:
    values = np.full(robot.n, value) if isinstance(value, float) else np.array(value)
    if values.shape != (robot.n,):
        raise StudyError(f"{len(values)} values for {robot.n} joints", where, "give one per joint")
    if not np.all(values > 0):
        raise StudyError("a standard deviation is not positive", where)
    return values
