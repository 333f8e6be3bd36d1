"""How functions of many samples are evaluated: compiled to machine code, or in another way."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Literal, get_args

from dynident.errors import SettingError

VARIABLE = "DYNIDENT_COMPILE"
"""Environment variable that says when functions are compiled; "auto" if it is not set."""

COMPILE_AFTER = 500_000
"""Samples after which a function is compiled. Measured, for 2 to 30 joints: a step takes 0.1 to
0.16 ms to compile and 0.3 ns a sample to replay."""

LOOK_AFTER = 10_000
"""Samples after which the cache is asked: to name what it may have, the source is written."""

Wish = Literal["never", "auto", "always"]
Way = Literal["replayed", "compiled", "Drake"]


@dataclass(frozen=True)
class Evaluation:
    """How a function is evaluated, and why.

    Attributes
    ----------
    way : "compiled"; "replayed" by NumPy, with results that are the same to the bit; or, of a
        closed loop, by "Drake".
    reason : in a few words.
    """

    way: Way
    reason: str

    def __str__(self) -> str:
        return f"{self.way} ({self.reason})"


def wish() -> Wish:
    """Return what the environment says of compiling.

    Raises
    ------
    SettingError
        If it says what is not understood.
    """
    given = os.environ.get(VARIABLE, "") or "auto"
    for one in get_args(Wish):
        if given == one:
            return one
    what = f"'{given}' is none of {', '.join(get_args(Wish))}"
    raise SettingError(what, f"environment variable {VARIABLE}", "Correct it, or unset it")
