"""The text of a formula as a tree.

Python's own grammar reads the text; its tree is then walked by hand, and what is not listed here is
refused. Nothing is ever evaluated as code.
"""

from __future__ import annotations

import ast
import keyword
import math
import re
import warnings
from typing import NoReturn, get_args

from dynident.errors import EffectError
from dynident.formulas.formula_tree import (
    FUNCTIONS,
    Formula,
    Number,
    Operation,
    Quantity,
    Signal,
    Unknown,
    nodes,
)

LONGEST = 300
"""Characters of a formula."""
MOST_NODES = 160
DEEPEST = 60
HIGHEST_POWER = 4
_LARGEST = 1e12
_QUANTITIES: tuple[str, ...] = get_args(Quantity)
_OF_NO_JOINT = ("t",)
_POWER = re.compile(r"""("(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')|\^""")
_NAME = re.compile(r"[A-Za-z]\w{0,23}", re.ASCII)
_REMEDY = (
    "write numbers, pi, parameters, + - * / ^ (to a whole power up to 4), "
    f"{', '.join(FUNCTIONS)} of one argument, and the signals {', '.join(_QUANTITIES)} "
    "of this joint or, as q[elbow], of another"
)
_SYMBOLS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "^",
}
_REFUSED: dict[type[ast.AST], str] = {
    ast.Attribute: "a dot",
    ast.Compare: "a comparison",
    ast.BoolOp: "and, or",
    ast.IfExp: "if and else",
    ast.Lambda: "a function definition",
    ast.Tuple: "a comma",
    ast.List: "a list",
    ast.Dict: "a dictionary",
    ast.Set: "a set",
    ast.ListComp: "a loop",
    ast.GeneratorExp: "a loop",
    ast.NamedExpr: "an assignment",
    ast.JoinedStr: "a string",
    ast.Constant: "what is no number",
}


def parse_formula(text: str) -> Formula:
    """Read a formula.

    Parameters
    ----------
    text : numbers, `pi`, parameters (words of up to 24 letters, digits and underscores), signals
        (`q`, `v`, `a`, `load`, `temperature`, of this joint, or `q[elbow]` of another; `t`),
        `+ - * / ^`, parentheses and the functions of `dynident.formulas.formula_tree.FUNCTIONS`.

    Raises
    ------
    EffectError
        If it is longer than 300 characters, has more than 160 parts, is nested more than 60 deep,
        or holds anything else; the message says what, in one line.
    """
    if not isinstance(text, str):
        raise EffectError("a formula is a text", remedy=_REMEDY)
    if len(text) > LONGEST:
        raise _refused(text, f"is longer than {LONGEST} characters")
    if not text.strip():
        raise _refused(text, "is empty")
    if not text.isprintable():
        raise _refused(text, "holds a character that cannot be printed")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # ^ is exclusive or to Python, and binds less than a product; in quotes it is a name's.
            powers = _POWER.sub(lambda found: found[1] or "**", text)
            tree = ast.parse(powers.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        reason = getattr(error, "msg", None) or "too deeply nested, or not text"
        raise _refused(text, f"cannot be read ({' '.join(str(reason).split())[:80]})") from None
    formula = _Reading(text).node(tree.body, DEEPEST)
    if sum(1 for _ in nodes(formula)) > MOST_NODES:
        raise _refused(text, f"has more than {MOST_NODES} parts")
    return formula


class _Reading:
    """One text on its way to a tree; refusals cite it."""

    def __init__(self, text: str) -> None:
        self._text = text

    def node(self, node: ast.expr, depth: int) -> Formula:
        if depth == 0:
            self._refuse(f"is nested more than {DEEPEST} deep")
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self._number(value)
            case ast.Name(id=name):
                return self._named(name)
            case ast.Subscript(value=ast.Name(id=name), slice=place):
                return self._signal(name, place)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = self.node(operand, depth - 1)
                if isinstance(inner, Number):
                    return Number(-inner.value)
                return Operation("neg", (inner,))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.node(operand, depth - 1)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return Operation("^", (self.node(left, depth - 1), self._power(right)))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _SYMBOLS:
                pair = self.node(left, depth - 1), self.node(right, depth - 1)
                return Operation(_SYMBOLS[type(op)], pair)
            case ast.Call(func=ast.Name(id=name), args=[one], keywords=[]):
                return self._function(name, one, depth)
            case ast.Call(func=ast.Name(id=name)) if name in FUNCTIONS:
                self._refuse(f"gives {name} other than one argument")
        self._refuse(f"holds {_REFUSED.get(type(node), 'what no formula has')}")

    def _number(self, value: float) -> Number:
        # An integer of any length is a number to Python.
        if not abs(value) <= _LARGEST or not math.isfinite(value):
            self._refuse(f"holds a number beyond {_LARGEST:g}")
        return Number(float(value))

    def _named(self, name: str) -> Formula:
        if name == "pi":
            return Number(math.pi)
        if name in _QUANTITIES:
            return Signal(name)  # type: ignore[arg-type]
        if name in FUNCTIONS:
            self._refuse(f"names the function {name} without its argument")
        if not _NAME.fullmatch(name) or keyword.iskeyword(name):
            self._refuse(f"names a parameter '{name[:40]}': use up to 24 letters and digits")
        return Unknown(name)

    def _signal(self, name: str, place: ast.expr) -> Signal:
        if name not in _QUANTITIES or name in _OF_NO_JOINT:
            self._refuse(f"has brackets behind '{name[:40]}', which is no signal of a joint")
        match place:
            case ast.Name(id=joint):
                return Signal(name, joint)  # type: ignore[arg-type]
            case ast.Constant(value=str() as joint) if joint:
                return Signal(name, joint)  # type: ignore[arg-type]
        self._refuse(f'needs the name of a joint in {name}[...], in "quotes" if it is not a word')

    def _power(self, node: ast.expr) -> Number:
        match node:
            case ast.Constant(value=int() as power) if 2 <= power <= HIGHEST_POWER:
                return Number(float(power))
        self._refuse(f"has a power that is not 2, 3 or {HIGHEST_POWER}")

    def _function(self, name: str, one: ast.expr, depth: int) -> Operation:
        if name not in FUNCTIONS:
            self._refuse(f"calls '{name[:40]}'; functions: {', '.join(FUNCTIONS)}")
        return Operation(name, (self.node(one, depth - 1),))

    def _refuse(self, what: str) -> NoReturn:
        raise _refused(self._text, what)


def _refused(text: str, what: str) -> EffectError:
    shown = text if len(text) <= 60 else f"{text[:57]}..."
    return EffectError(f"the formula {shown!r} {what}", remedy=_REMEDY)
