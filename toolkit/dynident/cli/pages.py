"""The commands that write the HTML report of a diagnosis."""

from __future__ import annotations

from pathlib import Path

import click

from dynident.cli.group import commands
from dynident.cli.output import JSON, print_json, say, show
from dynident.cli.work import STUDY, diagnosis_of, load_study, require_places, write_report
from dynident.errors import FileError


@commands.command()
@STUDY
@JSON
@click.option(
    "--to", type=click.Path(path_type=Path), default=Path("report.html"), show_default=True
)
def report(study: Path, as_json: bool, to: Path) -> None:
    """Diagnose, and write the HTML report.

    Example: dynident report study.toml --to report.html
    """
    require_places(study, to)
    loaded = load_study(study)
    diagnosis = diagnosis_of(loaded)
    write_report(loaded, diagnosis, to)
    if as_json:
        print_json({"report": str(to), **diagnosis.to_dict()})
    else:
        say(diagnosis.sentence)


@commands.command()
@JSON
@click.option(
    "--to", type=click.Path(path_type=Path), default=Path("demo.report.html"), show_default=True
)
def demo(as_json: bool, to: Path) -> None:
    """Find the effect hidden in the data of an embedded two-link arm.

    Example: dynident demo
    """
    study = _demo_study()
    require_places(study, to)
    loaded = load_study(study)
    diagnosis = diagnosis_of(loaded)
    write_report(loaded, diagnosis, to)
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables(), f"The report to open: {to.resolve()}")


def _demo_study() -> Path:
    here = Path(__file__).resolve().parents[1]
    places = (here / "demo", here.parents[1] / "problems" / "hidden_effect")
    for place in places:
        if (place / "study.toml").is_file():
            return place / "study.toml"
    raise FileError("the embedded example is not installed", str(places[0]), "run it from a clone")
