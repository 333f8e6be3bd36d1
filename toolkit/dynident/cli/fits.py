"""The command that identifies parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from dynident.cli.group import CommandAnswer, answered, collected, commands
from dynident.cli.methods import Chosen, method_options
from dynident.cli.output import progress
from dynident.cli.work import STUDY, load_study, require_picture, require_places, with_drives

if TYPE_CHECKING:
    from dynident.fitting import Estimate, Method
    from dynident.study import Study
    from dynident.tables import Table

_PATH = click.Path(path_type=Path)


@dataclass(frozen=True)
class _Files:
    """Where results are written; None for nowhere."""

    out: Path | None
    robot: Path | None
    plot: Path | None

    def require(self, study: Path) -> None:
        """Refuse what could not be written, before the work is done."""
        require_places(study, self.out, self.robot, self.plot)
        require_picture(self.plot)

    @property
    def said(self) -> tuple[str, ...]:
        """What the description that was written does not hold."""
        if self.robot is None:
            return ()
        return (f"{self.robot} has the rigid bodies alone: friction and other effects stay out.",)

    def write(self, estimate: Estimate) -> None:
        """Write the estimate, its robot, and the picture of its iterations."""
        if self.out:
            estimate.save(self.out)
        if self.robot:
            estimate.write_robot(self.robot)
        if self.plot is not None and estimate.history is not None:
            from dynident.reporting.pictures.convergence import convergence
            from dynident.reporting.pictures.plots import save

            save(convergence(estimate.history), self.plot)
            click.echo(f"picture: {self.plot}", err=True)


@dataclass(frozen=True)
class _Kind:
    """Which estimate is asked for, beside its method."""

    ordinary: bool
    consistency: Literal["full", "semi", "none"]

    def require(self, chosen: Chosen) -> None:
        """Refuse what does not go with the method."""
        if chosen.method != "least-squares" and self.consistency != "none":
            what = f"--consistency goes with least squares, not with --method {chosen.method}"
            raise click.UsageError(what)
        if self.ordinary and chosen.method not in ("least-squares", "iv"):
            raise click.UsageError(f"--ordinary does not go with --method {chosen.method}")

    def method(self, chosen: Chosen, study: Study, show_progress: Callable[..., Any]) -> Method:
        """Return the estimator."""
        from dynident.constraints import Within
        from dynident.fitting import Constrained

        weighting = "none" if self.ordinary else "joint"
        method = chosen.estimator(study, weighting, show_progress)
        if self.consistency == "none":
            return method
        return Constrained(Within(self.consistency), weighting=weighting)


@dataclass(frozen=True)
class _More:
    """What is asked for beside the estimate."""

    essential: bool
    identifiability: bool

    def of(
        self, estimate: Estimate, chosen: Chosen, study: Study
    ) -> tuple[list[Table], dict[str, Any]]:
        """Return it as tables, and by the keys of its JSON."""
        from dynident.fitting import essential_parameters, rows
        from dynident.moments import factorise

        tables, content = [], {}
        if self.identifiability:
            starts, profile = chosen.identifiability(study)
            tables += [starts.table(), profile.table()]
            content["identifiability"] = {"starts": starts.to_dict(), "profile": profile.to_dict()}
        if self.essential:
            factors = factorise(rows(estimate.model, study.train, estimate.values))
            found = essential_parameters(estimate.model, factors)
            tables.append(found.table())
            content["essential"] = list(found.names)
        return tables, content


@commands.command()
@STUDY
@answered
@click.option("--out", type=_PATH, help="Also save the estimate as JSON.")
@click.option("--robot", type=_PATH, help="Also write the robot description identified.")
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
@click.option("--plot", type=_PATH, help="Also write this picture of iv's iterations.")
@collected(kind=_Kind, more=_More, to=_Files)
def fit(study: Path, chosen: Chosen, kind: _Kind, more: _More, to: _Files) -> CommandAnswer:
    """Identify the parameters from the training recordings.

    With --method iv the instruments come from the simulated loop of the study's [controller]; the
    iterations are in the output. Exit status 0 even where they do not converge: the output says so.

    Example: dynident fit study.toml --out estimate.json --robot identified.urdf
    """
    from dynident.fitting import fit as fit_model
    from dynident.fitting.drive_gains import with_gain_errors
    from dynident.robot.verify import require_format
    from dynident.wiring import check_wiring

    kind.require(chosen)
    if to.plot is not None and chosen.method != "iv":
        raise click.UsageError("--plot goes with --method iv")
    if more.identifiability:
        chosen.require_unknown_noise()
    to.require(study)
    loaded = load_study(study, to.out, to.robot, to.plot)
    if to.robot is not None:
        require_format(loaded.robot, to.robot)
    with progress("fitting") as show_progress:
        method = kind.method(chosen, loaded, show_progress)
        estimate = fit_model(loaded.model, loaded.train, method)
        if loaded.drives is not None:
            estimate = with_gain_errors(estimate, loaded.drives)
        wiring = check_wiring(loaded.model, loaded.train, loaded.test, loaded.criteria.wiring)
        said = (f"Wiring: {fault.sentence}" for fault in wiring)
        estimate = replace(estimate, notes=(*said, *estimate.notes))
        tables, content = more.of(estimate, chosen, loaded)
    to.write(estimate)
    answer = CommandAnswer(
        content=lambda: (
            estimate.to_dict() | {"wiring": [fault.to_dict() for fault in wiring]} | content
        ),
        parts=lambda: (*estimate.tables(), *tables, *to.said),
    )
    return with_drives(loaded, answer)
