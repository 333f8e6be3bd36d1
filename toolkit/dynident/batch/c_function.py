"""C functions for recursions in time, of which NumPy takes a call a step."""

from __future__ import annotations

from functools import cache
from typing import Any

from dynident.batch.compiler import NotCompiled, NotKept, compiled, compiled_unkept
from dynident.batch.evaluation import wish


def c_function(source: str, entry: str) -> Any | None:
    """Return a function of a C source; None where there is none, or the environment forbids it.

    It is compiled when it is first asked for, unless the cache has it, and for this process alone
    where there can be no cache: a recursion of some thousand steps pays for that.

    Parameters
    ----------
    source : in C.
    entry : name of the function.

    Raises
    ------
    SettingError
        If the environment says of compiling what is not understood.
    """
    return None if wish() == "never" else _made(source, entry)


@cache
def _made(source: str, entry: str) -> Any | None:
    try:
        try:
            return compiled(source, entry)
        except NotKept:  # the last digits of an answer do not hang on where its user may write
            return compiled_unkept(source, entry)
    except NotCompiled:
        return None
