"""What the commands print, and how they show that they are at work."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from dynident.errors import FileError
from dynident.progress import logged, to_standard_error
from dynident.tables import printable


def show(*parts: Any) -> None:
    """Print tables and sentences."""
    from dynident.tables import print_tables

    with _reader():
        print_tables(*parts)


def print_json(content: dict[str, Any]) -> None:
    """Print one JSON object on one line."""
    say(json.dumps(_plain(content), allow_nan=False))


def say(*lines: str) -> None:
    """Print lines as they are, whatever the width of the terminal."""
    with _reader():
        for line in lines:
            click.echo(printable(line))


class ReaderGone(Exception):
    """Whoever reads our standard output has closed it."""


@contextmanager
def _reader() -> Iterator[None]:
    """Tell a closed pipe from other failures; click would end with status 1."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        raise ReaderGone from None
    except OSError as error:
        what = f"cannot be written ({error.strerror or error})"
        raise FileError(what, "standard output") from None


def _plain(value: Any) -> Any:
    """Values as JSON has them: numbers that are not finite become null."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


@contextmanager
def progress(title: str) -> Iterator[Callable[..., None]]:
    """Show a progress bar on a terminal, else a line every ten seconds on standard error."""
    if not sys.stderr.isatty():
        to_standard_error()
        yield logged(title)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)

        def show_progress(
            doing: object = "", done: float | None = None, total: float | None = None
        ) -> None:
            bar.update(task, description=f"{title}: {doing}", completed=done, total=total)

        yield show_progress
