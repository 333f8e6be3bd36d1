"""The command that designs the next recording, and what other commands ask of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dynident import files
from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.output import progress
from dynident.cli.work import STUDY, load_study
from dynident.errors import DesignError, DynidentError

if TYPE_CHECKING:
    from dynident.diagnosis import Diagnosis
    from dynident.experiment_design import RecordingDesign
    from dynident.study import Study

_PATH = click.Path(path_type=Path)


@commands.command()
@STUDY
@answered
@click.option("--duration", type=float, default=10.0, show_default=True, help="s, of a repetition.")
@click.option("--repeat", type=click.IntRange(1, 1000), default=3, show_default=True)
@click.option(
    "--harmonics", type=click.IntRange(2, 60), show_default="8", help="Of Fourier series."
)
@click.option(
    "--intervals",
    type=click.IntRange(2, 200),
    help="Of B-splines, in the place of Fourier series.",
)
@click.option("--starts", type=click.IntRange(1, 100), default=3, show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--objective", type=click.Choice(["D", "A"]), default="D", show_default=True)
@click.option(
    "--tell",
    nargs=2,
    multiple=True,
    metavar="EFFECT EFFECT",
    help="Tell which of these it is; may be repeated.",
)
@click.option(
    "--show", multiple=True, metavar="EFFECT", help="Show what the recordings could not; likewise."
)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    metavar="JOINT",
    help="Only the parameters of this joint and its link; may be repeated.",
)
@click.option("--clearance", type=float, help="m, that links keep from each other.")
@click.option(
    "--load",
    "loads",
    type=float,
    multiple=True,
    metavar="KG",
    help="What the last link carries; of several, the one with which the recording tells most.",
)
@click.option("--limits", type=_PATH, help="A file of limits, [joints.NAME], boxes and obstacles.")
@click.option(
    "--out",
    type=_PATH,
    help="Write reference.csv, design.toml, experiment.toml and motion.html here.",
)
def design(study: Path, limits: Path | None, out: Path | None, **settings) -> CommandAnswer:
    """Design the recording to make next: for all parameters, for a joint's, or for effects.

    The motion keeps nine tenths of the description's limits, begins and ends at rest, and repeats.
    Look at it in DIR/motion.html before anything moves. For everything that the diagnosis leaves
    open, without naming it: dynident explain STUDY --design DIR.

    Example: dynident design study.toml --tell joint_zero@joint4 joint_spring@joint4 --out next
    """
    from dynident.effects import Effect, effects_of
    from dynident.experiment_design import DesignTask, MotionLimits
    from dynident.experiment_design import design as designed

    loaded = load_study(study)
    if out is not None:
        files.require_folder(out)

    def one(label: str) -> Effect:
        found = effects_of(label, loaded.robot, loaded.model.laws)
        if len(found) != 1:
            raise DesignError(f"'{label}' stands for {len(found)} effects", None, "add @JOINT")
        return found[0]

    if settings["harmonics"] is None:
        del settings["harmonics"]
    elif settings["intervals"] is not None:
        what = "--harmonics are of series, and --intervals of splines in their place"
        raise DesignError(what, remedy="choose one of them")
    tell, show, joints, loads = (settings.pop(name) for name in ("tell", "show", "joints", "loads"))
    task = DesignTask(
        **settings,
        joints=tuple(joints),
        loads=tuple(loads),
        tell=tuple(tuple(one(label) for label in pair) for pair in tell),
        show=tuple(one(label) for label in show),
    )
    bounds = MotionLimits.from_file(limits, loaded.robot) if limits else None
    with progress("designing") as told:
        answer = designed(loaded.model, loaded.train, task, limits=bounds, progress=told)
    written, notes = write_files(answer, loaded, out)
    return CommandAnswer(
        content=lambda: {**answer.to_dict(), "files": [str(one) for one in written]},
        parts=lambda: (*answer.tables(), *notes),
    )


def write_files(
    designed: RecordingDesign, study: Study, out: Path | None
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Write a design into a folder.

    Parameters
    ----------
    designed : the recording to make.
    study : for its rate and its controller.
    out : the folder; None for none.

    Returns
    -------
    The files, and what is to be said of them.
    """
    from dynident.experiment_design.design_files import write_design
    from dynident.experiment_design.written_design import MOTION_PAGE
    from dynident.reporting.pictures.motion_in_3d import design_page

    if out is None:
        return (), ()
    rate = round(study.train.recordings[0].rate_hz, 6)
    motion, shown, missing = "", "", ()
    try:
        with progress("drawing the motion"):
            page = design_page(designed)
        motion = page.html
        shown = f", {len(motion) / 1e6:.1f} MB, the motion in 3D, drawn with {page.shows}"
    except DesignError as error:  # what is to be followed is there without it
        missing = (f"No {MOTION_PAGE}: {error}",)
    written = write_design(designed, out, rate, study.controller, study.digest, motion)
    notes = [f"Written: {one}{shown * (one.name == MOTION_PAGE)}" for one in written]
    if study.controller is None:
        missing = (*missing, "No experiment.toml: the study has no [controller] to simulate with.")
    return written, (*notes, *missing)


@dataclass(frozen=True, kw_only=True)
class NextRecording:
    """The recording to make after a diagnosis; without a design, why there is none."""

    design: RecordingDesign | None = None
    notes: tuple[str, ...] = ()
    written: tuple[Path, ...] = ()

    def advised(self, diagnosis: Diagnosis) -> Diagnosis:
        """The diagnosis, with the designed recording in the place of advice in words."""
        if self.design is None:
            return diagnosis
        from dynident.experiment_design.open_questions import with_designed_advice

        return with_designed_advice(diagnosis, self.design)

    def parts(self):
        """What is shown of it, after the diagnosis."""
        return (*(self.design.tables() if self.design else ()), *self.notes)

    def content(self):
        """The same as JSON has it."""
        if self.design is None:
            return {"design": None, "notes": list(self.notes)}
        return {"design": {**self.design.to_dict(), "files": [str(one) for one in self.written]}}


def next_recording(diagnosis: Diagnosis, study: Study, out: Path) -> NextRecording:
    """Design the recording that settles what a diagnosis left open, and write it into a folder.

    Parameters
    ----------
    diagnosis : of the study.
    study : for its recordings, their rate and its controller.
    out : the folder.

    Returns
    -------
    The design; or why there is none.
    """
    from dynident.experiment_design import DesignTask
    from dynident.experiment_design import design as designed
    from dynident.experiment_design.open_questions import open_task

    if diagnosis.wiring or diagnosis.impossible:
        return NextRecording(notes=("No recording is designed before the study is mended.",))
    task = open_task(diagnosis, DesignTask(starts=1))
    if task is None:
        return NextRecording(notes=("Nothing is left open that a motion could settle.",))
    try:
        with progress("designing") as told:
            answer = designed(diagnosis.after.model, study.train, task, progress=told)
    except DynidentError as error:  # the diagnosis holds without it
        return NextRecording(notes=(f"No recording is designed: {error}",))
    written, notes = write_files(answer, study, out)
    return NextRecording(design=answer, notes=notes, written=written)
