"""A formula as a tree: numbers, parameters, signals of the motion, and operations on them."""

from __future__ import annotations

import json
import keyword
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Quantity = Literal["q", "v", "a", "load", "t", "temperature"]
"""Position, speed and acceleration of a joint; the torque that the model predicts for it, N m or N;
the time in the session, s; the temperature of its motor, degrees Celsius."""

FUNCTIONS = ("sin", "cos", "tanh", "exp", "sqrt", "abs", "sign")
"""`sign` is the study's law of dry friction, tanh(speed / friction width)."""


@dataclass(frozen=True)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True)
class Unknown:
    """A quantity to be identified."""

    name: str


@dataclass(frozen=True)
class Signal:
    """What is measured, or predicted, at each sample; `joint` None is the joint of the law."""

    quantity: Quantity
    joint: str | None = None


@dataclass(frozen=True)
class Operation:
    """A sum, a product or a function; of "^" the second operand is a whole number.

    Attributes
    ----------
    name : "+", "-", "*", "/", "^", "neg", or one of `FUNCTIONS`.
    of : one or two operands.
    """

    name: str
    of: tuple[Formula, ...]


Formula = Number | Unknown | Signal | Operation


def nodes(formula: Formula) -> Iterator[Formula]:
    """Yield every node, operands before what is made of them."""
    if isinstance(formula, Operation):
        for one in formula.of:
            yield from nodes(one)
    yield formula


_BINDS = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 3, "^": 4}


def text_of(formula: Formula) -> str:
    """Return the formula as it can be read again, with no more parentheses than it needs."""
    match formula:
        case Number(value):
            whole = value == int(value) and abs(value) < 1e6
            return str(int(value)) if whole else repr(value)
        case Unknown(name):
            return name
        case Signal(quantity, joint):
            return quantity if joint is None else f"{quantity}[{quoted_joint(joint)}]"
        case Operation("neg", (one,)):
            return f"-{_inside(one, _BINDS['neg'])}"
        case Operation(name, (left, right)):
            own = _BINDS[name]
            # a - (b - c) and a / (b / c) need theirs; powers are written of one thing only.
            first = _inside(left, own + (name == "^"))
            second = _inside(right, own + (name in "-/^"))
            return f"{first} {name} {second}" if own == 1 else f"{first}{name}{second}"
    return f"{formula.name}({text_of(formula.of[0])})"


def _inside(formula: Formula, binds: int) -> str:
    text = text_of(formula)
    if isinstance(formula, Operation) and _BINDS.get(formula.name, 9) < binds:
        return f"({text})"
    negative = isinstance(formula, Number) and formula.value < 0
    return f"({text})" if negative else text


def quoted_joint(joint: str) -> str:
    """Return the name of a joint as brackets hold it: in quotes unless it is a plain word."""
    plain = joint.isascii() and joint.isidentifier() and not keyword.iskeyword(joint)
    return joint if plain else json.dumps(joint, ensure_ascii=False)
