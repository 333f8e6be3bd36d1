"""The commands that take a robot description or an estimate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import click

from dynident import files
from dynident.cli.group import commands
from dynident.cli.output import JSON, print_json, progress, show

_PATH = click.Path(path_type=Path)


@commands.command()
@click.argument("robot", metavar="ROBOT|ESTIMATE", type=_PATH)
@click.option("--all", "every_rule", is_flag=True, help="Print the margin of every rule, too.")
@JSON
@click.pass_context
def check(context: click.Context, robot: Path, every_rule: bool, as_json: bool) -> None:
    """Say whether a robot can exist: the margin of every rule, link by link, worst first.

    ROBOT is a robot description (URDF, SDF or MJCF), ESTIMATE a saved estimate. Exit status 1 if a
    rule is broken.

    Example: dynident check robot.urdf
    """
    from dynident.consistency import check as check_robot

    with progress("checking"):
        found = check_robot(robot)
    if as_json:
        print_json(found.to_dict())
    else:
        show(*((found.margin_table(),) if every_rule else ()), *found.tables())
    context.exit(0 if found.consistent else 1)


@commands.command()
@click.argument("what", metavar="ROBOT|ESTIMATE|CSV", type=_PATH)
@click.option("--out", type=_PATH, required=True, help="The robot description to write.")
@click.option("--study", type=_PATH, help="Recordings: move what they do not mind.")
@click.option(
    "--robot", type=_PATH, help="Description that is believed in, and whose parameters a CSV has."
)
@click.option("--order", help="Of a CSV without names: dynident or paper.")
@click.option(
    "--consistency", type=click.Choice(["full", "semi"]), default="full", show_default=True
)
@click.option(
    "--distance",
    type=click.Choice(["quadratic", "entropic"]),
    default="quadratic",
    show_default=True,
    help="From the description that is believed in.",
)
@click.option("--spread", default=0.3, show_default=True, help="Relative doubt about it.")
@click.option("--solver", type=click.Choice(["conic", "nlp"]), default="conic", show_default=True)
@JSON
def refit(
    what: Path,
    out: Path,
    study: Path | None,
    robot: Path | None,
    order: str | None,
    consistency: Literal["full", "semi"],
    distance: Literal["quadratic", "entropic"],
    spread: float,
    solver: Literal["conic", "nlp"],
    as_json: bool,
) -> None:
    """Write the nearest robot that can exist, and the proof that it is the nearest.

    ROBOT is a robot description (URDF, SDF or MJCF), ESTIMATE a saved estimate, CSV a list of
    parameters: columns name, value (m.link1, ...), or link, m, mx, my, mz, Ixx, ..., or numbers
    alone, ten for each joint, with --order. Inertias are about the origin of the link's frame.

    OUT is replaced only after what was written has been read back, is consistent, and moves in
    Drake and Pinocchio; it may be ROBOT itself.

    Example: dynident refit robot.urdf --out mended.urdf
    """
    from dynident.constraints import Within
    from dynident.fitting import Prior
    from dynident.refitting import aligned, read_subject
    from dynident.refitting import refit as refit_robot
    from dynident.robot import Robot
    from dynident.robot.verify import require_format
    from dynident.study import load

    files.require_place(out)
    with progress("reading"):
        loaded = load(study) if study else None
        believed = Robot.from_file(robot) if robot else None
        if believed and loaded:
            believed = aligned(believed, loaded.robot, str(robot))
        # Whose parameters a CSV has, and the effects that may be among them.
        model = loaded.model if loaded else None
        if believed:
            model = replace(model, robot=believed) if model else believed
        subject = read_subject(what, model, order)
    require_format(subject.robot, out)
    with progress("refitting"):
        centre = believed or (loaded.robot if loaded else subject.described)
        prior = Prior(centre, distance, spread)
        found = refit_robot(subject, loaded, prior, Within(consistency), solver)
    with progress("verifying"):
        verified = found.write_robot(out)
    if as_json:
        content = {"out": str(out), "verified": verified.to_dict(), **found.to_dict()}
        print_json(content)
    else:
        show(*found.tables(), *verified.sentences)
