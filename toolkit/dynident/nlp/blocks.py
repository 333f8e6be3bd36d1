"""What a nonlinear program is made of: variables, residuals, costs and constraints.

Expressions are CasADi's. The symbol of a variable is an `MX`: matrices of numbers stay whole in it,
where an `SX` would write out each of their products and take twenty times as long to differentiate.
Scalar arithmetic is quickest the other way around: as a `casadi.Function` of `SX`, called with the
symbols of the program.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import ProgramError
from dynident.tables import number


class _Rows:
    """What has a name, and rows with units."""

    name: str
    rows: int
    unit: str | tuple[str, ...]

    @property
    def head(self) -> tuple[str, str, str]:
        """Its name, its number of rows and its units, as cells of a table."""
        units = dict.fromkeys(unit for _, unit in self.cells)
        return self.name, str(self.rows), ", ".join(units)

    @property
    def cells(self) -> list[tuple[str, str]]:
        """The name and the unit of each row, as cells of a table."""
        units = (self.unit,) * self.rows if isinstance(self.unit, str) else self.unit
        names = [f"{self.name}[{i}]" if self.rows > 1 else self.name for i in range(self.rows)]
        return [(name, unit or "-") for name, unit in zip(names, units, strict=True)]


@dataclass(frozen=True, eq=False)
class Variable(_Rows):
    """A vector of unknowns.

    `dataclasses.replace(variable, upper=...)` keeps its symbol, so that expressions stay valid.

    Attributes
    ----------
    name : unique in a program.
    rows : number of entries k.
    unit : of all entries, or one for each.
    lower, upper : (k,) or one number, in the unit; may be infinite. Equal ones fix an entry.
    start : (k,) or one number, where a solver begins; moved within the bounds.
    scale : (k,) or one number above 0, the size that is expected: the solver sees entry / scale.
    symbol : casadi.MX (k, 1), to write expressions with; made here.

    Raises
    ------
    ProgramError
        If numbers are missing, contradictory or of another shape.
    """

    name: str
    rows: int = 1
    unit: str | tuple[str, ...] = ""
    lower: Any = field(default=-np.inf, kw_only=True)
    upper: Any = field(default=np.inf, kw_only=True)
    start: Any = field(default=0.0, kw_only=True)
    scale: Any = field(default=1.0, kw_only=True)
    symbol: Any = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        rows, where = self.rows, f"variable {self.name}"
        if rows < 1:
            raise ProgramError(f"has {rows} entries", where, "give it at least one")
        unit = (self.unit,) * rows if isinstance(self.unit, str) else tuple(self.unit)
        if len(unit) != rows:
            raise ProgramError(f"has {rows} entries and {len(unit)} units", where)
        lower, upper = _bounds(self.lower, self.upper, rows, where)
        scale = numbers_of(self.scale, rows, where, "scale")
        if not np.all((scale > 0) & np.isfinite(scale)):
            raise ProgramError("scale is not positive", where, "Give the size that is expected")
        start = np.clip(numbers_of(self.start, rows, where, "start"), lower, upper)
        symbol = ca.MX.sym(self.name, rows) if self.symbol is None else self.symbol
        if tuple(symbol.shape) != (rows, 1):
            raise ProgramError(f"has {rows} entries and a symbol of {symbol.shape}", where)
        _set(self, unit=unit, lower=lower, upper=upper, start=start, scale=scale, symbol=symbol)


@dataclass(frozen=True, eq=False)
class Expression(_Rows):
    """A column in the symbols of a program's variables.

    Attributes
    ----------
    name : unique in a program.
    expression : casadi.MX (k, 1).
    unit : of the rows.
    rows : number of rows.

    Raises
    ------
    ProgramError
        If the expression is no column of `MX`, or does not suit what else is given.
    """

    name: str
    expression: Any
    unit: str = ""
    rows: int = field(init=False)

    def __post_init__(self) -> None:
        where, given = f"{type(self).__name__.lower()} {self.name}", self.expression
        if isinstance(given, ca.SX):
            remedy = "Make a casadi.Function of it and call that with the symbols of the variables"
            raise ProgramError("the expression is an SX", where, remedy)
        try:
            column = given if isinstance(given, ca.MX) else ca.MX(given)
        except (NotImplementedError, TypeError):
            what = f"{type(given).__name__} is no CasADi expression"
            raise ProgramError(what, where, "Give an MX") from None
        if column.shape[1] != 1 or column.shape[0] < 1:
            what = f"the expression has the shape {tuple(column.shape)}"
            raise ProgramError(what, where, "Give a column")
        _set(self, expression=ca.densify(column), rows=int(column.shape[0]))
        self._check(where)

    def _check(self, where: str) -> None:
        """Check what else is given."""


@dataclass(frozen=True, eq=False)
class Residual(Expression):
    """Rows r = matrix @ expression - target that enter the objective as 1/2 |r|^2: data, a prior.

    A matrix of numbers belongs here and not into the expression: exact second derivatives are then
    formed without differentiating through it, twice as quick from fifty unknowns on. One of more
    rows than columns is replaced by its triangular factor, so that the time of an iteration does
    not depend on the length of the data; what no expression explains remains as the last row, and
    the objective is the same number.

    Attributes
    ----------
    matrix, target : (r, k), (r,); default: the rows are the expression itself.
    residual : casadi.MX (r, 1), the rows.
    cost : casadi.MX (1, 1), the term of the objective.
    """

    matrix: Any = field(default=None, kw_only=True)
    target: Any = field(default=None, kw_only=True)

    def _check(self, where: str) -> None:
        A = np.eye(self.rows) if self.matrix is None else np.asarray(self.matrix, float)
        b = np.zeros(len(A)) if self.target is None else np.asarray(self.target, float)
        if A.shape != (*b.shape, self.rows):
            what = f"matrix {A.shape}, expression ({self.rows},) and target {b.shape} do not fit"
            raise ProgramError(what, where)
        if not np.all(np.isfinite(A)) or not np.all(np.isfinite(b)):
            raise ProgramError("the matrix or the target is not finite", where)
        if len(b) > self.rows + 1:
            factor = np.asarray(np.linalg.qr(np.column_stack([A, b]), mode="r"))
            A, b = factor[:, :-1], factor[:, -1]
        _set(self, matrix=A, target=b, rows=len(b))

    @property
    def residual(self) -> Any:
        return ca.mtimes(ca.sparsify(ca.DM(self.matrix)), self.expression) - ca.DM(self.target)

    @property
    def cost(self) -> Any:
        return 0.5 * ca.sumsqr(self.residual)


@dataclass(frozen=True, eq=False)
class Cost(Expression):
    """A scalar that is added to the objective: an entropic prior, say."""

    def _check(self, where: str) -> None:
        if self.rows != 1:
            what = f"has {self.rows} rows"
            raise ProgramError(what, where, "add up a scalar, or pose a Residual")

    @property
    def cost(self) -> Any:
        return self.expression


@dataclass(frozen=True, eq=False)
class Constraint(Expression):
    """Rows that must lie between bounds.

    Attributes
    ----------
    lower, upper : (r,) or one number, in the unit; may be infinite. Equal ones are an equation.
    """

    lower: Any = field(default=-np.inf, kw_only=True)
    upper: Any = field(default=np.inf, kw_only=True)

    def _check(self, where: str) -> None:
        lower, upper = _bounds(self.lower, self.upper, self.rows, where)
        _set(self, lower=lower, upper=upper)


Block = Variable | Residual | Cost | Constraint


def numbers_of(given: ArrayLike, size: int, where: str, what: str) -> np.ndarray:
    """Return numbers as (size,), none of them NaN.

    Parameters
    ----------
    given : (size,), or one number for all.
    size : number of entries.
    where, what : the block, and which of its numbers they are, for the message.

    Raises
    ------
    ProgramError
        If the shape is another, or a number is missing.
    """
    try:
        found = np.asarray(given, float)
    except (TypeError, ValueError):
        raise ProgramError(f"{what} is not made of numbers", where) from None
    if found.shape not in ((), (1,), (size,), (size, 1)):
        remedy = f"Give {size} numbers, or one for all"
        raise ProgramError(f"{what} has the shape {found.shape}", where, remedy)
    found = np.array(np.broadcast_to(found.ravel(), (size,)))
    if np.any(np.isnan(found)):
        raise ProgramError(f"{what} is NaN", f"{where}, entry {np.argmax(np.isnan(found))}")
    found.setflags(write=False)
    return found


def between(lower: np.ndarray, upper: np.ndarray) -> str:
    """Bounds in a cell; those of several rows by their extremes."""
    if np.all(lower == upper):
        return f"= {spread(lower)}"
    low, high = float(lower.min()), float(upper.max())
    if low == -np.inf and high == np.inf:
        free = np.all(np.isinf(lower) & np.isinf(upper))
        return "free" if free else "some entries bounded"
    if high == np.inf:
        return f">= {number(low)}"
    return f"<= {number(high)}" if low == -np.inf else f"{number(low)} to {number(high)}"


def spread(values: np.ndarray) -> str:
    """Numbers in a cell, by their extremes."""
    low, high = number(float(values.min())), number(float(values.max()))
    return low if low == high else f"{low} to {high}"


def _bounds(lower: Any, upper: Any, size: int, where: str) -> tuple[np.ndarray, np.ndarray]:
    low = numbers_of(lower, size, where, "lower bound")
    high = numbers_of(upper, size, where, "upper bound")
    wrong = (low > high) | (low == np.inf) | (high == -np.inf)
    if np.any(wrong):
        i = int(np.argmax(wrong))
        what = f"no number lies between the bounds {low[i]:g} and {high[i]:g}"
        raise ProgramError(what, f"{where}, entry {i}")
    return low, high


def _set(block: Variable | Expression, **checked: Any) -> None:
    """Put checked values in the place of those given to a frozen block."""
    for name, value in checked.items():
        object.__setattr__(block, name, value)
