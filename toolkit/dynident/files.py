"""Whole files in, of a size that is bounded, and out, never half written."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dynident.errors import FileError
from dynident.words import did_you_mean

LARGEST_DOCUMENT = 1 << 26
"""Bytes of a robot description, a study or an estimate; formats of data have other limits."""
_BLOCK = 1 << 20
_LOOKED_AT = 1000
"""Names in a folder among which the one that was meant is sought."""


@contextmanager
def open_regular(path: str | Path) -> Iterator[BinaryIO]:
    """Open a regular file for reading; whatever else is under its name never blocks.

    Raises
    ------
    FileError
        If there is no such file, it may not be read, or it is a folder, a device, a pipe or a
        socket: those may never end, or wait for somebody to write.
    """
    path = Path(path)
    try:
        # Without O_NONBLOCK, opening a pipe waits until somebody opens its other end.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise FileError("no such file", str(path), _remedy(path)) from None
    except OSError as error:
        raise FileError(f"cannot be read ({error.strerror or error})", str(path)) from None
    except ValueError:
        raise _unnamed(path) from None
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        if stat.S_ISDIR(mode):
            raise FileError("is a folder, not a file", str(path), "name a file in it")
        what = "is not a regular file, but a device, a pipe or a socket"
        raise FileError(what, str(path), "write its content to a file first")
    with open(number, "rb") as stream:
        yield stream


def _remedy(path: Path) -> str:
    """Which file of the same folder may have been meant instead of one that is not there."""
    try:
        with os.scandir(path.parent) as entries:
            names = [one.name for one in itertools.islice(entries, _LOOKED_AT) if one.is_file()]
    except OSError:
        return "check the path"
    return did_you_mean(path.name, names, "check the path", cutoff=0.8)


def read_bytes(
    path: str | Path, largest: int = LARGEST_DOCUMENT, remedy: str = "is it the right file?"
) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    path : the file.
    largest : bytes that it may hold.
    remedy : what to do where it holds more.

    Raises
    ------
    FileError
        If there is no such file, it is not a regular one, it may not be read, or it is too large
        for its kind or for the memory.
    """
    with open_regular(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > largest:
            raise too_large(path, size, largest, remedy)
        try:
            # Some files of the system say that they are empty, and are not.
            data = stream.read(size) if size else _in_blocks(stream, largest)
        except MemoryError:
            raise FileError("does not fit into memory", str(path), remedy) from None
        except OSError as error:
            raise FileError(f"cannot be read ({error.strerror or error})", str(path)) from None
    if len(data) > largest:
        raise too_large(path, len(data), largest, remedy)
    return data


def _in_blocks(stream: BinaryIO, largest: int) -> bytes:
    """Read a stream of unknown length, a little more than it may hold at most."""
    found = bytearray()  # asked for all at once, room for the largest would be taken
    while len(found) <= largest and (block := stream.read(_BLOCK)):
        found += block
    return bytes(found)


def too_large(path: str | Path, size: int, largest: int, remedy: str) -> FileError:
    """Return the error for a file, or what is packed into it, that is larger than it may be.

    Parameters
    ----------
    path : the file.
    size, largest : bytes that it holds, and may hold.
    remedy : what to do about it.
    """
    what = f"holds {size_in_words(size)}, and {size_in_words(largest)} is the limit"
    return FileError(what, str(path), remedy)


def size_in_words(size: int) -> str:
    """Return a number of bytes with a unit, as `2.3 GB`."""
    for unit, one in (("GB", 1 << 30), ("MB", 1 << 20), ("kB", 1 << 10)):
        if size >= one:
            return f"{size / one:.4g} {unit}"
    return f"{size} bytes"


def read_text(path: str | Path) -> str:
    """Return the content of a UTF-8 text file.

    Raises
    ------
    FileError
        As `read_bytes`, and if the content is not UTF-8 text.
    """
    data = read_bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(
            f"is not UTF-8 text (byte {error.start})", str(path), "is it the right file?"
        ) from None


def require_place(path: str | Path) -> Path:
    """Refuse a file that could not be written, before the work that it is to hold is done.

    Raises
    ------
    FileError
        If its folder is missing or may not be written, or something is there in its place that
        is no regular file: a folder, a device, a pipe.
    """
    path = Path(path)
    folder = _target(path).parent
    if not _is_folder(folder):
        what = "is a file" if folder.exists() else "no such folder"
        raise FileError(what, str(folder), "name a file in a folder that is there")
    _require_writable(folder)
    return path


def _target(path: Path) -> Path:
    """Return the file itself where a path is a link to it; refuse what a file may not replace."""
    try:
        target = Path(os.path.realpath(path)) if path.is_symlink() else path
        mode = target.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return target
    except OSError as error:
        raise FileError(f"cannot be written ({error.strerror or error})", str(path)) from None
    except ValueError:
        raise _unnamed(path) from None
    if stat.S_ISDIR(mode):
        raise FileError("is a folder, not a file", str(path), "name a file in it")
    if not stat.S_ISREG(mode):
        # Renaming over it would put a file in the place of /dev/null or of a reader's pipe.
        what = "is not a regular file, but a device, a pipe or a socket"
        raise FileError(what, str(path), "name another file")
    return target


def require_folder(path: str | Path) -> Path:
    """Refuse a folder that could neither be used nor made, before the work is done.

    Raises
    ------
    FileError
        If a file is in its place or in its way, or the folder above may not be written.
    """
    path = Path(path)
    try:
        above = next(one for one in (path, *path.absolute().parents) if one.exists())
    except OSError as error:
        raise FileError(f"cannot be used ({error.strerror or error})", str(path)) from None
    if "\0" in str(path):
        raise _unnamed(path)
    if not above.is_dir():
        raise FileError("is a file, not a folder", str(above), "name another folder")
    _require_writable(above)
    return path


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # a name that is too long
        return False


def _unnamed(path: str | Path) -> FileError:
    what = "a NUL character" if "\0" in str(path) else "a character that no file's name can have"
    return FileError(f"its name holds {what}", ascii(str(path)))


def _require_writable(folder: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError("may not be written", str(folder), "choose another folder")


def write_bytes(
    path: str | Path, data: bytes, verify: Callable[[Path], object] | None = None
) -> Path:
    """Write a file in one step: to a temporary neighbour first, then renamed.

    Where the path is a symbolic link, the file that it leads to is replaced and the link stays.

    Parameters
    ----------
    path : the file.
    data : its content.
    verify : called with the temporary neighbour before it takes the file's place; whatever it
        raises leaves the old file untouched.

    Returns
    -------
    Path of the file.

    Raises
    ------
    FileError
        If the folder is missing or may not be written, or what is there is no regular file; it is
        then untouched.
    """
    path = Path(path)
    target = _target(path)
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(
            dir=target.parent, prefix=f".{target.name}.", delete=False
        ) as handle:
            temporary = Path(handle.name)
            handle.write(data)
            handle.flush()
            os.fsync(handle.fileno())  # else a fault of power may leave the new name to nothing
        if verify is not None:
            verify(temporary)
        # NamedTemporaryFile makes private files; give ours the permissions any new file gets.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~umask)
        temporary.replace(target)
    except OSError as error:
        raise FileError(f"cannot be written ({error.strerror or error})", str(path)) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
    return path


@contextmanager
def held(path: str | Path) -> Iterator[None]:
    """Keep a file for oneself while it is read and written anew; whoever else asks waits.

    Where files cannot be locked, as on some network drives, nobody waits.

    Raises
    ------
    FileError
        As `open_regular`.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    while True:
        with open_regular(path) as stream:
            with contextlib.suppress(OSError):
                fcntl.flock(stream, fcntl.LOCK_EX)
            # Whoever held it may have put another file in its place.
            if os.path.samestat(os.fstat(stream.fileno()), os.stat(path)):
                yield
                return


def write_text(path: str | Path, text: str) -> Path:
    """Write UTF-8 text in one step; see `write_bytes`."""
    return write_bytes(path, text.encode("utf-8"))


def remove(path: str | Path) -> None:
    """Remove a file, or a link to one; where there is none nothing happens.

    Raises
    ------
    FileError
        If something is there that cannot be removed, such as a folder.
    """
    try:
        Path(path).unlink(missing_ok=True)
    except OSError as error:
        raise FileError(f"cannot be removed ({error.strerror or error})", str(path)) from None


def write_private(path: str | Path, data: bytes) -> Path:
    """Write a file in one step that is its owner's alone to read and write; see `write_bytes`."""
    path = Path(path)
    try:
        path.touch(mode=0o600)
        path.chmod(0o600)
    except OSError as error:
        raise FileError(f"cannot be written ({error.strerror or error})", str(path)) from None
    return write_bytes(path, data)  # which keeps the permissions


def others_may_write(path: Path) -> str:
    """Why what is in a file or folder may not be its user's own words; empty where it is.

    Where there are no owners, as on Windows, it is taken to be.

    Raises
    ------
    FileError
        If it is not there, or cannot be looked at.
    """
    if not hasattr(os, "geteuid"):
        return ""
    try:
        status = path.stat()
    except OSError as error:
        raise FileError(f"cannot be read ({error.strerror or error})", str(path)) from None
    if status.st_uid != os.geteuid():
        return "belongs to another user"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "may be written by other users"
    return ""


def sha256(path: str | Path) -> str:
    """Return the SHA-256 of a file's content as hexadecimal digits; a file of any size.

    Raises
    ------
    FileError
        As `open_regular`.
    """
    digest = hashlib.sha256()
    with open_regular(path) as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()
