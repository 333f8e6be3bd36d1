"""Files of one folder that belong together: replaced by all of the new ones, or by none."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from dynident import files
from dynident.errors import FileError

_COMPLETE = ".complete"
"""Folder of new files, all of them whole, that have not all taken their places yet."""
_OBSOLETE = ".obsolete"
"""File in it: the names of older files that go, one a line."""
_NEW = ".dynident-new."
"""What names of folders begin with in which somebody writes, followed by eight letters."""


@contextmanager
def replaced_together(folder: str | Path, names: Sequence[str], last: str) -> Iterator[Path]:
    """Write files beside a group of older ones; at the end they take their places.

    Whatever stops the writing leaves the folder as it was. What stops the change of places itself
    leaves every new file whole, in its place or still beside: `in_group` finds it, and the next
    writer puts the rest in place.

    Parameters
    ----------
    folder : made if it is missing.
    names : of all files that belong to the group; those that are not written anew go.
    last : the file whose presence says that the group is there. It goes first and comes last.

    Yields
    ------
    The folder to write in

    Raises
    ------
    FileError
        If the folder cannot be made or written, or what is in the place of a file is none.
    """
    folder = files.require_folder(folder)
    new, held = None, None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            files.require_place(folder / name)
        with _alone(folder):
            _finish(folder, last)
            _remove_abandoned(folder)
            new = Path(tempfile.mkdtemp(dir=folder, prefix=_NEW))
            held = _held(new)
        yield new
        files.write_text(new / _OBSOLETE, "\n".join(names))
        with _alone(folder):
            while not _is_complete(new, folder):
                _finish(folder, last)  # what another writer has completed meanwhile
            _finish(folder, last)
    except OSError as error:
        raise FileError(f"cannot be written ({error.strerror or error})", str(folder)) from None
    finally:
        if new is not None:
            shutil.rmtree(new, ignore_errors=True)
        if held is not None:
            os.close(held)


def in_group(folder: Path, name: str) -> Path:
    """Return where a file of a group is: in its place, or on the way there."""
    beside = folder / _COMPLETE / name
    return beside if beside.is_file() else folder / name


def groups_below(folder: Path, last: str) -> list[Path]:
    """Return the file that says that a group is there, of every folder in a folder."""
    found = {one.parent: one for one in folder.glob(f"*/{last}")}
    found |= {one.parent.parent: one for one in folder.glob(f"*/{_COMPLETE}/{last}")}
    return list(found.values())


def folder_of(file: Path) -> Path:
    """Return the folder that the file of a group belongs to, wherever `in_group` found it."""
    return file.parent.parent if file.parent.name == _COMPLETE else file.parent


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Change places in a folder while nobody else does; without locks, as on Windows, at once."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # some network drives have no locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _held(folder: Path) -> int | None:
    """Hold a folder as long as the process lives; None where another does, or none can be held."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # of somebody else, or gone meanwhile
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def _remove_abandoned(folder: Path) -> None:
    """Remove what writers have left that were killed: nobody holds their folders any more."""
    for one in folder.glob(f"{_NEW}*"):
        if not re.fullmatch(r"[a-z0-9_]{8}", one.name.removeprefix(_NEW)):
            continue
        if one.is_symlink() or not one.is_dir():
            continue
        held = _held(one)
        if held is not None:
            shutil.rmtree(one, ignore_errors=True)
            os.close(held)


def _is_complete(new: Path, folder: Path) -> bool:
    """Say that all new files are written; False where those of another writer wait."""
    try:
        new.rename(folder / _COMPLETE)
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            return False
        raise
    return True


def _finish(folder: Path, last: str) -> None:
    """Put new files in their places, in an order that can be taken up again wherever it ends."""
    beside = folder / _COMPLETE
    if not beside.is_dir():
        return
    obsolete = beside / _OBSOLETE
    if obsolete.is_file():
        names = files.read_bytes(obsolete).decode().split("\n")
        for name in sorted(names, key=lambda one: one != last):
            files.remove(folder / name)
        files.remove(obsolete)
    for one in sorted(beside.iterdir(), key=lambda one: one.name == last):
        one.replace(folder / one.name)
    beside.rmdir()
