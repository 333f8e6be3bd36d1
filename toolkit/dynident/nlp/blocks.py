"""What a nonlinear program is made of: variables, residual blocks, costs and constraints.

Expressions are CasADi's. The symbol of a variable is an `MX`: matrices of numbers stay whole in it,
where an `SX` would write out each of their products and take twenty times as long to differentiate.
Scalar arithmetic is quickest the other way around: as a `casadi.Function` of `SX`, called with the
symbols of the program.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import ProgramError


@dataclass(frozen=True, eq=False)
class Variable:
    """A vector of unknowns.

    `dataclasses.replace(variable, upper=...)` keeps its symbol, so that expressions stay valid.

    Attributes
    ----------
    name : unique in a program.
    size : number of entries k.
    unit : of all entries, or one for each.
    lower, upper : (k,) or one number, in the unit; may be infinite. Equal ones fix an entry.
    start : (k,) or one number, where a solver begins; default: what is nearest to 0 in the bounds.
    scale : (k,) or one number above 0, the size that is expected: the solver sees entry / scale.
    symbol : casadi.MX (k, 1), to write expressions with; made here.

    Raises
    ------
    ProgramError
        If numbers are missing, contradictory or of another shape.
    """

    name: str
    size: int = 1
    unit: str | tuple[str, ...] = ""
    lower: Any = -np.inf
    upper: Any = np.inf
    start: Any = 0.0
    scale: Any = 1.0
    symbol: Any = None

    def __post_init__(self) -> None:
        import casadi as ca

        where = f"variable {self.name}"
        if self.size < 1:
            raise ProgramError(f"has {self.size} entries", where, "give it at least one")
        lower, upper = _checked_bounds(self.lower, self.upper, self.size, where)
        start = numbers_of(self.start, self.size, where, "start")
        scale = _checked_scale(self.scale, self.size, where)
        unit = (self.unit,) * self.size if isinstance(self.unit, str) else tuple(self.unit)
        if len(unit) != self.size:
            raise ProgramError(f"has {self.size} entries and {len(unit)} units", where)
        symbol = ca.MX.sym(self.name, self.size) if self.symbol is None else self.symbol
        if tuple(symbol.shape) != (self.size, 1):
            raise ProgramError(f"has {self.size} entries and a symbol of {symbol.shape}", where)
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        object.__setattr__(self, "start", np.clip(start, lower, upper))
        object.__setattr__(self, "scale", scale)
        object.__setattr__(self, "symbol", symbol)


@dataclass(frozen=True, eq=False)
class Residual:
    """Rows r that enter the objective as 1/2 |r|^2: data, or a quadratic prior.

    Attributes
    ----------
    name : unique in a program.
    expression : casadi.MX (r, 1).
    unit : of the rows.
    inner, matrix : the expression is matrix (r, k) times inner (k, 1), and a constant; by default
        itself. `Residual.linear` gives them: curvature is then that of the inner expression, which
        depends on few variables an entry, where an entry of the rows depends on all of them.
    """

    name: str
    expression: Any
    unit: str = ""
    # Not to be given, or `dataclasses.replace` would keep those of another expression.
    inner: Any = field(init=False, repr=False)
    matrix: np.ndarray | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        expression = _expression(self.expression, f"residual {self.name}")
        object.__setattr__(self, "expression", expression)
        object.__setattr__(self, "inner", expression)
        object.__setattr__(self, "matrix", None)

    @classmethod
    def linear(
        cls, name: str, matrix: ArrayLike, expression: Any, target: ArrayLike, unit: str = ""
    ) -> Residual:
        """Rows matrix @ expression - target, in as few rows as give the same sum of squares.

        The way to pose a matrix of numbers: exact second derivatives are formed without
        differentiating through it, many times quicker from a hundred unknowns on. A matrix of more
        rows than columns is replaced by its triangular factor, so that the time of an iteration
        does not depend on the length of the data; what no expression explains remains as the last
        row, and the objective is the same number.

        Parameters
        ----------
        name : unique in a program.
        matrix : (r, k).
        expression : casadi.MX (k, 1).
        target : (r,).
        unit : of the rows.

        Raises
        ------
        ProgramError
            If shapes differ, or a number is not finite.
        """
        import casadi as ca

        where = f"residual {name}"
        A, b = np.asarray(matrix, float), np.asarray(target, float)
        inner = _expression(expression, where)
        size = int(inner.shape[0])
        if A.ndim != 2 or A.shape[1] != size or b.shape != A.shape[:1]:
            what = f"matrix {A.shape}, expression ({size},) and target {b.shape} do not fit"
            raise ProgramError(what, where)
        if not np.all(np.isfinite(A)) or not np.all(np.isfinite(b)):
            raise ProgramError("the matrix or the target is not finite", where)
        if len(b) > size + 1:
            factor = np.asarray(np.linalg.qr(np.column_stack([A, b]), mode="r"))
            A, b = factor[:, :-1], factor[:, -1]
        residual = cls(name, ca.mtimes(ca.DM(A), inner) - ca.DM(b), unit)
        object.__setattr__(residual, "inner", inner)
        object.__setattr__(residual, "matrix", A)
        return residual

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.expression.shape[0])

    @property
    def term(self) -> str:
        """The term of the objective, in words."""
        return f"1/2 |{self.name}|^2"

    @property
    def cost(self) -> Any:
        """The term of the objective, casadi.MX (1, 1)."""
        import casadi as ca

        return 0.5 * ca.sumsqr(self.expression)


@dataclass(frozen=True, eq=False)
class Cost:
    """A scalar that is added to the objective: an entropic prior, say.

    Attributes
    ----------
    name : unique in a program.
    expression : casadi.MX (1, 1).
    unit : of the scalar.
    """

    name: str
    expression: Any
    unit: str = ""

    def __post_init__(self) -> None:
        where = f"cost {self.name}"
        expression = _expression(self.expression, where)
        if expression.shape[0] != 1:
            what = f"has {expression.shape[0]} rows"
            raise ProgramError(what, where, "add up a scalar, or pose a Residual")
        object.__setattr__(self, "expression", expression)

    @property
    def rows(self) -> int:
        """Number of rows: one."""
        return 1

    @property
    def term(self) -> str:
        """The term of the objective, in words."""
        return self.name

    @property
    def cost(self) -> Any:
        """The term of the objective, casadi.MX (1, 1)."""
        return self.expression


@dataclass(frozen=True, eq=False)
class Constraint:
    """Rows that must lie between bounds.

    Attributes
    ----------
    name : unique in a program.
    expression : casadi.MX (r, 1).
    lower, upper : (r,) or one number, in the unit; may be infinite. Equal ones are an equation.
    unit : of the rows.
    scale : (r,) or one number above 0, the size of a row that counts as one; default: how much the
        row changes when a variable changes by its scale, at the start.
    """

    name: str
    expression: Any
    lower: Any = -np.inf
    upper: Any = np.inf
    unit: str = ""
    scale: Any = None

    def __post_init__(self) -> None:
        where = f"constraint {self.name}"
        expression = _expression(self.expression, where)
        rows = int(expression.shape[0])
        lower, upper = _checked_bounds(self.lower, self.upper, rows, where)
        object.__setattr__(self, "expression", expression)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        if self.scale is not None:
            object.__setattr__(self, "scale", _checked_scale(self.scale, rows, where))

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.expression.shape[0])


def numbers_of(given: ArrayLike, size: int, where: str, what: str) -> np.ndarray:
    """Numbers as (size,), one number for all entries; none of them NaN.

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
        index = int(np.flatnonzero(np.isnan(found))[0])
        raise ProgramError(f"{what} is NaN", f"{where}, entry {index}")
    found.setflags(write=False)
    return found


def _checked_bounds(
    lower: ArrayLike, upper: ArrayLike, size: int, where: str
) -> tuple[np.ndarray, np.ndarray]:
    low = numbers_of(lower, size, where, "lower bound")
    high = numbers_of(upper, size, where, "upper bound")
    wrong = (low > high) | (low == np.inf) | (high == -np.inf)
    if np.any(wrong):
        i = int(np.flatnonzero(wrong)[0])
        what = f"no number lies between the bounds {low[i]:g} and {high[i]:g}"
        raise ProgramError(what, f"{where}, entry {i}")
    return low, high


def _checked_scale(given: ArrayLike, size: int, where: str) -> np.ndarray:
    scale = numbers_of(given, size, where, "scale")
    if not np.all((scale > 0) & np.isfinite(scale)):
        raise ProgramError("scale is not positive", where, "Give the size that is expected")
    return scale


def _expression(given: Any, where: str) -> Any:
    """An expression as a column of casadi.MX."""
    import casadi as ca

    if isinstance(given, ca.SX):
        remedy = "Make a casadi.Function of it and call that with the symbols of the variables"
        raise ProgramError("the expression is an SX", where, remedy)
    try:
        expression = given if isinstance(given, ca.MX) else ca.MX(given)
    except (NotImplementedError, TypeError):
        kind = type(given).__name__
        raise ProgramError(f"{kind} is no CasADi expression", where, "Give an MX") from None
    if expression.shape[1] != 1 or expression.shape[0] < 1:
        what = f"the expression has the shape {tuple(expression.shape)}"
        raise ProgramError(what, where, "Give a column")
    return ca.densify(expression)
