"""C functions compiled once and kept in the user's cache; where that fails, a reason and no error.

What is kept is named after all that it depends on: the source, the compiler's options and the
processor. It is written aside and moved into place, so that processes may do so at once. Nothing is
loaded that another user may have written.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import os
import platform
import shutil
import stat
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, Literal

from dynident.errors import FileError
from dynident.files import others_may_write

_OPTIONS = ("-ffp-contract=off", "-fPIC", "-shared", "-w", "-x", "c")
_LIBRARIES = ("-lm",)
_NATIVE = "-march=native"
_CPU_INFO = Path("/proc/cpuinfo")
# What tells a processor's instructions there, on x86 and on ARM; and what tells its make besides.
_INSTRUCTIONS = ("flags", "Features")
_MAKE = ("model name", "CPU ")
_PATIENCE = 120.0  # s, after which a compiler is given up
_COMPILERS = ("cc", "gcc", "clang")


Level = Literal["-O1", "-O2"]
"""How hard the compiler tries: long functions without loops gain little by more than the first."""


class NotCompiled(Exception):
    """There is no compiled function; the message says why."""


class NotKept(NotCompiled):
    """There is none since the cache cannot be used."""


@cache
def compiler() -> str | None:
    """Path of the C compiler that is used; None if there is none."""
    return next((path for path in map(shutil.which, _COMPILERS) if path), None)


def cache_folder() -> Path:
    """Folder of compiled functions, below `XDG_CACHE_HOME` or `~/.cache`."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(given) if os.path.isabs(given) else Path("~/.cache").expanduser()
    return base / "dynident" / "batch"


def is_kept(source: str, level: Level) -> bool:
    """Whether the cache has a source's library; False also where there can be no cache."""
    try:
        return _place(source, level).is_file()
    except (OSError, RuntimeError):
        return False


def _place(source: str, level: Level) -> Path:
    """Where the library of a source is kept, on this machine."""
    key = "\n".join((source, level, *_OPTIONS, *_LIBRARIES, compiler() or "", *_processor()))
    return cache_folder() / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}.so"


def compiled(source: str, entry: str, level: Level = "-O1") -> Any:
    """Return a function of a C source, compiled now unless the cache has it.

    Parameters
    ----------
    source : in C.
    entry : name of the function.
    level : how hard the compiler tries.

    Returns
    -------
    As `ctypes` has it, without types of arguments.

    Raises
    ------
    NotCompiled
        If there is no compiler, or it fails.
    NotKept
        If the cache cannot be written or read, or another user may write it.
    """
    try:
        place = _place(source, level)
        if place.is_file():
            with contextlib.suppress(OSError, AttributeError):  # a broken file is made anew
                return _loaded(place, entry)
        _compile(source, place, level)
        return _loaded(place, entry)
    except subprocess.TimeoutExpired:
        raise NotCompiled(f"the compiler took more than {_PATIENCE:.0f} s") from None
    # RuntimeError: no home folder; AttributeError: a library of another making.
    except (OSError, RuntimeError, AttributeError, ValueError) as error:
        raise NotKept(f"{type(error).__name__}: {error}") from None


def compiled_unkept(source: str, entry: str, level: Level = "-O1") -> Any:
    """Return a function of a C source as `compiled`, for this process alone.

    Parameters
    ----------
    source, entry, level : as for `compiled`.

    Raises
    ------
    NotCompiled
        If there is no compiler, it fails, or there is no place for files of the moment.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="dynident-") as folder:
            place = Path(folder) / "function.so"
            _compile(source, place, level)
            return getattr(ctypes.CDLL(str(place)), entry)
    except (OSError, AttributeError, subprocess.TimeoutExpired) as error:
        raise NotCompiled(f"{type(error).__name__}: {error}") from None


def _loaded(place: Path, entry: str) -> Any:
    _refuse_what_others_write(place.parent)
    _refuse_what_others_write(place)
    return getattr(ctypes.CDLL(str(place)), entry)


def _refuse_what_others_write(path: Path) -> None:
    """Raise `NotKept` if a file or folder is not this user's alone to write.

    To load a library is to run it.
    """
    try:
        reason = others_may_write(path)
    except FileError as error:
        raise NotKept(str(error)) from None
    if reason:
        raise NotKept(f"{path} {reason}")


def _compile(source: str, place: Path, level: Level) -> None:
    program = compiler()
    if program is None:
        raise NotCompiled("there is no C compiler")
    place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    _refuse_what_others_write(place.parent)
    handle, name = tempfile.mkstemp(suffix=".tmp", dir=place.parent)
    os.close(handle)
    try:
        said = _run(program, name, source, level, *_tuning())
        if said is not None and _tuning():
            said = _run(program, name, source, level)
        if said is not None:
            raise NotCompiled(f"the compiler failed: {said}")
        os.chmod(name, stat.S_IRWXU)  # a linker may have made the file anew, open to a group
        os.replace(name, place)
    finally:
        with contextlib.suppress(OSError):
            os.unlink(name)


def _run(program: str, name: str, source: str, *options: str) -> str | None:
    """Compile into a file; return None, or the first thing that the compiler says."""
    command = [program, *_OPTIONS, *options, "-o", name, "-", *_LIBRARIES]
    done = subprocess.run(
        command, input=source, capture_output=True, text=True, timeout=_PATIENCE, check=False
    )
    if done.returncode == 0:
        return None
    return next(iter(done.stderr.splitlines()), f"status {done.returncode}")


def _tuning() -> tuple[str, ...]:
    """Options for this very processor; none where its instructions are not in the key."""
    told = any(line.startswith(_INSTRUCTIONS) for line in _processor())
    return (_NATIVE,) if told else ()


@cache
def _processor() -> tuple[str, ...]:
    """What the processor can do: a library for another one must not be loaded."""
    words = (platform.machine(), platform.system())
    try:
        lines = _CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:  # as on macOS
        return words
    return words + tuple(sorted({x for x in lines if x.startswith((*_INSTRUCTIONS, *_MAKE))}))
