"""Exact derivatives of a formula by its parameters, computed from samples along with its value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from dynident.formulas.formula_tree import Formula, Number, Operation, Signal, Unknown
from dynident.formulas.formula_value import FUNCTIONS, Values, sign_joints

Slopes = dict[str, Any]
"""Derivative by each parameter on which a part of a formula depends, (T,) or a number."""


class SlopeValues(Values, Protocol):
    """Where a formula takes its values from, and the law of dry friction its derivative."""

    def sign_slope(self, sign: Any, joints: tuple[str | None, ...]) -> Any:
        """Return the derivative of `sign` by the speed, where it is `sign`."""
        ...


def evaluate_slopes(formula: Formula, values: SlopeValues, names: Sequence[str]) -> list[Any]:
    """Return the derivatives of a formula at every sample; each (T,), or a number.

    Parameters
    ----------
    formula : any.
    values : of what stands in it.
    names : parameters by which it is differentiated.

    Returns
    -------
    One for each name. Where a function has none, as a root at zero, what NumPy gives, unsaid.
    """
    with np.errstate(all="ignore"):
        _, slopes = _value_and_slopes(formula, values, frozenset(names))
    return [slopes.get(name, 0.0) for name in names]


def _value_and_slopes(
    formula: Formula, values: SlopeValues, names: frozenset[str]
) -> tuple[Any, Slopes]:
    """Forward, as dual numbers are multiplied; nothing is kept of parameters that do not occur."""
    match formula:
        case Number(value):
            return value, {}
        case Unknown(name):
            return values.parameter(name), {name: 1.0} if name in names else {}
        case Signal():
            return values.signal(formula), {}
        case Operation("^", (base, Number(power))):
            x, dx = _value_and_slopes(base, values, names)
            below = 1.0
            for _ in range(int(power) - 1):
                below = below * x
            return below * x, _times(dx, power * below)
        case Operation("sign", (speed,)):
            joints = sign_joints(speed)
            x, dx = _value_and_slopes(speed, values, names)
            found = values.sign(x, joints)
            return found, _times(dx, values.sign_slope(found, joints)) if dx else {}
        case Operation(name, (one,)):
            x, dx = _value_and_slopes(one, values, names)
            found = FUNCTIONS[name](x)
            return found, _times(dx, _CHAINS[name](x, found)) if dx else {}
    x, dx = _value_and_slopes(formula.of[0], values, names)
    y, dy = _value_and_slopes(formula.of[1], values, names)
    found = FUNCTIONS[formula.name](x, y)
    return found, _of_two(formula.name, (x, dx), (y, dy), found) if dx or dy else {}


_CHAINS: dict[str, Callable[[Any, Any], Any]] = {
    "sin": lambda x, found: np.cos(x),
    "cos": lambda x, found: -np.sin(x),
    "tanh": lambda x, found: 1.0 - found * found,
    "exp": lambda x, found: found,
    "sqrt": lambda x, found: np.divide(0.5, found),
    "abs": lambda x, found: np.sign(x),
    "neg": lambda x, found: -1.0,
}
"""Derivatives of functions, of the argument and what was found for it."""


def _of_two(name: str, left: tuple[Any, Slopes], right: tuple[Any, Slopes], found: Any) -> Slopes:
    (x, dx), (y, dy) = left, right
    match name:
        case "+":
            return _sum(dx, dy)
        case "-":
            return _sum(dx, _times(dy, -1.0))
        case "*":
            return _sum(_times(dx, y), _times(dy, x))
    return _sum(_times(dx, np.divide(1.0, y)), _times(dy, np.divide(-found, y)))


def _times(slopes: Slopes, factor: Any) -> Slopes:
    return {name: slope * factor for name, slope in slopes.items()}


def _sum(one: Slopes, other: Slopes) -> Slopes:
    both = {name: one[name] + other[name] for name in one if name in other}
    return {**one, **other, **both}
