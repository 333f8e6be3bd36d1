"""The command that designs the next recording."""

from __future__ import annotations

from pathlib import Path

import click

from dynident import files
from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.output import progress
from dynident.cli.work import STUDY, load_study
from dynident.errors import DesignError

_PATH = click.Path(path_type=Path)


@commands.command()
@STUDY
@answered
@click.option("--duration", type=float, default=10.0, show_default=True, help="s, of a repetition.")
@click.option("--repeat", type=click.IntRange(1, 1000), default=3, show_default=True)
@click.option("--harmonics", type=click.IntRange(2, 60), default=8, show_default=True)
@click.option("--starts", type=click.IntRange(1, 100), default=2, show_default=True)
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
@click.option("--limits", type=_PATH, help="A file of limits, [joints.NAME].")
@click.option("--out", type=_PATH, help="Write reference.csv and experiment.toml here.")
def design(study: Path, limits: Path | None, out: Path | None, **settings) -> CommandAnswer:
    """Design the recording to make next: all parameters, or which of two effects it is.

    The motion keeps nine tenths of the description's limits, begins and ends at rest, and repeats.

    Example: dynident design study.toml --tell joint_zero@joint4 joint_spring@joint4 --out next
    """
    from dynident.effects import Effect, effects_of
    from dynident.experiment_design import DesignTask, MotionLimits
    from dynident.experiment_design import design as designed
    from dynident.experiment_design.design_files import write_design

    loaded = load_study(study)
    if out is not None:
        files.require_folder(out)

    def one(label: str) -> Effect:
        found = effects_of(label, loaded.robot, loaded.model.laws)
        if len(found) != 1:
            raise DesignError(f"'{label}' stands for {len(found)} effects", None, "add @JOINT")
        return found[0]

    tell, show = settings.pop("tell"), settings.pop("show")
    task = DesignTask(
        **settings,
        tell=tuple(tuple(one(label) for label in pair) for pair in tell),
        show=tuple(one(label) for label in show),
    )
    bounds = MotionLimits.from_file(limits, loaded.robot) if limits else None
    with progress("designing") as told:
        answer = designed(loaded.model, loaded.train, task, limits=bounds, progress=told)
    written: tuple[Path, ...] = ()
    if out is not None:
        rate = loaded.train.recordings[0].rate_hz
        written = write_design(answer, out, round(rate, 6), loaded.controller)
    notes = [f"Written: {one}" for one in written]
    if out is not None and loaded.controller is None:
        notes.append("No experiment.toml: the study has no [controller] to simulate with.")
    return CommandAnswer(
        content=lambda: {**answer.to_dict(), "files": [str(one) for one in written]},
        parts=lambda: (*answer.tables(), *notes),
    )
