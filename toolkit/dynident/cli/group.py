"""The command `dynident`, to which the modules beside this one add their commands."""

from __future__ import annotations

import click


class _Group(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # in the order of use, not of the alphabet


@click.group(
    cls=_Group, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False
)
@click.version_option(package_name="dynident")
def commands() -> None:
    """Robot model identification that tells you what physics your model lacks.

    Example: dynident explain study.toml --report report.html
    """
