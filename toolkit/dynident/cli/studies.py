"""The commands that take a study and its recordings."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Literal

import click

from dynident.cli.group import commands
from dynident.cli.methods import Chosen, method_options
from dynident.cli.output import JSON, print_json, progress, show
from dynident.cli.work import (
    STUDY,
    comparison_of,
    diagnosis_of,
    load_study,
    require_picture,
    require_places,
    write_report,
)
from dynident.errors import DynidentWarning, StudyError


@commands.command()
@STUDY
@JSON
@click.option("--report", type=click.Path(path_type=Path), help="Also write this HTML report.")
def explain(study: Path, as_json: bool, report: Path | None) -> None:
    """Run the whole loop: compare, diagnose, add, refit, compare. The study stays as it is.

    Example: dynident explain study.toml --report report.html
    """
    require_places(study, report)
    loaded = load_study(study)
    diagnosis = diagnosis_of(loaded)
    write_report(loaded, diagnosis, report)
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables(), diagnosis.after.parameter_table())


@commands.command()
@STUDY
@JSON
def diagnose(study: Path, as_json: bool) -> None:
    """Say where the model fails and which effects it lacks.

    Example: dynident diagnose study.toml --json
    """
    diagnosis = diagnosis_of(load_study(study))
    if as_json:
        print_json(diagnosis.to_dict())
    else:
        show(*diagnosis.tables())


@commands.command()
@STUDY
@JSON
@click.option("--out", type=click.Path(path_type=Path), help="Also save the estimate as JSON.")
@click.option(
    "--robot", type=click.Path(path_type=Path), help="Also write the robot description identified."
)
@click.option("--ordinary", is_flag=True, help="Ordinary least squares: joints not weighted.")
@click.option("--essential", is_flag=True, help="Also list the essential parameters.")
@click.option(
    "--identifiability",
    is_flag=True,
    help="Of factors and bayes: fit again from other starts and with other reliabilities of the "
    "inputs, which tells what the data do not (about 12 times as long).",
)
@click.option(
    "--consistency",
    type=click.Choice(["full", "semi", "none"]),
    default="none",
    show_default=True,
    help="Fit among the robots that can exist (full), with the description as a prior.",
)
@method_options
@click.option(
    "--plot", type=click.Path(path_type=Path), help="Also write this picture of iv's iterations."
)
def fit(
    study: Path,
    as_json: bool,
    out: Path | None,
    robot: Path | None,
    ordinary: bool,
    essential: bool,
    identifiability: bool,
    consistency: Literal["full", "semi", "none"],
    chosen: Chosen,
    plot: Path | None,
) -> None:
    """Identify the parameters from the training recordings.

    With --method iv the instruments come from the simulated loop of the study's [controller]; the
    iterations are in the output. Exit status 0 even where they do not converge: the output says so.

    Example: dynident fit study.toml --out estimate.json --robot identified.urdf
    """
    from dynident.constraints import Within
    from dynident.fitting import Constrained, essential_parameters, rows
    from dynident.fitting import fit as fit_model
    from dynident.moments import factorise

    if chosen.method != "least-squares" and consistency != "none":
        what = f"--consistency goes with least squares, not with --method {chosen.method}"
        raise click.UsageError(what)
    if ordinary and chosen.method not in ("least-squares", "iv"):
        raise click.UsageError(f"--ordinary does not go with --method {chosen.method}")
    if plot is not None and chosen.method != "iv":
        raise click.UsageError("--plot goes with --method iv")
    if identifiability:
        chosen.require_unknown_noise()
    require_places(study, out, robot, plot)
    require_picture(plot)
    loaded = load_study(study)
    with progress("fitting") as show_progress:
        weighting = "none" if ordinary else "joint"
        method = chosen.estimator(loaded, weighting, show_progress)
        if consistency != "none":
            method = Constrained(Within(consistency), weighting=weighting)
        estimate = fit_model(loaded.model, loaded.train, method)
        tables, result = list(estimate.tables()), estimate.to_dict()
        if identifiability:
            starts, profile = chosen.identifiability(loaded)
            tables += [starts.table(), profile.table()]
            result["identifiability"] = {"starts": starts.to_dict(), "profile": profile.to_dict()}
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
    if plot is not None and estimate.history is not None:
        from dynident.reporting.pictures.convergence import convergence
        from dynident.reporting.pictures.plots import save

        save(convergence(estimate.history), plot)
        click.echo(f"picture: {plot}", err=True)
    if as_json:
        print_json(result)
    else:
        show(*tables)


@commands.command()
@STUDY
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
    loaded = load_study(study)
    comparison = comparison_of(loaded, additions)
    if as_json:
        print_json(comparison.to_dict())
    else:
        show(*comparison.tables())


@commands.command()
@STUDY
@click.argument("effect", metavar="EFFECT[@JOINT[:SOURCE]]")
@JSON
def add(study: Path, effect: str, as_json: bool) -> None:
    """Write an effect into the study file; print the error before and after.

    Example: dynident add study.toml stribeck_friction@elbow
    """
    from dynident.effects import effects_of
    from dynident.study import add_effects

    loaded = load_study(study)
    effects = effects_of(effect, loaded.robot)
    fresh = tuple(one for one in effects if one not in loaded.model)
    if not fresh:
        raise StudyError(f"has {effect} already", str(study), "nothing was changed")
    if any("payload" in one.needs for one in fresh):
        recordings = (loaded.train + loaded.test).recordings
        if not any(r.payload for r in recordings):
            remedy = "set payload = true in the [[recordings]] that carry it"
            raise StudyError("no recording carries a payload", str(study), remedy)
    comparison = comparison_of(loaded, (effect,))
    add_effects(study, fresh)
    if as_json:
        print_json({"added": [one.label for one in fresh], **comparison.to_dict()})
    else:
        show(*comparison.tables()[:1], f"Written into {study}.")
