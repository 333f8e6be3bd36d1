"""One file of effects: read once, judged by its content, and run as a module of its own."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import sys
import traceback
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib.abc import SourceLoader
from pathlib import Path

from dynident import files
from dynident.effects import Effect
from dynident.effects.known_effects import (
    KnownEffect,
    forget_module,
    known_effects,
    unchanged_if_it_fails,
)
from dynident.errors import DynidentError, StudyError

LARGEST_MODULE = 1 << 20
"""Bytes of a file of effects."""
_brought: dict[str, tuple[KnownEffect, ...]] = {}
"""SHA-256 of what has been run -> the effects that it brought."""


@dataclass(frozen=True)
class UserModule:
    """A file of effects, and its content as it was read.

    Attributes
    ----------
    path : of the file, without links.
    content : bytes, that are run as they were judged even if the file changes meanwhile.
    """

    path: Path
    content: bytes

    @classmethod
    def read(cls, path: Path) -> UserModule:
        """Read a file of effects without running it.

        Raises
        ------
        FileError
            If there is no such file, or it is none, or one that is too large.
        StudyError
            If it is not called a Python file.
        """
        content = files.read_bytes(path, LARGEST_MODULE, "is it a Python file?")
        if path.suffix != ".py":
            raise StudyError("is not called a Python file", str(path), "end its name in .py")
        return cls(Path(os.path.realpath(path)), content)

    @property
    def sha256(self) -> str:
        """Of the content, as hexadecimal digits."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def name(self) -> str:
        """What the module is called: a name of its own, the same whenever the file changes."""
        stem = re.sub(r"\W", "_", self.path.stem)
        return f"effects_of_{stem}_{hashlib.sha256(os.fsencode(self.path)).hexdigest()[:8]}"

    @property
    def brought(self) -> tuple[KnownEffect, ...] | None:
        """Effects that it brought, if it has been run and they are still there; else None."""
        known = known_effects()
        for module in list(sys.modules.values()):
            # A script, or what it has imported, is there already; a lazy module stays asleep.
            inside = getattr(module, "__dict__", {})
            file, name = inside.get("__file__"), inside.get("__name__")
            if name != self.name and isinstance(file, str) and self._is(file):
                return tuple(one for one in known.values() if one.kind.__module__ == name)
        found = _brought.get(self.sha256)
        if found is None or any(known.get(str(vars(x.kind)["name"])) != x for x in found):
            return None
        return found

    def _is(self, file: str) -> bool:
        return os.path.basename(file) == self.path.name and os.path.realpath(file) == str(self.path)

    def run(self) -> tuple[KnownEffect, ...]:
        """Import the content as a module, and return the effects that it brings.

        Raises
        ------
        StudyError
            If it fails: with the file and the line. Nothing of it is then in the catalogue.
        """
        found = self.brought
        if found is not None:
            return found
        loader = _ContentLoader(self)
        spec = importlib.util.spec_from_loader(self.name, loader, origin=str(self.path))
        assert spec is not None
        spec.has_location = True
        module = importlib.util.module_from_spec(spec)
        before = sys.modules.get(self.name)
        try:
            with unchanged_if_it_fails(), redirect_stdout(sys.stderr):
                forget_module(self.name)
                held = known_effects()
                sys.modules[self.name] = module  # where dataclasses and pickle look for it
                loader.exec_module(module)
        except (Exception, SystemExit) as error:
            sys.modules.pop(self.name)
            if before is not None:
                sys.modules[self.name] = before
            raise self._complaint(error) from None
        joined = tuple(one for name, one in known_effects().items() if held.get(name) != one)
        _brought[self.sha256] = joined
        return joined

    def _complaint(self, error: BaseException) -> StudyError:
        """What went wrong, with the last line of this file that was run."""
        line = None
        if isinstance(error, SyntaxError) and error.filename == str(self.path):
            line, said = error.lineno, f"SyntaxError: {error.msg}"
        else:
            frames = traceback.extract_tb(error.__traceback__)
            own = [one.lineno for one in frames if one.filename == str(self.path)]
            line = own[-1] if own else None
            said = error.what if isinstance(error, DynidentError) else _words(error)
        where = f"{self.path}:{line}" if line else str(self.path)
        remedy = error.remedy if isinstance(error, DynidentError) else None
        return StudyError(said, where, remedy or "correct the file")


def module_file(kind: type[Effect]) -> Path | None:
    """Return the effect module that a class came from; None if it came from elsewhere."""
    module = sys.modules.get(kind.__module__)
    loader = getattr(module, "__loader__", None)
    return loader.path if isinstance(loader, _ContentLoader) else None


def line_of_a_module(error: BaseException) -> str:
    """Return `file:line` in an effect module that an error came through last; empty for none."""
    found, step = "", error.__traceback__
    while step is not None:
        loader = step.tb_frame.f_globals.get("__loader__")
        if isinstance(loader, _ContentLoader):
            found = f"{loader.path}:{step.tb_lineno}"
        step = step.tb_next
    return found


class _ContentLoader(SourceLoader):
    """Loads what was read; nothing compiled is kept beside the file."""

    def __init__(self, module: UserModule) -> None:
        self._module = module

    @property
    def path(self) -> Path:
        """Of the file."""
        return self._module.path

    def get_filename(self, fullname: str) -> str:
        return str(self._module.path)

    def get_data(self, path: str) -> bytes:
        return self._module.content


def _words(error: BaseException) -> str:
    """An error as one short line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
