"""The command `dynident`.

Standard output carries the answer (one JSON object under `--json`), standard error everything
else. Exit status: 0 done, 1 a check failed, 2 unusable input.
"""

from __future__ import annotations

import contextlib
import gc
import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import NoReturn

import click

from dynident.cli import (  # which add their commands to the group
    comparing,
    demonstration,
    designs,
    fits,
    loops,
    opening,
    robots,
    starting,
    studies,
)
from dynident.cli.group import commands
from dynident.cli.output import ReaderGone
from dynident.errors import DynidentError, DynidentWarning
from dynident.tables import printable
from dynident.words import shortened

__all__ = [
    "commands",
    "comparing",
    "demonstration",
    "designs",
    "fits",
    "loops",
    "main",
    "opening",
    "robots",
    "starting",
    "studies",
]


TRACEBACK = "DYNIDENT_TRACEBACK"
"""Environment variable: what nobody has foreseen ends in Python's traceback, not in one line."""
_SELDOM = 50_000
"""Objects made anew after which the collector looks for cycles. Modules, being loaded, make many
and leave none; a tenth of a short command was spent on looking."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command; one line and an exit status for everything that can go wrong.

    Parameters
    ----------
    arguments : by default those of the process.
    """
    _open_streams()
    with _cycles_seldom_sought(), warnings.catch_warnings():
        warnings.showwarning = _Warnings().show
        warnings.simplefilter("always", DynidentWarning)
        try:
            if "\0" in "".join(arguments or ()):  # no shell can say that, and no file is called so
                raise click.UsageError("An argument holds a NUL character")
            # With standalone_mode, click would word and print the errors its own way.
            sys.exit(commands(arguments, "dynident", standalone_mode=False) or 0)
        except click.exceptions.Exit as stop:
            sys.exit(stop.exit_code)
        except click.UsageError as error:
            command = error.ctx.command_path if error.ctx else "dynident"
            message = error.format_message()
            end = " " if message.endswith(("?", ".")) else ". "
            _fail(f"{message}{end}See `{command} --help`")
        except click.ClickException as error:
            _fail(error.format_message())
        except DynidentError as error:
            _fail(str(error))
        except (KeyboardInterrupt, click.Abort):
            click.echo("interrupted; nothing was left half written", err=True)
            sys.exit(130)
        except MemoryError:
            _fail("out of memory: use fewer or shorter recordings, or a lower rate")
        except ReaderGone:
            # Whoever read us has gone: nothing to say, and nobody to say it to.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(0)
        except Exception as error:
            if os.environ.get(TRACEBACK):
                raise
            from dynident.effect_modules import line_of_a_module

            if line := line_of_a_module(error):
                said = f"{line}: {type(error).__name__}: {error}"
                _fail(f"{said}. correct the class; dynident.check_effect tells more")
            where = f"{TRACEBACK}=1 shows where; please report it with the input"
            _fail(f"unexpected {type(error).__name__}: {error}. {where}")


@contextlib.contextmanager
def _cycles_seldom_sought() -> Iterator[None]:
    before = gc.get_threshold()
    gc.set_threshold(_SELDOM, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _open_streams() -> None:
    """Have standard output and standard error, and letters that they lack spelt out."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever started us
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _fail(message: str) -> NoReturn:
    """Say on one line why the input is unusable, and end."""
    line = f"error: {printable(shortened(' '.join(message.splitlines())))}"
    with contextlib.suppress(OSError):  # there may be no room for that either
        click.echo(line, err=True)
    sys.exit(2)


class _Warnings:
    """Warnings on standard error, each once: a file may be looked at several times."""

    def __init__(self) -> None:
        self._said: set[str] = set()

    def show(self, message, category, filename, lineno, file=None, line=None) -> None:
        if str(message) not in self._said:
            self._said.add(str(message))
            click.echo(f"warning: {printable(str(message))}", err=True)
