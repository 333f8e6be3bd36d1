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
from dynident.experiment_design.carried_load import payload_effect, usual_load
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.experiment_design.written_design import DESIGN, MOTION_PAGE, design_file
from dynident.file_groups import replaced_together
from dynident.robot.patching import write

REFERENCE, EXPERIMENT = "reference.csv", "experiment.toml"
FILES = (REFERENCE, EXPERIMENT, MOTION_PAGE, DESIGN)
"""Names that are a design's, beside that of the robot's description."""


def write_design(
    design: RecordingDesign,
    folder: str | Path,
    rate_hz: float,
    controller: Controller | None,
    study: str = "",
    motion: str = "",
) -> tuple[Path, ...]:
    """Write the reference of a designed recording, its motion, and what simulates it.

    All of it takes the place of what an earlier design left in the folder when it is complete:
    whatever ends this earlier leaves that design as it was. `design.toml` comes last: whenever it
    is there, what lies beside it is of the same design.

    `reference.csv` has the time and, for each joint, `q_ref` and `v_ref`, of all repetitions, from
    rest to rest. `design.toml` says what it settles. `experiment.toml` has the motion by its
    coefficients, the robot as it is known by now, and its controller; without a controller it is
    not written. `motion.html` shows the motion.

    Parameters
    ----------
    design : of `dynident.experiment_design.design`.
    folder : made if it is missing.
    rate_hz : of the reference, at least nearly: a period is a whole number of samples.
    controller : of the robot.
    study : digest of the study that it is for, by which it is known whether that has changed since.
    motion : page of HTML; none where there is none.

    Returns
    -------
    The files written, `design.toml` last.

    Raises
    ------
    FileError
        If a file cannot be written; the earlier design is then untouched. If an old one cannot be
        removed.
    """
    folder = Path(folder)
    task, series, names = design.task, design.trajectory, design.model.robot.names
    per_period = max(round(task.duration * rate_hz), 2)
    t = np.arange(task.repeat * per_period + 1) * (task.duration / per_period)
    q, v, _ = series.at(t)
    table = {"t": t}
    for j, name in enumerate(names):
        table |= {f"q_ref.{name}": q[:, j], f"v_ref.{name}": v[:, j]}
    text = pd.DataFrame(table).to_csv(index=False, float_format="%.9g", lineterminator="\n")
    with replaced_together(folder, (*FILES, _name(design)), last=DESIGN) as beside:
        written = [files.write_text(beside / REFERENCE, text)]
        if controller is not None:
            robot = write(design.estimate.robot, beside / _name(design))
            document = tomlkit.dumps(_experiment(design, robot.name, controller))
            written += [robot, files.write_text(beside / EXPERIMENT, document)]
        if motion:
            written.append(files.write_text(beside / MOTION_PAGE, motion))
        summary = tomlkit.dumps(design_file(design, study, motion).model_dump())
        written.append(files.write_text(beside / DESIGN, summary))
    return tuple(folder / one.name for one in written)


def _name(design: RecordingDesign) -> str:
    description = design.model.robot.description
    assert description is not None
    return "robot" + {"urdf": ".urdf", "sdf": ".sdf", "mjcf": ".xml"}[description.format]


def _experiment(design: RecordingDesign, robot: str, controller: Controller):
    estimate, task = design.estimate, design.task
    model = estimate.model
    document = tomlkit.document()
    document["robot"] = robot
    document["joints"] = list(model.robot.names)
    # An experiment has one width: the widest is the one that a motion shows.
    document["friction_width"] = float(np.max(model.friction_widths))
    entries = tomlkit.aot()
    values = {effect.label: estimate.effect_values(effect.label) for effect in model.effects}
    effects = {effect.label: effect for effect in model.effects}
    if task.load:
        carried = payload_effect(model.robot)
        effects[carried.label] = carried
        values[carried.label] = usual_load(model.robot, task.load)
    for label, effect in effects.items():
        entry = tomlkit.table()
        entry["effect"] = label
        own = values[label]
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
    if task.load:
        entry["payload"] = True
    entry["trajectory"] = design.trajectory.coefficients
    recordings = tomlkit.aot()
    recordings.append(entry)
    document["recordings"] = recordings
    return document
