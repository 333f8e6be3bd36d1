"""What effects there are: a class joins when it is defined, at any time and in any file."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from dynident.errors import EffectError


@dataclass(frozen=True)
class KnownEffect:
    """A class of the catalogue, and where it was defined.

    Attributes
    ----------
    kind : the class.
    file : as the interpreter names it; of a notebook's cell a name that is no file.
    line : at which the class begins, from 1; 0 where that is not known.
    """

    kind: type
    file: str
    line: int

    @property
    def place(self) -> str:
        """`file:line`."""
        return f"{self.file}:{self.line}"


_KNOWN: dict[str, KnownEffect] = {}


def known_effects() -> dict[str, KnownEffect]:
    """Return what has joined so far, by its name in alphabetical order."""
    return dict(sorted(_KNOWN.items()))


def join(kind: type) -> None:
    """Enter a class that is being defined, unless it is internal.

    Internal are abstract classes, those without a name of their own, those whose name (or their
    effect's) begins with an underscore, and those that say `in_catalogue = False`. A class that is
    defined again (a notebook's cell run once more, a module reloaded) takes the place of what it
    was.

    Raises
    ------
    EffectError
        If the name cannot be written in a study, or another class has it: both places are named.
    """
    name = vars(kind).get("name")
    if not isinstance(name, str) or not getattr(kind, "in_catalogue", True):
        return
    if name.startswith("_") or kind.__name__.startswith("_") or inspect.isabstract(kind):
        return
    fresh = KnownEffect(kind, *_where(kind))
    if not name.isidentifier():
        what = f"its name {name[:40]!r} cannot be written in a study"
        raise EffectError(what, fresh.place, "use letters, digits and underscores")
    held = _KNOWN.get(name)
    if held is not None and not _same(held, fresh):
        places = f"{held.kind.__qualname__} ({held.place}) and {kind.__qualname__} ({fresh.place})"
        raise EffectError(f"two effects are named '{name}': {places}", None, "rename one of them")
    if "<locals>" not in kind.__qualname__:  # a function may make many, each with its name
        for other in [other for other, one in _KNOWN.items() if _same(one, fresh)]:
            del _KNOWN[other]
    _KNOWN[name] = fresh


def forget_module(module: str) -> None:
    """Take a module's effects out of the catalogue, before it is run again."""
    for name in [name for name, one in _KNOWN.items() if one.kind.__module__ == module]:
        del _KNOWN[name]


@contextmanager
def unchanged() -> Iterator[None]:
    """Leave the catalogue as it was before."""
    before = dict(_KNOWN)
    try:
        yield
    finally:
        _restore(before)


@contextmanager
def unchanged_if_it_fails() -> Iterator[None]:
    """Leave the catalogue as it was where a module that defines effects cannot be imported."""
    before = dict(_KNOWN)
    try:
        yield
    except BaseException:
        _restore(before)
        raise


def _restore(before: dict[str, KnownEffect]) -> None:
    _KNOWN.clear()
    _KNOWN.update(before)


def _same(one: KnownEffect, other: KnownEffect) -> bool:
    """Whether it is one class, defined twice: in one module, or in one file under two names."""
    if one.kind.__qualname__ != other.kind.__qualname__:
        return False
    return one.kind.__module__ == other.kind.__module__ or (
        one.file == other.file and not one.file.startswith("<")
    )


def _where(kind: type) -> tuple[str, int]:
    """File and line of a class that is being defined now."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_globals.get("__name__") != kind.__module__:
        frame = frame.f_back
    if frame is not None:
        return frame.f_code.co_filename, frame.f_lineno
    return str(getattr(sys.modules.get(kind.__module__), "__file__", kind.__module__)), 0
