"""Whether a function is compiled: when the environment, the cache or the work says so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from dynident.batch.compiler import Level, NotCompiled, compiled, is_kept
from dynident.batch.evaluation import VARIABLE, Evaluation, Way, wish


@dataclass(frozen=True, kw_only=True)
class Price:
    """Samples that a function must have done in another way before it is compiled.

    Attributes
    ----------
    look_after : samples after which the cache is asked: to name what it may have, the source is
        written.
    compile_after : samples after which it is compiled. Whoever pays as much for compiling as was
        spent before pays at most twice what was best.
    """

    look_after: int
    compile_after: int


class Choice:
    """Between a C function and another way of doing the same; it never raises for a compiler.

    Parameters
    ----------
    source : writes the function in C.
    entry : its name.
    other : what is done without it.
    level : how hard the compiler tries.

    Attributes
    ----------
    evaluation : what was chosen last, and why.
    failed : why there is no C function, once it was wanted; empty before.
    """

    def __init__(
        self, source: Callable[[], str], entry: str, other: Way, level: Level = "-O1"
    ) -> None:
        self.evaluation = Evaluation(other, "not called yet")
        self._write, self._entry = source, entry
        self._other: Way = other
        self._level: Level = level
        self._function: Any = None
        self.failed, self._why = "", ""

    def function(self, seen: int, price: Price) -> Any | None:
        """Return the function as `ctypes` has it, or None where it is not to be used.

        Parameters
        ----------
        seen : samples that were and are to be done.
        price : of compiling.

        Raises
        ------
        SettingError
            If the environment says something else of compiling than it can.
        """
        wanted = wish()
        reason = f"{VARIABLE}=always" if wanted == "always" else ""
        if wanted == "auto" and not self.failed:
            reason = self._reason(seen, price)
        if reason and not self.failed and self._function is None:
            self._compile(reason)
        if self.failed:
            self.evaluation = Evaluation(self._other, self.failed)
        elif reason:
            self.evaluation = Evaluation("compiled", self._why)
            return self._function
        elif wanted == "never":
            self.evaluation = Evaluation(self._other, f"{VARIABLE}=never")
        else:
            few = f"fewer than {price.compile_after} samples"
            self.evaluation = Evaluation(self._other, few)
        return None

    def _reason(self, seen: int, price: Price) -> str:
        """Why a compiled function is to be had for little, or pays; empty if neither is so."""
        if seen >= price.look_after and (self._function is not None or self._is_kept):
            return "from the cache"
        most = price.compile_after
        return f"from {most} samples on" if seen >= most else ""

    @cached_property
    def _source(self) -> str:
        return self._write()

    @cached_property
    def _is_kept(self) -> bool:
        return is_kept(self._source, self._level)

    def _compile(self, reason: str) -> None:
        self._why = reason
        try:
            self._function = compiled(self._source, self._entry, self._level)
        except NotCompiled as error:
            self.failed = str(error)
