"""Units of a formula's parameters, from those of its signals and of the torque that it makes.

Sums need terms of one unit, `sin` and `cos` an angle, `tanh` and `exp` a pure number, `sign` a
speed. Each of these is a linear equation in the exponents of the base units; together they give the
units of all parameters, or say what is nonsense.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog

from dynident.errors import EffectError
from dynident.formulas.formula_tree import (
    Formula,
    Number,
    Operation,
    Signal,
    Unknown,
    nodes,
    text_of,
)

BASE = ("N", "m", "rad", "s", "degC")
"""Base units, in the order of exponents."""
_DENOMINATOR = 12  # of exponents: roots of powers have no others
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Unit:
    """A product of powers of base units.

    Attributes
    ----------
    exponents : of `BASE`.
    """

    exponents: tuple[float, ...] = (0.0,) * len(BASE)

    @classmethod
    def of(cls, **powers: float) -> Unit:
        """Return a unit of powers of base units, by their names."""
        return cls(tuple(float(powers.get(name, 0.0)) for name in BASE))

    def __str__(self) -> str:
        above = [_power(n, e) for n, e in zip(BASE, self.exponents, strict=True) if e > 0]
        below = [_power(n, -e) for n, e in zip(BASE, self.exponents, strict=True) if e < 0]
        if not below:
            return " ".join(above) or "1"
        divisor = below[0] if len(below) == 1 else f"({' '.join(below)})"
        return f"{' '.join(above) or '1'}/{divisor}"


SPEEDS = (Unit.of(rad=1, s=-1), Unit.of(m=1, s=-1))
ANGLE = Unit.of(rad=1)
NONE = Unit()


def units_of(
    formula: Formula, signal_unit: Callable[[Signal], Unit], result: Unit
) -> Mapping[str, Unit]:
    """Return the unit of each parameter, by its name.

    A number has no unit where the formula makes sense so. Where it does not, one that is added to
    something, or one that is not whole, carries a unit: 0.05 in `tanh(v/0.05)` is a speed. Of the
    ways to do so, that with the least exponents is taken.

    Parameters
    ----------
    formula : of the torque.
    signal_unit : of each signal.
    result : unit of the formula.

    Raises
    ------
    EffectError
        If there are no units with which the formula makes sense, or more than one set of them.
    """
    return _Equations(formula, signal_unit).solved(result)


@dataclass
class _Exponents:
    """Exponents of a node: a known part, and multiples of the exponents of unknown units."""

    known: np.ndarray
    unknown: dict[str, float] = field(default_factory=dict)

    def plus(self, other: _Exponents, factor: float) -> _Exponents:
        found = dict(self.unknown)
        for name, value in other.unknown.items():
            found[name] = found.get(name, 0.0) + factor * value
        kept = {name: value for name, value in found.items() if value != 0.0}
        return _Exponents(self.known + factor * other.known, kept)

    def times(self, factor: float) -> _Exponents:
        return _Exponents(factor * self.known, {k: factor * x for k, x in self.unknown.items()})


class _Equations:
    """The equations of a formula; unknown are its parameters, and numbers that may have units."""

    def __init__(self, formula: Formula, signal_unit: Callable[[Signal], Unit]) -> None:
        self._signal_unit = signal_unit
        self._numbers = 0
        self._rows: list[tuple[_Exponents, str]] = []
        self._names = {n.name for n in nodes(formula) if isinstance(n, Unknown)}
        self._found = self._exponents(formula, added=False)

    def solved(self, result: Unit) -> Mapping[str, Unit]:
        """Return the units of the parameters if the formula has that of the result."""
        what = f"the formula is in {self._words(self._found)}, and a torque in {result} is needed"
        self._equal(self._found, _Exponents(np.array(result.exponents)), what)
        unknown = list(dict.fromkeys(n for row, _ in self._rows for n in row.unknown))
        matrix = np.array([[row.unknown.get(n, 0.0) for n in unknown] for row, _ in self._rows])
        right = -np.array([row.known for row, _ in self._rows])
        for k in range(1, len(self._rows) + 1):
            fit = np.linalg.lstsq(matrix[:k], right[:k], rcond=None)[0]
            if not np.allclose(matrix[:k] @ fit, right[:k], atol=_ROUNDING):
                raise EffectError(self._rows[k - 1][1], remedy=_REMEDY)
        if self._names >= set(unknown):
            values = np.linalg.lstsq(matrix, right, rcond=None)[0]
        else:
            values = _sparsest(matrix, right, [name not in self._names for name in unknown])
        pure = np.all(np.abs(values) < _ROUNDING, axis=1)
        kept = [k for k, name in enumerate(unknown) if name in self._names or not pure[k]]
        self._require_unique(matrix[:, kept], [unknown[k] for k in kept])
        rounded = np.round(values * _DENOMINATOR) / _DENOMINATOR + 0.0
        return {
            n: Unit(tuple(x.tolist()))
            for n, x in zip(unknown, rounded, strict=True)
            if n in self._names
        }

    def _require_unique(self, matrix: np.ndarray, unknown: list[str]) -> None:
        values = np.linalg.svd(matrix)
        rank = int(np.sum(values.S > _ROUNDING))
        loose = np.any(np.abs(values.Vh[rank:]) > _ROUNDING, axis=0)
        names = [n for n, one in zip(unknown, loose, strict=True) if one and n in self._names]
        if names:
            what = f"the units of {' and '.join(names)} can be anything: only together they count"
            raise EffectError(what, remedy="leave one of them out, or put a number in its place")

    def _exponents(self, node: Formula, *, added: bool) -> _Exponents:
        match node:
            case Number(value):
                self._numbers += 1
                loose = added or value == 0.0 or value != round(value)
                return _Exponents(np.zeros(len(BASE)), {f"#{self._numbers}": 1.0} if loose else {})
            case Unknown(name):
                return _Exponents(np.zeros(len(BASE)), {name: 1.0})
            case Signal():
                return _Exponents(np.array(self._signal_unit(node).exponents))
            case Operation("^", (base, Number(power))):
                return self._exponents(base, added=False).times(power)
        each = [self._exponents(one, added=node.name in "+-") for one in node.of]
        return self._made(node, each)

    def _made(self, node: Operation, each: list[_Exponents]) -> _Exponents:
        first = each[0]
        match node.name:
            case "+" | "-":
                words = " and ".join(self._words(one) for one in each)
                self._equal(first, each[1], f"{text_of(node)} adds {words}")
            case "*":
                return first.plus(each[1], 1.0)
            case "/":
                return first.plus(each[1], -1.0)
            case "sqrt":
                return first.times(0.5)
            case "sin" | "cos":
                self._argument(node, first, ANGLE)
                return _Exponents(np.zeros(len(BASE)))
            case "tanh" | "exp":
                self._argument(node, first, NONE)
                return _Exponents(np.zeros(len(BASE)))
            case "sign":
                self._speed(node, first)
                return _Exponents(np.zeros(len(BASE)))
        return first

    def _argument(self, node: Operation, first: _Exponents, unit: Unit) -> None:
        needed = "a pure number" if unit == NONE else str(unit)
        what = f"{text_of(node)} is of {self._words(first)}, and {needed} is needed"
        self._equal(first, _Exponents(np.array(unit.exponents)), what)

    def _speed(self, node: Operation, first: _Exponents) -> None:
        speeds = [n for n in nodes(node) if isinstance(n, Signal) and n.quantity == "v"]
        if not speeds:
            remedy = "write tanh(x/width) for the sign of anything else"
            raise EffectError(f"{text_of(node)} is not of a speed", remedy=remedy)
        self._argument(node, first, self._signal_unit(speeds[0]))

    def _equal(self, left: _Exponents, right: _Exponents, what: str) -> None:
        self._rows.append((left.plus(right, -1.0), what))

    def _words(self, one: _Exponents) -> str:
        known = Unit(tuple(one.known.tolist()))
        named = [_power(n, e) for n, e in one.unknown.items() if not n.startswith("#")]
        if not named:
            return "a number" if one.unknown else str(known)
        words = f"the unit of {' '.join(named)}"
        return words if known == NONE else f"{words} times {known}"


_REMEDY = "divide by a parameter, or a number with a decimal point, that has the missing unit"


def _sparsest(matrix: np.ndarray, right: np.ndarray, numbers: list[bool]) -> np.ndarray:
    """The solution, column by column of `right`, with the least exponents of numbers in sum."""
    size = matrix.shape[1]
    cost = np.concatenate([np.array(numbers, dtype=float), np.array(numbers, dtype=float)])
    found = np.zeros((size, right.shape[1]))
    for k, wanted in enumerate(right.T):
        answer = linprog(cost, A_eq=np.hstack([matrix, -matrix]), b_eq=wanted)
        if not answer.success:  # the equations were found to have a solution
            raise EffectError("the formula's units cannot be told", remedy=_REMEDY)
        found[:, k] = answer.x[:size] - answer.x[size:]
    return found


def _power(name: str, exponent: float) -> str:
    if math.isclose(exponent, 1.0):
        return name
    return f"{name}^{exponent:.4g}"
