"""The command that compares two estimates of one robot."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dynident import files
from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.output import progress
from dynident.cli.work import command_line, import_named_effects, load_study, with_effects
from dynident.errors import StudyError

if TYPE_CHECKING:
    from dynident.fitting.estimate import Estimate
    from dynident.study import Study

_PATH = click.Path(path_type=Path)


@commands.command()
@click.argument("before", type=_PATH)
@click.argument("after", type=_PATH)
@click.option("--study", type=_PATH, help="Judge both by the test recordings of this study, too.")
@click.option("--to", type=_PATH, help="Also write this HTML page.")
@with_effects
@answered
def changes(before: Path, after: Path, study: Path | None, to: Path | None) -> CommandAnswer:
    """Say what has changed between two estimates of one robot, beyond their joint uncertainty.

    The estimates are files of `dynident fit --out`, from different recordings. What both have is
    compared; effects that one of them has alone are listed, with values and intervals.

    Example: dynident changes yesterday.json today.json --to changes.html
    """
    if to is not None:
        files.require_place(to)
    from dynident.fitting.comparing.between_estimates import estimate_changes
    from dynident.fitting.estimate_file import load_estimate

    import_named_effects()
    loaded = None if study is None else load_study(study, to)  # with the effects that it names
    with progress("reading"):
        estimates = {"before": load_estimate(before), "after": load_estimate(after)}
    if loaded is not None:
        _require_held_out(loaded, estimates.values())
    found = estimate_changes(estimates["before"], estimates["after"])
    content, errors = found.to_dict(), ()
    if loaded is not None:
        from dynident.evidence import compare

        with progress("judging"):
            judged = compare(estimates, loaded.test, criteria=loaded.criteria)
        content, errors = {**content, "held_out": judged.to_dict()}, judged.tables()[:1]
    if to is not None:
        from dynident.reporting.changes_page import changes_report

        name = estimates["after"].model.robot.name
        changes_report(found, to, robot=name, errors=errors, command=command_line())
        click.echo(f"report: {to}", err=True)
    return CommandAnswer(content=lambda: content, parts=lambda: (*found.tables(), *errors))


def _require_held_out(study: Study, estimates: Iterable[Estimate]) -> None:
    """Refuse to judge estimates by recordings that one of them was fitted to."""
    fitted = {source.sha256 for one in estimates for source in one.sources} - {""}
    for recording in study.test.recordings:
        if recording.provenance.sha256 in fitted:
            what = f"an estimate was fitted to {recording.name}, a test recording of this study"
            remedy = "name a study whose test recordings neither estimate has seen"
            raise StudyError(what, str(study.path), remedy)
