"""The commands that take a robot description or an estimate."""

from __future__ import annotations

from pathlib import Path

import click

from dynident.cli.group import commands
from dynident.cli.output import JSON, print_json, progress, show


@commands.command()
@click.argument("robot", metavar="ROBOT|ESTIMATE", type=click.Path(path_type=Path))
@JSON
@click.pass_context
def check(context: click.Context, robot: Path, as_json: bool) -> None:
    """Say whether a robot can exist: the margin of every rule, link by link, worst first.

    ROBOT is a robot description (URDF, SDF or MJCF), ESTIMATE a saved estimate. Exit status 1 if a
    rule is broken.

    Example: dynident check robot.urdf
    """
    from dynident.check import check as check_robot

    with progress("checking"):
        found = check_robot(robot)
    if as_json:
        print_json(found.to_dict())
    else:
        show(*found.tables())
    context.exit(0 if found.consistent else 1)
