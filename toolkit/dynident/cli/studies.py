"""The commands that take a study or an experiment."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from dynident import files
from dynident.cli.group import commands
from dynident.cli.output import JSON, print_json, progress, say, show
from dynident.errors import DynidentWarning, FileError, StudyError

if TYPE_CHECKING:
    from dynident.diagnose import Diagnosis
    from dynident.study import Study

_STUDY = click.argument("study", type=click.Path(path_type=Path))


@commands.command()
@_STUDY
@JSON
@click.option("--report", type=click.Path(path_type=Path), help="Also write this HTML report.")
def explain(study: Path, as_json: bool, report: Path | None) -> None:
    """Run the whole loop: compare, diagnose, add, refit, compare. The study stays as it is.

    Example: dynident explain study.toml --report report.html
    """
    _require_places(study, report)
    diagnosis = _diagnosis(_load(study))
    _write_report(diagnosis, report)
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables(), diagnosis.after.parameter_table())


@commands.command()
@_STUDY
@JSON
def diagnose(study: Path, as_json: bool) -> None:
    """Say where the model fails and which effects it lacks.

    Example: dynident diagnose study.toml --json
    """
    diagnosis = _diagnosis(_load(study))
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables())


@commands.command()
@_STUDY
@JSON
@click.option("--out", type=click.Path(path_type=Path), help="Also save the estimate as JSON.")
@click.option(
    "--robot", type=click.Path(path_type=Path), help="Also write the robot description identified."
)
@click.option("--ordinary", is_flag=True, help="Ordinary least squares: joints not weighted.")
@click.option("--essential", is_flag=True, help="Also list the essential parameters.")
@click.option(
    "--consistency",
    type=click.Choice(["full", "semi", "none"]),
    default="none",
    show_default=True,
    help="Fit among the robots that can exist (full), with the description as a prior.",
)
def fit(
    study: Path,
    as_json: bool,
    out: Path | None,
    robot: Path | None,
    ordinary: bool,
    essential: bool,
    consistency: Literal["full", "semi", "none"],
) -> None:
    """Identify the parameters from the training recordings.

    Example: dynident fit study.toml --out estimate.json --robot identified.urdf
    """
    from dynident.fit import Constrained, LeastSquares, essential_parameters, factorise, rows
    from dynident.fit import fit as fit_model
    from dynident.nlp import Within

    _require_places(study, out, robot)
    loaded = _load(study)
    with progress("fitting"):
        weighting = "none" if ordinary else "joint"
        method = LeastSquares(weighting)
        if consistency != "none":
            method = Constrained(Within(consistency), weighting=weighting)
        estimate = fit_model(loaded.model, loaded.train, method)
        tables, result = list(estimate.tables()), estimate.to_dict()
        if essential:
            factors = factorise(rows(estimate.model, loaded.train, estimate.values))
            found = essential_parameters(estimate.model, factors)
            tables.append(found.table())
            result["essential"] = list(found.names)
    if out:
        estimate.save(out)
    if robot:
        estimate.write_robot(robot)
        broken = estimate.inconsistent_links()
        if broken:
            warnings.warn(
                f"{robot}: no rigid body can have the parameters of {', '.join(broken)}. What the "
                "data cannot tell was left as given",
                DynidentWarning,
                stacklevel=1,
            )
    if as_json:
        print_json(result)
    else:
        show(*tables)


@commands.command()
@_STUDY
@JSON
@click.option(
    "--with",
    "additions",
    multiple=True,
    metavar="EFFECT[@JOINT]",
    help="Compare with the model that has this effect too; may be repeated.",
)
def compare(study: Path, as_json: bool, additions: tuple[str, ...]) -> None:
    """Compare the model with measurements that it was not fitted to.

    Example: dynident compare study.toml --with stribeck_friction@elbow
    """
    loaded = _load(study)
    comparison = _comparison(loaded, additions)
    if as_json:
        print_json(comparison.to_dict())
    else:
        show(*comparison.tables())


@commands.command()
@_STUDY
@click.argument("effect", metavar="EFFECT[@JOINT[:SOURCE]]")
@JSON
def add(study: Path, effect: str, as_json: bool) -> None:
    """Write an effect into the study file; print the error before and after.

    Example: dynident add study.toml stribeck_friction@elbow
    """
    from dynident.effects import effects_of
    from dynident.study import add_effects

    loaded = _load(study)
    effects = effects_of(effect, loaded.robot)
    fresh = tuple(one for one in effects if one not in loaded.model)
    if not fresh:
        raise StudyError(f"has {effect} already", str(study), "nothing was changed")
    if any("payload" in one.needs for one in fresh):
        recordings = (loaded.train + loaded.test).recordings
        if not any(r.payload for r in recordings):
            mend = "set payload = true in the [[recordings]] that carry it"
            raise StudyError("no recording carries a payload", str(study), mend)
    comparison = _comparison(loaded, (effect,))
    add_effects(study, fresh)
    if as_json:
        print_json({"added": [one.label for one in fresh], **comparison.to_dict()})
    else:
        show(*comparison.tables()[:1], f"Written into {study}.")


@commands.command()
@click.argument("experiment", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), required=True, help="Folder for what is written."
)
@JSON
def simulate(experiment: Path, out: Path, as_json: bool) -> None:
    """Make virtual measurements: recordings and a study that hides what is hidden.

    Example: dynident simulate experiment.toml --out virtual/
    """
    from dynident.closed_loop import load_experiment, write_experiment

    loaded = load_experiment(experiment)
    with progress("simulating") as tell:
        written = write_experiment(loaded, out, progress=tell)
    if as_json:
        print_json({"written": [str(path) for path in written]})
    else:
        say(*map(str, written))


@commands.command()
@_STUDY
@JSON
@click.option(
    "--to", type=click.Path(path_type=Path), default=Path("report.html"), show_default=True
)
def report(study: Path, as_json: bool, to: Path) -> None:
    """Diagnose, and write the HTML report.

    Example: dynident report study.toml --to report.html
    """
    _require_places(study, to)
    diagnosis = _diagnosis(_load(study))
    _write_report(diagnosis, to)
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
    _require_places(study, to)
    diagnosis = _diagnosis(_load(study))
    _write_report(diagnosis, to)
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables(), f"The report to open: {to.resolve()}")


def _require_places(study: Path, *paths: Path | None) -> None:
    """Refuse files that could not be written, before the work that they are to hold is done."""
    for path in paths:
        if path is None:
            continue
        files.require_place(path)
        if path.resolve() == study.resolve():
            raise FileError("is the study itself", str(path), "write to another file")


def _load(path: Path) -> Study:
    from dynident.study import load

    with progress("reading"):
        return load(path)


def _diagnosis(study: Study) -> Diagnosis:
    from dynident.diagnose import diagnose as search

    with progress("diagnosing") as tell:
        return search(study.model, study.train, study.test, tell=tell)


def _comparison(study: Study, additions: tuple[str, ...]):
    from dynident.diagnose import compare_models

    models = {"study": study.model}
    for label in additions:
        model = study.model
        for effect in _missing(label, study):
            model = model + effect
        models[f"+ {label}"] = model
    with progress("comparing"):
        return compare_models(models, study.train, study.test)


def _missing(label: str, study: Study):
    from dynident.effects import effects_of

    return [effect for effect in effects_of(label, study.robot) if effect not in study.model]


def _write_report(diagnosis: Diagnosis, to: Path | None) -> None:
    if to is None:
        return
    from dynident.report import report as write

    write(diagnosis, to=to, command=" ".join(["dynident", *sys.argv[1:]]))
    click.echo(f"report: {to}", err=True)


def _demo_study() -> Path:
    here = Path(__file__).resolve().parents[1]
    places = (here / "demo", here.parents[1] / "problems" / "hidden_effect")
    for place in places:
        if (place / "study.toml").is_file():
            return place / "study.toml"
    raise FileError("the embedded example is not installed", str(places[0]), "run it from a clone")
