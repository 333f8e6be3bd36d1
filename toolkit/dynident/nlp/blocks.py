"""The parts of a nonlinear program: variables, residuals, costs and constraints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import FitError


@dataclass(frozen=True, eq=False)
class Variable:
    """Unknowns of a program, in SI units.

    Attributes
    ----------
    name : str
    size : number of entries.
    unit : of the entries, one for all or one for each.
    lower, upper : bounds, one for all or (size,).
    start : where a solver starts, one for all or (size,).
    scale : their size, positive: the solver sees entries divided by it.
    """

    name: str
    size: int = 1
    unit: str | tuple[str, ...] = ""
    lower: ArrayLike = -np.inf
    upper: ArrayLike = np.inf
    start: ArrayLike = 0.0
    scale: ArrayLike = 1.0

    def __post_init__(self) -> None:
        for which in ("lower", "upper", "start", "scale"):
            value = np.asarray(getattr(self, which), dtype=float)
            if value.shape not in ((), (self.size,)) or np.any(np.isnan(value)):
                mend = f"give one number, or {self.size} of them"
                raise FitError(f"{which} is no number or has shape {value.shape}", self.name, mend)
            object.__setattr__(self, which, np.broadcast_to(value, (self.size,)))
        if not np.all(np.asarray(self.scale) > 0):
            raise FitError("a scale is not positive", self.name, "give the size of the entries")
        if not np.all(np.asarray(self.lower) <= np.asarray(self.upper)):
            raise FitError("a lower bound is above the upper one", self.name, "swap them")

    @cached_property
    def symbol(self) -> Any:
        """The unknowns as a CasADi expression (size, 1), to build residuals with."""
        return ca.MX.sym(self.name, self.size)


@dataclass(frozen=True, eq=False)
class Residual:
    """Rows that enter the objective as half the sum of their squares.

    Attributes
    ----------
    expression : CasADi expression (rows, 1) of the variables' symbols.
    unit : of the rows; "1" where they are in units of their noise.
    """

    name: str
    expression: Any
    unit: str = "1"


@dataclass(frozen=True, eq=False)
class Cost:
    """A term of the objective: a prior that is no sum of squares, say.

    Attributes
    ----------
    expression : scalar CasADi expression.
    """

    name: str
    expression: Any


@dataclass(frozen=True, eq=False)
class Constraint:
    """lower <= expression <= upper, entry by entry; equal bounds make an equality.

    Attributes
    ----------
    expression : CasADi expression (rows, 1).
    lower, upper : one number, or (rows,).
    unit : of the rows.
    """

    name: str
    expression: Any
    lower: ArrayLike = -np.inf
    upper: ArrayLike = np.inf
    unit: str = ""

    def __post_init__(self) -> None:
        rows = int(ca.MX(self.expression).numel())
        for which in ("lower", "upper"):
            value = np.asarray(getattr(self, which), dtype=float)
            if value.shape not in ((), (rows,)) or np.any(np.isnan(value)):
                mend = f"give one number, or {rows} of them"
                raise FitError(f"{which} is no number or has shape {value.shape}", self.name, mend)
            object.__setattr__(self, which, np.broadcast_to(value, (rows,)))
        if not np.all(np.asarray(self.lower) <= np.asarray(self.upper)):
            raise FitError("a lower bound is above the upper one", self.name, "swap them")
