"""The command `dynident`, and what its commands have in common: answers, and options in groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import wraps
from typing import Any

import click

from dynident.batch import wish
from dynident.cli.output import print_json, say, show

_ORDER = (
    "init",
    "show",
    "explain",
    "open",
    "diagnose",
    "fit",
    "payload",
    "compare",
    "changes",
    "add",
    "simulate",
    "report",
    "demo",
    "check",
)
"""Commands in the order of use, not of the alphabet; others come after them."""


class _Group(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(self.commands, key=lambda name: (*_ORDER, name).index(name))


@click.group(
    cls=_Group, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False
)
@click.version_option(package_name="dynident")
def commands() -> None:
    """Robot model identification that tells you what physics your model lacks.

    Example: dynident explain study.toml --report report.html
    """
    wish()  # what the environment asks for is refused here or nowhere


@dataclass(frozen=True, kw_only=True)
class CommandAnswer:
    """What a command has to say, worked out in the form that is asked for.

    Attributes
    ----------
    content : makes the JSON object.
    parts : makes the tables and sentences.
    lines : printed after them as they are, whatever the width of the terminal.
    status : exit status.
    """

    content: Callable[[], dict[str, Any]]
    parts: Callable[[], Iterable[Any]] = tuple
    lines: tuple[str, ...] = ()
    status: int = 0


def answered(command: Callable[..., CommandAnswer]) -> Callable[..., int]:
    """Give a command the option --json, and print the `CommandAnswer` that it returns."""

    @click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
    @wraps(command)
    def run(*args: Any, as_json: bool, **options: Any) -> int:
        answer = command(*args, **options)
        if as_json:
            print_json(answer.content())
        else:
            show(*answer.parts())
            say(*answer.lines)
        return answer.status

    return run


def collected(**kinds: type) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Hand a command its options in groups.

    Parameters
    ----------
    kinds : dataclasses by the name of the argument; their fields are names of options.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def run(*args: Any, **options: Any) -> Any:
            groups = {
                name: kind(**{field.name: options.pop(field.name) for field in fields(kind)})
                for name, kind in kinds.items()
            }
            return command(*args, **groups, **options)

        return run

    return decorate
