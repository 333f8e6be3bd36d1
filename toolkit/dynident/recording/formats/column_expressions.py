"""Linear expressions of columns, for signals that a file holds in other coordinates.

`"motor_position[5]/32 - motor_position[4]/45"` is the last joint of an arm whose wrist is coupled
by its gears. Python's own grammar reads the text; its tree is then walked by hand, and whatever is
no number, name, sign, sum, product or quotient is refused. Nothing is ever evaluated as code.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from dataclasses import dataclass, field

from dynident.errors import RecordingError

LONGEST = 2000
"""Characters of an expression: two names of columns may be long, as topics of ROS are."""

_REMEDY = (
    "write numbers, pi, names of columns, + - * / and parentheses, linear in the columns; "
    "a name that Python would not read goes between backticks"
)


@dataclass(frozen=True)
class ColumnExpression:
    """A number plus numbers times columns.

    Attributes
    ----------
    terms : name of a column -> what it is multiplied by.
    offset : what is added, in the unit of the result.
    """

    terms: dict[str, float] = field(default_factory=dict)
    offset: float = 0.0

    def __add__(self, other: ColumnExpression) -> ColumnExpression:
        names = dict.fromkeys((*self.terms, *other.terms))
        terms = {one: self.terms.get(one, 0.0) + other.terms.get(one, 0.0) for one in names}
        return ColumnExpression(terms, self.offset + other.offset)

    def times(self, factor: float) -> ColumnExpression:
        """Return the expression times a number."""
        terms = {name: factor * value for name, value in self.terms.items()}
        return ColumnExpression(terms, factor * self.offset)

    def divided(self, divisor: float) -> ColumnExpression:
        """Return the expression divided by a number, which must not be zero."""
        terms = {name: value / divisor for name, value in self.terms.items()}
        return ColumnExpression(terms, self.offset / divisor)

    @property
    def text(self) -> str:
        """The expression as `parse` reads it, gears and turns written as people write them."""
        parts = [_signed(factor, _term(abs(factor), name)) for name, factor in self.terms.items()]
        if self.offset:
            parts.append(_signed(self.offset, _turn(abs(self.offset))))
        joined = " ".join(parts)
        return joined[2:] if joined[0] == "+" else f"-{joined[2:]}"


def _signed(value: float, text: str) -> str:
    return f"{'-' if value < 0 else '+'} {text}"


def _term(size: float, name: str) -> str:
    """A column times a positive number: of what says the number exactly, the shortest."""
    name, found = quoted(name), []
    for unit, prefix in ((1.0, ""), (math.pi / 180, "pi/180*")):
        for number, before, after in ((size / unit, "*", ""), (unit / size, "", "/")):
            shown = f"{number:.15g}"
            if not math.isclose(float(shown), number, rel_tol=1e-14):
                shown = repr(number)
            text = f"{shown}{before}{name}" if before else f"{name}{after}{shown}"
            found.append(prefix + (name if number == 1.0 else text))
    return min(found, key=len)


def _turn(size: float) -> str:
    """A positive offset, in quarter turns where it is a whole number of them."""
    quarters = size / (math.pi / 2)
    count = round(quarters)
    if not count or not math.isclose(quarters, count, rel_tol=1e-14):
        return repr(size)
    shown = "pi" if count % 2 == 0 else "pi/2"
    times = count // 2 if count % 2 == 0 else count
    return shown if times == 1 else f"{times}*{shown}"


def may_be_expression(text: str) -> bool:
    """Whether a text that names no column could have been meant as an expression."""
    return any(mark in text for mark in "+-*/()`")


def quoted(name: str) -> str:
    """Return a name of a column as an expression holds it: between backticks if it must be."""
    plain = re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*(\[\d+\])?", name, re.ASCII)
    return name if plain and name != "pi" else f"`{name}`"


def parse(text: str) -> ColumnExpression:
    """Read a linear expression of columns.

    Parameters
    ----------
    text : numbers, `pi`, names, `+ - * /`, signs and parentheses. A name is a word, words joined by
        dots, either followed by `[k]`, or anything between backticks.

    Raises
    ------
    RecordingError
        If it is longer than `LONGEST`, is not written as above, is not linear in the columns,
        divides by zero, holds a number that is not finite, or no column remains in it. The message
        says which, in one line.
    """
    if len(text) > LONGEST:
        raise _refused(text, f"is longer than {LONGEST} characters")
    plain, quoted = _unquoted(text)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(plain, mode="eval")
        found = _value(tree.body, text, quoted)
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        reason = getattr(error, "msg", None) or "too deeply nested, or not text"
        raise _refused(text, f"cannot be read ({' '.join(str(reason).split())[:80]})") from None
    except OverflowError:
        raise _refused(text, "holds a number too large") from None
    kept = {name: factor for name, factor in found.terms.items() if factor != 0.0}
    if not all(math.isfinite(value) for value in (*found.terms.values(), found.offset)):
        raise _refused(text, "holds a number that is not finite")
    if not found.terms:
        raise _refused(text, "names no column")
    if not kept:
        raise _refused(text, "has no column left: they cancel, or are multiplied by zero")
    return ColumnExpression(kept, found.offset)


def _unquoted(text: str) -> tuple[str, dict[str, str]]:
    """The text with a word for every name between backticks, and word -> name."""
    quoted: dict[str, str] = {}
    stem = "column"
    while stem in text:
        stem += "_"

    def word(found: re.Match[str]) -> str:
        chosen = f"{stem}{len(quoted)}"
        quoted[chosen] = found[1]
        return f" {chosen} "

    return re.sub(r"`([^`]+)`", word, text).strip(), quoted


def _value(node: ast.expr, text: str, quoted: dict[str, str]) -> ColumnExpression:
    """The expression that a node stands for; refuses every kind of node but those named here."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return ColumnExpression(offset=float(number))
        case ast.Name(id="pi"):
            return ColumnExpression(offset=math.pi)
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return ColumnExpression({_name(node, text, quoted): 1.0})
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return _value(operand, text, quoted).times(-1.0)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, text, quoted)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op):
            a, b = _value(left, text, quoted), _value(node.right, text, quoted)
            return _combined(a, op, b, text)
    raise _refused(text, f"holds {_KINDS.get(type(node), 'what is no number and no column')}")


_KINDS: dict[type[ast.expr], str] = {
    ast.Call: "a call of a function",
    ast.BinOp: "an operator other than + - * /",
    ast.UnaryOp: "an operator other than + - * /",
    ast.Compare: "a comparison",
}


def _combined(
    a: ColumnExpression, op: ast.operator, b: ColumnExpression, text: str
) -> ColumnExpression:
    match op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a + b.times(-1.0)
        case ast.Mult():
            if a.terms and b.terms:
                raise _refused(text, "is not linear: it multiplies columns by each other")
            return a.times(b.offset) if a.terms else b.times(a.offset)
    if b.terms:
        raise _refused(text, "is not linear: it divides by a column")
    if b.offset == 0.0:
        raise _refused(text, "divides by zero")
    return a.divided(b.offset)


def _name(node: ast.expr, text: str, quoted: dict[str, str]) -> str:
    """The name of a column that a node spells: `word`, `word.word`, either with `[k]`."""
    index = ""
    if isinstance(node, ast.Subscript):
        number = node.slice.value if isinstance(node.slice, ast.Constant) else None
        if type(number) is not int:
            raise _refused(text, "has brackets that do not hold a number of a column, from 0")
        node, index = node.value, f"[{number}]"
    words: list[str] = []
    while isinstance(node, ast.Attribute):
        words.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        raise _refused(text, "holds what is no number and no column")
    words.append(quoted.get(node.id, node.id))
    return ".".join(reversed(words)) + index


def _refused(text: str, what: str) -> RecordingError:
    shown = text if len(text) <= 60 else text[:57] + "..."
    return RecordingError(f"the expression {shown!r} {what}", "columns", _REMEDY)
