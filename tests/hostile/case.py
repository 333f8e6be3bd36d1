"""One hostile input: what lies in a folder, the commands that meet it, and what they must say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from study_files import write_study

ANSWER = ""
"""In the place of a message: the input is odd, and an answer to it is right."""

Content = str | bytes | Callable[[Path], object]
"""Of a file: text, bytes, or what makes something under its path."""


@dataclass(frozen=True, kw_only=True)
class HostileCase:
    """A folder with hostile files, and commands that are run in it.

    Attributes
    ----------
    commands : each is run as typed, one after the other.
    message : a pattern that the one line of each command fits; `ANSWER` where there is an answer.
    files : by name, written over those of the small study, which is always there.
    """

    commands: tuple[tuple[str, ...], ...]
    message: str
    files: dict[str, Content]

    @property
    def run(self) -> Callable[[tuple[str, ...]], object]:
        """What is given the words of a command."""
        from dynident.cli import main

        return main

    def write(self, folder: Path) -> None:
        """Write the small study, and the hostile files over it."""
        write_study(folder)
        for name, content in self.files.items():
            place(folder / name, content)


def place(path: Path, content: Content) -> None:
    """Put something under a path, in the place of what is there."""
    path.unlink(missing_ok=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, str):
        path.write_bytes(content.encode("utf-8", "surrogatepass"))
    elif isinstance(content, bytes):
        path.write_bytes(content)
    else:
        content(path)


def link_to(target: str) -> Callable[[Path], object]:
    """Return what makes a symbolic link."""
    return lambda path: path.symlink_to(target)


def folder(path: Path) -> None:
    """Make a folder in the place of a file."""
    path.mkdir()


def hole(size: int) -> Callable[[Path], object]:
    """Return what makes a file of that many zeros, which take no place on the disk."""

    def make(path: Path) -> None:
        with path.open("wb") as stream:
            stream.truncate(size)

    return make
