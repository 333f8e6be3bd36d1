"""The command that begins with files, not with a study."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dynident import files
from dynident.cli.group import CommandAnswer, answered, collected, commands
from dynident.cli.output import progress
from dynident.errors import FileError
from dynident.tables import printable

if TYPE_CHECKING:
    from dynident.study_draft import CarriedLoad, Decision, LogFacts

_PATH = click.Path(path_type=Path)


@dataclass(frozen=True)
class _Told:
    """What the files do not say and somebody knows."""

    joints: str | None
    gears: str | None
    columns: tuple[str, ...]
    rate_hz: float | None
    topic: str
    loads: tuple[str, ...]

    def read(self) -> LogFacts:
        """As `draft_study` takes it."""
        from dynident.study_draft import LogFacts

        return LogFacts(
            joints=[name.strip() for name in self.joints.split(",")] if self.joints else None,
            gears=_numbers(self.gears) if self.gears else None,
            columns=_all_stated(self.columns),
            rate_hz=self.rate_hz,
            topic=self.topic,
            loads=tuple(_load(one) for one in self.loads),
        )


@commands.command()
@click.argument("robot", type=_PATH)
@click.argument("data", nargs=-1, required=True)
@click.option("--out", type=_PATH, default=Path("study.toml"), show_default=True)
@click.option("--joints", help="Joints that were recorded, in order, with commas between them.")
@click.option("--rate", "rate_hz", type=float, help="Hz, of files without a column of time.")
@click.option("--gears", help="Ratios, where columns are of the motors' side: 32,32,45,-48,45,32.")
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME=EXPRESSION",
    help="What one of our columns is: a column whose name does not say so, or what a motor that "
    "turns two joints makes: 'q.joint6 = motor[5]/32 - motor[4]/45'; torques follow. Repeatable.",
)
@click.option("--topic", default="", help="Of bags that hold joint states on several.")
@click.option(
    "--load",
    "loads",
    multiple=True,
    metavar="FILES[=KG]",
    help="Files that carry a load, and its mass: 'run_load_*=2.8'; may be repeated.",
)
@answered
@collected(told=_Told)
def init(robot: Path, data: tuple[str, ...], out: Path, told: _Told) -> CommandAnswer:
    """Draft a study from a robot description and files of measurements.

    Columns are matched to joints; units, gear side and signs are compared with the description.
    On a terminal it asks where the files leave something open, else it takes what is likeliest.
    The study that it writes says what was decided, and why.

    Example: dynident init arm.urdf runs/*.csv --out study.toml
    """
    from dynident.study_draft import draft_study

    files.require_place(out)
    if out.exists():
        raise FileError("is there already", str(out), "name another file with --out, or remove it")
    ask = _ask if sys.stdin.isatty() and sys.stderr.isatty() else None
    if ask is not None:  # a bar would be drawn over the questions
        draft = draft_study(robot, data, facts=told.read(), ask=ask)
    else:
        with progress("reading"):
            draft = draft_study(robot, data, facts=told.read())
    draft.write(out)
    return CommandAnswer(
        content=lambda: {"out": str(out), **draft.to_dict()},
        parts=lambda: (
            draft.decision_table(),
            *([draft.open_question] if ask is None and draft.open_question else []),
            f"Written: {out}. Read it, then: {draft.next_command} {out}",
        ),
    )


def _numbers(text: str) -> list[float]:
    """The numbers of an option."""
    try:
        return [float(one) for one in text.split(",")]
    except ValueError:
        raise click.BadParameter(
            f"'{text}' holds what is no number", param_hint="--gears"
        ) from None


def _all_stated(options: tuple[str, ...]) -> dict[str, str]:
    """Our columns and what they are made of."""
    found: dict[str, str] = {}
    for ours, theirs in map(_stated, options):
        if ours in found:
            raise click.BadParameter(f"{ours} is stated twice", param_hint="--column")
        found[ours] = theirs
    return found


def _stated(text: str) -> tuple[str, str]:
    """One of our columns and what it is made of."""
    ours, _, theirs = text.partition("=")
    if not ours.strip() or not theirs.strip():
        raise click.BadParameter(
            f"'{text}' is not as in 'q.joint6 = motor[5]/32'", param_hint="--column"
        )
    return ours.strip(), theirs.strip()


def _load(text: str) -> CarriedLoad:
    """A load, of `FILES=KG` or `FILES`."""
    from dynident.study_draft import CarriedLoad

    pattern, given, mass = text.rpartition("=")
    if not given:
        return CarriedLoad(pattern=text)
    try:
        return CarriedLoad(pattern=pattern, mass=float(mass))
    except ValueError:
        raise click.BadParameter(f"'{mass}' is no mass in kg", param_hint="--load") from None


def _ask(decision: Decision) -> int:
    """Have a choice taken at the terminal."""
    said = f"{decision.subject}: likeliest 1, because {decision.reason}"
    click.echo(f"\n{printable(said)}", err=True)
    for number, choice in enumerate(decision.choices, start=1):
        click.echo(f"  {number}  {printable(choice)}", err=True)
    kind = click.IntRange(1, len(decision.choices))
    return click.prompt("which", type=kind, default=1, err=True) - 1
