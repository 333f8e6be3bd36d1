"""An experiment's recordings as files, with a study that is silent about what is hidden."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path, PurePath

import tomlkit

from dynident import files
from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.experiments.experiment import Experiment, Progress
from dynident.effect_modules import module_file
from dynident.effects import FRICTION_WIDTH, Effect, Law, LawEffect, laws_table
from dynident.errors import FileError, SimulationError
from dynident.recording import write as write_recording
from dynident.robot import Robot
from dynident.robot.patching import patched

STUDY = "study.toml"


def write_experiment(
    experiment: Experiment, folder: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Simulate an experiment and write what its user gets.

    That is the recordings, the nominal robot description, effect modules of which an effect is not
    hidden, and last `study.toml`, which names them and the effects that are not hidden. Each file
    is written whole or not at all.

    Parameters
    ----------
    experiment : Experiment
        Its robots must have been read from a description.
    folder : made if it is missing; files of these names in it are replaced.
    progress : see `Progress`.

    Returns
    -------
    The files written.

    Raises
    ------
    SimulationError
        If it cannot be simulated; nothing is then written.
    FileError
        If a file cannot be written.
    """
    folder = Path(folder)
    nominal = experiment.nominal or experiment.robot
    if nominal.description is None:
        remedy = "start from Robot.from_file or Robot.from_text"
        raise SimulationError("has no description that could be written", nominal.name, remedy)
    files.require_folder(folder)
    recordings = experiment.run(progress)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot be made ({error.strerror or error})", str(folder)) from None
    written = [write_recording(one, folder / one.name) for one in recordings]
    description = folder / _description_name(nominal)
    written.append(files.write_text(description, patched(nominal)))
    modules = _modules(experiment)
    written += [files.write_text(folder / name, text) for name, text in modules.items()]
    text = tomlkit.dumps(_study(experiment, nominal, description.name, tuple(modules)))
    written.append(files.write_text(folder / STUDY, text))
    return written


def _description_name(robot: Robot) -> str:
    assert robot.description is not None
    suffix = {"urdf": ".urdf", "sdf": ".sdf", "mjcf": ".xml"}[robot.description.format]
    name = PurePath(robot.description.path).name
    # A robot from a text has no file; its own name may not be one.
    return name if name.lower().endswith((suffix, ".xml")) else f"robot{suffix}"


def _modules(experiment: Experiment) -> dict[str, str]:
    """Files of the known effects that came from effect modules, as texts by their names."""
    kinds = {type(one.effect) for one in experiment.known_effects}
    paths = sorted({str(path) for path in map(module_file, kinds) if path is not None})
    return {Path(path).name: files.read_text(path) for path in paths}


def _study(
    experiment: Experiment, nominal: Robot, description: str, modules: tuple[str, ...]
) -> tomlkit.TOMLDocument:
    document = tomlkit.document()
    document["robot"] = description
    document["joints"] = list(nominal.names)
    if modules:
        document["effect_modules"] = list(modules)
    document["effects"] = _multiline(_labels(experiment))
    document["torque"] = experiment.torque
    if experiment.friction_width != FRICTION_WIDTH:
        document["friction_width"] = experiment.friction_width
    stated = Robot.from_text(patched(nominal), description, nominal.names)
    if (stated.gravity != nominal.gravity).any():
        document["gravity"] = [float(g) for g in nominal.gravity]
    entries = tomlkit.aot()
    for run in experiment.runs:
        entry = tomlkit.table()
        entry["file"] = run.file
        entry["use"] = run.use
        entry["period"] = run.trajectory.period
        if run.start:
            entry["start"] = run.start
        if experiment.states_payload:
            entry["payload"] = run.payload
        entries.append(entry)
    document["recordings"] = entries
    if laws := _laws(experiment):
        document["laws"] = laws_table(laws)
    document["controller"] = controller_table(experiment.controller)
    return document


def _labels(experiment: Experiment) -> list[str]:
    """Labels of the known effects; one that sits at every place is named once."""
    known = [one.effect for one in experiment.known_effects]
    by_kind: dict[type[Effect], list[str]] = {}
    for effect in known:
        by_kind.setdefault(type(effect), []).append(effect.label)
    found = []
    for kind, labels in by_kind.items():
        name = kind.name
        everywhere = [one.label for one in kind.candidates(experiment.robot)]
        found += [name] if sorted(labels) == sorted(everywhere) else labels
    return found


def _laws(experiment: Experiment) -> tuple[Law, ...]:
    """The laws of the known effects."""
    known = (one.effect for one in experiment.known_effects)
    return tuple(dict.fromkeys(e.made_of for e in known if isinstance(e, LawEffect)))


def _multiline(labels: list[str]):
    array = tomlkit.array()
    array.extend(labels)
    return array.multiline(len(labels) > 3)


def controller_table(controller: Controller):
    """The table of a controller; what has its default is left out."""
    table = tomlkit.table()
    for part in fields(controller):
        value = getattr(controller, part.name)
        if isinstance(value, tuple):
            value = list(value)
        if part.name == "velocity_reference" and controller.kind == "cascade":
            continue
        if value != part.default and value not in ([], None):
            table[part.name] = value
    return table
