"""The commands that take a robot description or an estimate."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from dynident import files
from dynident.cli.group import CommandAnswer, answered, collected, commands
from dynident.cli.output import progress
from dynident.cli.work import import_named_effects, load_study, with_effects

if TYPE_CHECKING:
    from dynident.fitting import Prior
    from dynident.refitting import RefitSubject
    from dynident.robot import Robot
    from dynident.study import Study

_PATH = click.Path(path_type=Path)


@commands.command()
@click.argument("robot", metavar="ROBOT|ESTIMATE", type=_PATH)
@click.option("--all", "every_rule", is_flag=True, help="Print the margin of every rule, too.")
@with_effects
@answered
def check(robot: Path, every_rule: bool) -> CommandAnswer:
    """Say whether a robot can exist: the margin of every rule, link by link, worst first.

    ROBOT is a robot description (URDF, SDF or MJCF), ESTIMATE a saved estimate. Exit status 1 if a
    rule is broken.

    Example: dynident check robot.urdf
    """
    from dynident.consistency import check as check_robot

    import_named_effects()
    with progress("checking"):
        found = check_robot(robot)
    return CommandAnswer(
        content=found.to_dict,
        parts=lambda: (
            *((found.margin_table(),) if every_rule else ()),
            *found.tables(),
            *(() if found.consistent else (_next_after(robot),)),
        ),
        status=0 if found.consistent else 1,
    )


def _next_after(robot: Path) -> str:
    """What to do about a robot that cannot exist."""
    kind = robot.suffix if robot.suffix != ".json" else ".urdf"
    made = shlex.join(["dynident", "refit", str(robot), "--out", f"refitted{kind}"])
    return (
        f"Next, the nearest robot that can exist: {made}\n"
        "Or fit its recordings among those that can: dynident fit STUDY --consistency full"
    )


@dataclass(frozen=True)
class _Inputs:
    """What says which parameters are refitted, and to which recordings."""

    study: Path | None
    robot: Path | None
    order: str | None

    def read(self, what: Path) -> tuple[RefitSubject, Study | None, Robot]:
        """Return the given parameters, the recordings, and the description that is the prior."""
        from dynident.refitting import aligned, read_subject
        from dynident.robot import Robot

        loaded = load_study(self.study) if self.study else None
        prior = Robot.from_file(self.robot) if self.robot else None
        if prior and loaded:
            prior = aligned(prior, loaded.robot, str(self.robot))
        # Whose parameters a CSV has, and the effects that may be among them.
        model = loaded.model if loaded else None
        if prior:
            model = replace(model, robot=prior) if model else prior
        subject = read_subject(what, model, self.order)
        return subject, loaded, prior or (loaded.robot if loaded else subject.described)


@dataclass(frozen=True)
class _Problem:
    """How near to the prior, among which robots, and who solves that."""

    consistency: Literal["full", "semi"]
    distance: Literal["quadratic", "entropic"]
    spread: float
    solver: Literal["conic", "nlp"]

    def prior(self, centre: Robot) -> Prior:
        from dynident.fitting import Prior

        return Prior(centre, self.distance, self.spread)


@commands.command()
@click.argument("what", metavar="ROBOT|ESTIMATE|CSV", type=_PATH)
@click.option("--out", type=_PATH, required=True, help="The robot description to write.")
@click.option("--study", type=_PATH, help="Recordings: move what they do not mind.")
@with_effects
@click.option("--robot", type=_PATH, help="Prior; also the description whose parameters a CSV has.")
@click.option("--order", help="Of a CSV without names: dynident or paper.")
@click.option(
    "--consistency", type=click.Choice(["full", "semi"]), default="full", show_default=True
)
@click.option(
    "--distance",
    type=click.Choice(["quadratic", "entropic"]),
    default="quadratic",
    show_default=True,
    help="From the prior.",
)
@click.option("--spread", default=0.3, show_default=True, help="Relative doubt about it.")
@click.option("--solver", type=click.Choice(["conic", "nlp"]), default="conic", show_default=True)
@answered
@collected(inputs=_Inputs, problem=_Problem)
def refit(what: Path, out: Path, inputs: _Inputs, problem: _Problem) -> CommandAnswer:
    """Write the nearest robot that can exist, and the proof that it is the nearest.

    ROBOT is a robot description (URDF, SDF or MJCF), ESTIMATE a saved estimate, CSV a list of
    parameters: columns name, value (m.link1, ...), or link, m, mx, my, mz, Ixx, ..., or numbers
    alone, ten for each joint, with --order. Inertias are about the origin of the link's frame.

    OUT is replaced only after what was written has been read back, is consistent, and moves in
    Drake and Pinocchio; it may be ROBOT itself.

    Example: dynident refit robot.urdf --out refitted.urdf
    """
    from dynident.constraints import Within
    from dynident.refitting import refit as refit_robot
    from dynident.robot.verify import require_format

    files.require_place(out)
    import_named_effects()
    subject, loaded, centre = inputs.read(what)
    require_format(subject.robot, out)
    with progress("refitting"):
        within = Within(problem.consistency)
        found = refit_robot(subject, loaded, problem.prior(centre), within, problem.solver)
    with progress("verifying"):
        verified = found.write_robot(out)
    return CommandAnswer(
        content=lambda: {"out": str(out), "verified": verified.to_dict(), **found.to_dict()},
        parts=lambda: (*found.tables(), *verified.sentences),
    )
