"""A formula computed from samples, or from symbols: the same code makes both."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from dynident.formulas.formula_tree import Formula, Number, Operation, Signal, Unknown, nodes

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "exp": np.exp,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "neg": np.negative,
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
}
"""What operations other than powers and `sign` are on arrays."""


class Values(Protocol):
    """Where a formula takes its values from: arrays of samples, or of symbols."""

    def signal(self, signal: Signal) -> Any:
        """Return a signal at every sample, (T,)."""
        ...

    def parameter(self, name: str) -> Any:
        """Return a parameter, a number or (T,)."""
        ...

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        """Return the law of dry friction of a speed that is made of joints' speeds."""
        ...


def evaluate(formula: Formula, values: Values) -> Any:
    """Return a formula at every sample; (T,), or a number where it depends on nothing.

    Parameters
    ----------
    formula : any.
    values : of what stands in it. Overflow and division by zero give what NumPy gives, unsaid.
    """
    with np.errstate(all="ignore"):
        return _value(formula, values)


def sign_joints(speed: Formula) -> tuple[str | None, ...]:
    """Return the joints whose motion is in the argument of `sign`, each once."""
    return tuple(dict.fromkeys(s.joint for s in nodes(speed) if isinstance(s, Signal)))


def _value(formula: Formula, values: Values) -> Any:
    match formula:
        case Number(value):
            return value
        case Unknown(name):
            return values.parameter(name)
        case Signal():
            return values.signal(formula)
        case Operation("^", (base, Number(power))):
            found = _value(base, values)
            result = found
            for _ in range(int(power) - 1):
                result = result * found
            return result
        case Operation("sign", (speed,)):
            return values.sign(_value(speed, values), sign_joints(speed))
    return FUNCTIONS[formula.name](*(_value(one, values) for one in formula.of))
