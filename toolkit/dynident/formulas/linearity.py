"""In which parameters a formula is linear, what they multiply, and that it vanishes with them."""

from __future__ import annotations

from collections.abc import Collection

from dynident.errors import EffectError
from dynident.formulas.formula_tree import Formula, Number, Operation, Unknown, nodes, text_of


def linear_parameters(formula: Formula, shapes: Collection[str]) -> tuple[str, ...]:
    """Return the parameters in which the formula is linear: all but the shapes, in their order.

    Every term must hold exactly one of them as a factor, so that the torque is zero where they are.

    Parameters
    ----------
    formula : of a torque.
    shapes : names of the parameters that may stand anywhere.

    Raises
    ------
    EffectError
        If a shape does not occur, no other parameter is left, one of those left stands inside a
        function, a power, a divisor or a product with another, or a term holds none.
    """
    found = [node.name for node in nodes(formula) if isinstance(node, Unknown)]
    for name in shapes:
        if name not in found:
            raise EffectError(f"'{name}' has a range and is not in the formula", remedy=_RANGE)
    names = tuple(dict.fromkeys(name for name in found if name not in shapes))
    if not names:
        remedy = "put a parameter before it, as c in c*v: its size is what the data tell"
        raise EffectError("the formula has no factor to identify", remedy=remedy)
    if _degree(formula, frozenset(shapes)) != 1:
        raise _not_vanishing(formula)
    return names


def multiplied_by(formula: Formula, name: str, shapes: Collection[str]) -> Formula:
    """Return what a linear parameter multiplies: the formula where it is one, and others zero.

    Parameters
    ----------
    formula : linear in all parameters but the shapes, see `linear_parameters`.
    name : of the parameter.
    shapes : names of those that may stand anywhere.
    """
    match formula:
        case Unknown(own) if own not in shapes:
            return _ONE if own == name else _ZERO
        case Operation(kind, of):
            return _simplified(kind, [multiplied_by(one, name, shapes) for one in of])
    return formula


_ZERO, _ONE = Number(0.0), Number(1.0)


def _simplified(kind: str, of: list[Formula]) -> Formula:
    """An operation without terms that are zero and factors that are one."""
    zeros = [one == _ZERO for one in of]
    match kind:
        case "+" if any(zeros):
            return of[0] if zeros[1] else of[1]
        case "-" if any(zeros):
            return of[0] if zeros[1] else _simplified("neg", of[1:])
        case "*" if any(zeros):
            return _ZERO
        case "*" if _ONE in of:
            return of[0] if of[1] == _ONE else of[1]
        case "/" | "neg" if zeros[0]:
            return _ZERO
    return Operation(kind, tuple(of))


_RANGE = "name in `shape` what the formula holds"


def _degree(formula: Formula, shapes: frozenset[str]) -> int | None:
    """Of the linear parameters in a formula; None for zero, which has any."""
    match formula:
        case Number(value):
            return None if value == 0.0 else 0
        case Unknown(name):
            return 0 if name in shapes else 1
        case Operation():
            return _of_operation(formula, shapes)
    return 0


def _of_operation(formula: Operation, shapes: frozenset[str]) -> int | None:
    name, operands = formula.name, formula.of
    if name == "/":
        _require_none(operands[1], shapes, "stands in a divisor")
        return _degree(operands[0], shapes)
    if name not in ("+", "-", "*", "neg"):
        what = "stands in a power" if name == "^" else f"stands inside {name}(...)"
        _require_none(operands[0], shapes, what)
        return 0
    each = [_degree(one, shapes) for one in operands]
    if name == "*":
        if None in each:
            return None
        if each == [1, 1]:
            names = " and ".join(_linear(formula, shapes))
            remedy = "one is enough, or give the other a range, shape = { x = [low, high] }"
            raise EffectError(f"the formula multiplies the parameters {names}", remedy=remedy)
        return max(one or 0 for one in each)
    known = {one for one in each if one is not None}
    if len(known) > 1:
        raise _not_vanishing(operands[each.index(0)])
    return known.pop() if known else None


def _linear(formula: Formula, shapes: frozenset[str]) -> list[str]:
    own = (one.name for one in nodes(formula) if isinstance(one, Unknown))
    return [name for name in dict.fromkeys(own) if name not in shapes]


def _require_none(formula: Formula, shapes: frozenset[str], where: str) -> None:
    for name in _linear(formula, shapes):
        remedy = f"give it a range: shape = {{ {name} = [low, high] }}"
        raise EffectError(f"'{name}' {where}", remedy=remedy)


def _not_vanishing(formula: Formula) -> EffectError:
    what = f"the term {text_of(formula)} stands without a parameter as its factor"
    return EffectError(what, remedy="multiply every term with a parameter to be identified")
