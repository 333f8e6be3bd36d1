"""The command that shows on an embedded arm what the others do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from dynident import files
from dynident.cli.designs import write_files
from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.output import progress
from dynident.cli.work import diagnosis_of, load_study, require_places, write_report
from dynident.errors import FileError

if TYPE_CHECKING:
    from dynident.closed_loop import Experiment
    from dynident.study import Study

_PATH = click.Path(path_type=Path)
_HIDDEN, _VALUES = "quadratic_drag@elbow", (0.3,)
_KNOWN = {
    "viscous_friction@shoulder": (0.9,),
    "viscous_friction@elbow": (0.35,),
    "coulomb_friction@shoulder": (1.6,),
    "coulomb_friction@elbow": (0.7,),
}


@commands.command()
@answered
@click.option("--to", type=_PATH, default=Path("demo.report.html"), show_default=True)
@click.option(
    "--design",
    "folder",
    type=_PATH,
    help="Instead: recordings that leave two effects open, and the one that settles it, into DIR.",
)
def demo(to: Path, folder: Path | None) -> CommandAnswer:
    """Find the effect hidden in the data of an embedded two-link arm.

    With --design the arm has another effect, and its recordings, made virtually, cannot tell it
    from a second one: the next recording is designed, made virtually, added to the study, and the
    study is explained again.

    Example: dynident demo
    """
    study = _demo_study()
    if folder is not None:
        return _settled(study, folder)
    require_places(study, to)
    loaded = load_study(study, to)
    diagnosis = diagnosis_of(loaded, switches="all")
    write_report(loaded, diagnosis, to)
    return CommandAnswer(
        content=diagnosis.to_dict,
        parts=lambda: (*diagnosis.tables(), f"The report to open: {to.resolve()}"),
    )


def _settled(source: Path, folder: Path) -> CommandAnswer:
    """Leave two effects open, and settle which of them it is."""
    from dynident.closed_loop import write_experiment
    from dynident.experiment_design import DesignTask
    from dynident.experiment_design.virtual_recording import close_design_loop
    from dynident.recording import write
    from dynident.study import add_recording

    files.require_folder(folder)
    truth = _undecided(load_study(source))
    with progress("simulating"):
        write_experiment(truth, folder)
    path = folder / "study.toml"
    loaded = load_study(path)
    task = DesignTask(duration=8.0, repeat=2, harmonics=5, starts=1)
    with progress("diagnosing") as told:
        loop = close_design_loop(loaded.model, loaded.train, truth, task, progress=told)
    _, notes = write_files(loop.designed, loaded, folder / "next")
    write(loop.recording, folder / loop.recording.name)
    add_recording(path, loop.recording)
    return CommandAnswer(
        content=loop.to_dict,
        parts=lambda: (*loop.tables(), *notes, f"The study, with the recording: {path}"),
    )


def _undecided(study: Study) -> Experiment:
    """The arm with drag at its elbow, in recordings that are short of speeds to show that."""
    from dynident.closed_loop import Experiment, ExperimentRun, Fourier, Sensors, TrueEffect

    robot, controller = study.robot, study.controller
    assert controller is not None
    effects = [one for name, x in _KNOWN.items() for one in TrueEffect.of(name, robot, x)]
    effects += TrueEffect.of(_HIDDEN, robot, _VALUES, hidden=True)
    runs = tuple(
        ExperimentRun(
            trajectory=Fourier.random(robot, 8.0, [0, k], amplitude=0.5, speed=1.5),
            duration=16.0,
            file=f"slow{k + 1}.csv",
        )
        for k in range(3)
    )
    sensors = Sensors(
        position_std=2e-5,
        position_resolution=1e-5,
        torque_std=(0.12, 0.05),
        torque_resolution=0.001,
    )
    return Experiment(
        robot=robot, controller=controller, runs=runs, effects=tuple(effects), sensors=sensors
    )


def _demo_study() -> Path:
    here = Path(__file__).resolve().parents[1]
    places = (here / "demo", here.parents[1] / "problems" / "hidden_effect")
    for place in places:
        if (place / "study.toml").is_file():
            return place / "study.toml"
    raise FileError("the embedded example is not installed", str(places[0]), "run it from a clone")
