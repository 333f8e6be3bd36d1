"""Whole files in and out, nothing ever half written; and where the data of a study lies."""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

from dynident.errors import FileError

VARIABLE = "DYNIDENT_DATA"
"""Environment variable that names a folder of measured data."""


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    FileError
        If there is no such file, it is a folder, or it may not be read.
    """
    path = Path(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise FileError("no such file", str(path), "check the path") from None
    except IsADirectoryError:
        raise FileError("is a folder, not a file", str(path), "name a file in it") from None
    except OSError as error:
        raise FileError(f"cannot be read ({error.strerror or error})", str(path)) from None


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
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "no such folder"
        raise FileError(what, str(folder), "name a file in a folder that is there")
    _require_writable(folder)
    return path


def _target(path: Path) -> Path:
    """Return the file itself where a path is a link to it; refuse what a file may not replace."""
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    try:
        mode = target.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return target
    except OSError as error:
        raise FileError(f"cannot be written ({error.strerror or error})", str(path)) from None
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
    above = next(one for one in (path, *path.absolute().parents) if one.exists())
    if not above.is_dir():
        raise FileError("is a file, not a folder", str(above), "name another folder")
    _require_writable(above)
    return path


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


def write_text(path: str | Path, text: str) -> Path:
    """Write UTF-8 text in one step; see `write_bytes`."""
    return write_bytes(path, text.encode("utf-8"))


def sha256(path: str | Path) -> str:
    """Return the SHA-256 of a file's content as hexadecimal digits."""
    return hashlib.sha256(read_bytes(path)).hexdigest()


def find_data(file: str, folder: Path) -> Path:
    """Find a data file that a study names.

    It is looked for beside the study, in the folder that `DYNIDENT_DATA` names, in `shared/data`
    beside the project, and for the EMPS benchmark through the optional package
    `nonlinear-benchmarks`, which downloads it.

    Parameters
    ----------
    file : as the study names it.
    folder : the folder of the study.

    Returns
    -------
    Path of the file.

    Raises
    ------
    FileError
        If it is nowhere: the message lists the places.
    """
    folder = folder.resolve()
    tried = [folder / file]
    if os.environ.get(VARIABLE):
        tried.append(Path(os.environ[VARIABLE]) / file)
    tried += [parent / "shared" / "data" / file for parent in folder.parents]
    for path in tried:
        if path.is_file():
            return path
    downloaded = _download(Path(file).name)
    if downloaded is not None:
        return downloaded
    remedy = f"put it beside the study, or name the data folder in the variable {VARIABLE}"
    if "EMPS" in file:
        remedy += "; or `pip install nonlinear-benchmarks`, which downloads this benchmark"
    raise FileError("no such data file", str(tried[0]), remedy)


def _download(name: str) -> Path | None:
    if name not in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
        return None
    try:
        from nonlinear_benchmarks import EMPS  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    try:
        locations = EMPS(data_file_locations=True)
    except Exception as error:  # its downloads fail in many ways; all mean: not to be had
        remedy = f"name the data folder in the variable {VARIABLE}"
        raise FileError(f"the download failed ({error})", name, remedy) from None
    for location in locations:
        if Path(location).name == name:
            return Path(location)
    return None
