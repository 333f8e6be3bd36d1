"""The command that simulates closed loops: virtual measurements, or recordings once more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.methods import Chosen, method_options, require_rate
from dynident.cli.output import progress
from dynident.cli.work import (
    TRUST,
    command_line,
    load_study,
    permitted,
    require_picture,
    require_places,
)
from dynident.errors import StudyError

if TYPE_CHECKING:
    from dynident.closed_loop import Controller
    from dynident.fitting import Estimate
    from dynident.recording import Dataset
    from dynident.study import Study
    from dynident.validation import Validation

_PATH = click.Path(path_type=Path)
_OF_EXPERIMENTS = {"nominal", "seed", "lead_in", "sensors"}
_OF_STUDIES = {"filter", "noise", "columns"}


@commands.command()
@click.argument("file", metavar="STUDY|EXPERIMENT", type=_PATH)
@TRUST
@click.option("--estimate", type=_PATH, help="Simulate this saved estimate; default: fit.")
@click.option("--recording", help="Only this one; default: those for testing.")
@click.option("--report", type=_PATH, help="Also write this HTML report.")
@click.option("--plot", type=_PATH, help="Also write this picture (.png, .svg or .pdf).")
@click.option("--out", type=_PATH, help="Of an experiment: folder for what is written.")
@method_options
@answered
def simulate(
    file: Path,
    estimate: Path | None,
    recording: str | None,
    report: Path | None,
    plot: Path | None,
    out: Path | None,
    chosen: Chosen,
) -> CommandAnswer:
    """Simulate the identified robot in the loop that was recorded, and compare the motion.

    STUDY needs a [controller], and recordings with their reference (q_ref). Errors of position,
    velocity, acceleration and torque are relative.

    Exit status 1 if a loop could not be simulated, the stated controller is not the one that ran,
    or the simulated loop is no nearer to the measurement than its reference.

    Of an EXPERIMENT it makes virtual measurements: recordings, and a study that hides what is
    hidden (dynident simulate experiment.toml --out virtual/).

    Example: dynident simulate study.toml --report loop.html
    """
    only_studies = {"estimate": estimate, "recording": recording, "report": report, "plot": plot}
    if _kind(file) == "experiment":
        given = [name for name, value in only_studies.items() if value is not None]
        if given:
            raise click.UsageError(f"--{given[0]} is for a study, and {file} is an experiment")
        if out is None:
            raise click.UsageError(f"{file} is an experiment: name a folder with --out")
        return _make(file, out)
    if out is not None:
        raise click.UsageError(
            f"--out is for an experiment, and {file} is a study (no recording has a duration)"
        )
    require_places(file, report, plot)
    require_picture(plot)
    if estimate is not None and chosen.method != "least-squares":
        raise click.UsageError("--estimate is there already: leave out --method")
    study = load_study(file, report, plot)
    recordings, used = _recordings(study, recording)
    controller = _controller(study, recordings)
    found = _validation(study, _estimate(study, estimate, chosen), recordings, controller)
    _write(found, report, plot)
    words = {"train": ("No recording is for testing: these are the training recordings.",)}
    failed = any(one.status != "no_reference" for one in found.skipped)
    return CommandAnswer(
        content=lambda: {"recordings_used": used, **found.to_dict()},
        parts=lambda: (*found.tables(), *words.get(used, ())),
        status=1 if failed or found.verdict != "follows" else 0,
    )


def _make(file: Path, out: Path) -> CommandAnswer:
    """Make virtual measurements."""
    from dynident.closed_loop import load_experiment, write_experiment

    loaded = permitted(lambda modules: load_experiment(file, modules=modules))
    with progress("simulating") as show_progress:
        written = write_experiment(loaded, out, progress=show_progress)
    paths = tuple(map(str, written))
    return CommandAnswer(content=lambda: {"written": list(paths)}, lines=paths)


def _kind(path: Path) -> Literal["study", "experiment"]:
    """Tell a study from an experiment by the keys that only one of them has."""
    from dynident.settings import parse_toml

    said = parse_toml(path)
    entries = [one for one in _listed(said.get("recordings")) if isinstance(one, dict)]
    effects = _listed(said.get("effects"))
    experiment = _OF_EXPERIMENTS & set(said)
    experiment |= {key for one in entries for key in {"duration", "trajectory"} & set(one)}
    experiment |= {"[[effects]]" for one in effects if isinstance(one, dict)}
    study = _OF_STUDIES & set(said)
    study |= {key for one in entries for key in {"window", "record"} & set(one)}
    if experiment and study:
        what = f"is no study ({min(experiment)}) and no experiment ({min(study)})"
        raise StudyError(what, str(path), "leave out the keys of one of the two")
    return "experiment" if experiment else "study"


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _recordings(study: Study, name: str | None) -> tuple[Dataset, str]:
    """Recordings to simulate, and which they are: test, train or named."""
    if name is not None:
        every = study.train + study.test
        chosen = tuple(r for r in every.recordings if r.name == name)
        if not chosen:
            names = ", ".join(dict.fromkeys(r.name for r in every.recordings))
            raise StudyError(f"no recording '{name}'", str(study.path), f"recordings: {names}")
        return replace(every, recordings=chosen), "named"
    if any(r.q_ref is not None for r in study.test.recordings):
        return study.test, "test"
    return study.train, "train"


def _controller(study: Study, recordings: Dataset) -> Controller:
    """The study's controller, if the loop can be simulated with what the study says."""
    path, names = study.path, study.robot.names
    if study.controller is None:
        remedy = "state the one that ran: kind, gains, rate_hz"
        raise StudyError("has no [controller], so that its loop is not known", str(path), remedy)
    require_rate(study, study.controller)
    if all(r.q_ref is None for r in recordings.recordings):
        column = f"q_ref.{names[0]}" if len(names) == 1 else "q_ref.<joint>"
        what = f"no recording has the reference that the controller followed, {column}"
        remedy = "record it, or map it to the column that has it in [columns]"
        raise StudyError(what, str(path), remedy)
    return study.controller


def _estimate(study: Study, saved: Path | None, chosen: Chosen) -> Estimate:
    from dynident.fitting import fit, load_estimate

    if saved is None:
        with progress("fitting") as show_progress:
            method = chosen.estimator(study, "joint", show_progress)
            return fit(study.model, study.train, method)
    found = load_estimate(saved)
    if found.model.robot.names != study.robot.names:
        theirs, ours = ", ".join(found.model.robot.names), ", ".join(study.robot.names)
        what = f"is of a robot with the joints {theirs}, and the study's has {ours}"
        raise StudyError(what, str(saved), "name an estimate of the same robot")
    return found


def _validation(
    study: Study, estimate: Estimate, recordings: Dataset, controller: Controller
) -> Validation:
    from dynident.validation import validate

    with progress("simulating") as show_progress:
        return validate(
            estimate,
            recordings,
            controller,
            criteria=study.criteria,
            progress=lambda done, total: show_progress(f"{done:.1f} of {total:.1f} s", done, total),
        )


def _write(found: Validation, report: Path | None, plot: Path | None) -> None:
    if report is not None:
        from dynident.reporting import report as write

        write(found, to=report, command=command_line())
        click.echo(f"report: {report}", err=True)
    if plot is not None and not found.runs:
        click.echo(f"no picture {plot}: no loop could be simulated", err=True)
    elif plot is not None:
        from dynident.reporting.pictures.loop_plots import simulated_loop
        from dynident.reporting.pictures.plots import save

        save(simulated_loop(found), plot)
        click.echo(f"picture: {plot}", err=True)
