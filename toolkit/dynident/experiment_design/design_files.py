"""A designed recording as files: the reference to follow, and the experiment to simulate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from dynident import files
from dynident.closed_loop import Controller
from dynident.closed_loop.experiments.virtual_study import controller_table
from dynident.effects import LawEffect, laws_table
from dynident.errors import DesignError, FileError
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.robot.patching import write

REFERENCE, EXPERIMENT = "reference.csv", "experiment.toml"


def write_design(
    design: RecordingDesign, folder: str | Path, rate_hz: float, controller: Controller | None
) -> tuple[Path, ...]:
    """Write the reference of a designed recording, and the experiment that simulates it.

    `reference.csv` has the time and, for each joint, `q_ref` and `v_ref`, of all repetitions, from
    rest to rest. `experiment.toml` has the motion by its coefficients, the robot as it is known by
    now, and its controller; without a controller it is not written.

    Parameters
    ----------
    design : of `dynident.experiment_design.design`.
    folder : made if it is missing.
    rate_hz : of the reference.
    controller : of the robot.

    Returns
    -------
    The files written.

    Raises
    ------
    DesignError
        If the period is not a whole number of samples.
    FileError
        If a file cannot be written.
    """
    folder = Path(folder)
    task, series, names = design.task, design.trajectory, design.model.robot.names
    per_period = task.duration * rate_hz
    if abs(per_period - round(per_period)) > 1e-6 * per_period or round(per_period) < 2:
        what = f"{task.duration:g} s are no whole number of samples at {rate_hz:g} Hz"
        raise DesignError(what, remedy="choose another duration")
    files.require_folder(folder)
    t = np.arange(task.repeat * round(per_period) + 1) / rate_hz
    q, v, _ = series.at(t)
    table = {"t": t}
    for j, name in enumerate(names):
        table |= {f"q_ref.{name}": q[:, j], f"v_ref.{name}": v[:, j]}
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot be made ({error.strerror or error})", str(folder)) from None
    text = pd.DataFrame(table).to_csv(index=False, float_format="%.9g", lineterminator="\n")
    written = [files.write_text(folder / REFERENCE, text)]
    if controller is not None:
        robot = write(_robot(design), folder / _name(design))
        document = tomlkit.dumps(_experiment(design, robot.name, controller))
        written += [robot, files.write_text(folder / EXPERIMENT, document)]
    return tuple(written)


def _robot(design: RecordingDesign):
    model = design.model
    rigid = design.values[: model.base.rank]
    return model.robot.with_theta(model.base.lift(rigid, model.robot.theta))


def _name(design: RecordingDesign) -> str:
    description = design.model.robot.description
    assert description is not None
    return "robot" + {"urdf": ".urdf", "sdf": ".sdf", "mjcf": ".xml"}[description.format]


def _experiment(design: RecordingDesign, robot: str, controller: Controller):
    model, task, series = design.model, design.task, design.trajectory
    document = tomlkit.document()
    document["robot"] = robot
    document["joints"] = list(model.robot.names)
    entries = tomlkit.aot()
    for effect in model.effects:
        entry = tomlkit.table()
        entry["effect"] = effect.label
        own = design.values[model.slices[effect.label]]
        parameters = effect.parameters(model.robot)
        entry["values"] = {
            p.name: float(np.clip(x, p.lower, p.upper))
            for p, x in zip(parameters, own, strict=True)
        }
        shapes = effect.shape_parameters(model.robot)
        if shapes:
            entry["shape"] = {s.name: x for s, x in zip(shapes, effect.shape, strict=True)}
        entries.append(entry)
    document["effects"] = entries
    laws = {e.made_of: None for e in model.effects if isinstance(e, LawEffect)}
    if laws:
        document["laws"] = laws_table(laws)
    document["controller"] = controller_table(controller)
    entry = tomlkit.table()
    entry["file"] = "designed.csv"
    entry["duration"] = task.duration * task.repeat
    entry["period"] = task.duration
    entry["trajectory"] = {
        "centre": series.centre.tolist(),
        "sine": series.sine.tolist(),
        "cosine": series.cosine.tolist(),
    }
    recordings = tomlkit.aot()
    recordings.append(entry)
    document["recordings"] = recordings
    return document
