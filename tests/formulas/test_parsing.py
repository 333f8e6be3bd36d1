"""Formulas are read by a whitelist: what is listed is read right, all else is refused in a line."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynident.errors import EffectError
from dynident.formulas import (
    Formula,
    Number,
    Operation,
    Signal,
    Unknown,
    evaluate,
    parse_formula,
    text_of,
)
from dynident.formulas.parsing import LONGEST, MOST_NODES

LEAVES = st.one_of(
    st.sampled_from([Number(2.0), Number(0.25), Number(-3.0), Number(1e-7)]),
    st.sampled_from([Unknown("c"), Unknown("k1")]),
    st.sampled_from([Signal("q"), Signal("v"), Signal("load", "left arm/j-1"), Signal("t")]),
)


def _larger(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
    pairs = st.tuples(inner, inner)
    return st.one_of(
        st.builds(Operation, st.sampled_from("+-*/"), pairs),
        st.builds(lambda one: Operation("^", (one, Number(3.0))), inner),
        st.builds(
            lambda name, one: Operation(name, (one,)),
            st.sampled_from(["sin", "cos", "tanh", "exp", "sqrt", "abs", "sign"]),
            inner,
        ),
        st.builds(
            lambda one: Operation("neg", (one,)),
            inner.filter(lambda one: not isinstance(one, Number)),
        ),
    )


class Samples:
    """Five samples of everything, the same each time."""

    def signal(self, signal: Signal) -> np.ndarray:
        return np.linspace(0.3, 1.7, 5) + len(signal.quantity) + len(signal.joint or "")

    def parameter(self, name: str) -> float:
        return {"c": 0.7, "k1": -1.3}[name]

    def sign(self, speed: np.ndarray, joints: tuple[str | None, ...]) -> np.ndarray:
        return np.tanh(speed / (1 + len(joints)))


@settings(max_examples=300, derandomize=True)
@given(st.recursive(LEAVES, _larger, max_leaves=8))
def test_what_is_written_is_what_is_read(formula: Formula) -> None:
    """Parentheses are left out only where they mean nothing."""
    again = parse_formula(text_of(formula))
    assert text_of(again) == text_of(formula)
    one, other = (np.asarray(evaluate(each, Samples()), float) for each in (formula, again))
    np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("c*v^2", "c*(v^2)"),
        ("c*v**2", "c*v^2"),
        ("-v^2", "-(v^2)"),
        ("a - q - v", "(a - q) - v"),
        ("a/q/v", "(a/q)/v"),
        ('q["elbow"]', "q[elbow]"),
        ("+c*v", "c*v"),
        ("2.0*q", "2*q"),
    ],
)
def test_precedence_is_that_of_mathematics(one: str, other: str) -> None:
    assert parse_formula(one) == parse_formula(other)


HOSTILE = [
    "",
    " ",
    "c*v\n*q",
    "c*v\x00",
    "c*v # comment\t",
    "c*\u202ev",
    "__import__('os').system('true')",
    "c.__class__",
    "().__class__.__bases__[0]",
    "(lambda: 1)()",
    "[v for v in (1, 2)]",
    "{q: v}",
    "{v}",
    "(v, q)",
    "v if q else a",
    "v and q",
    "not v",
    "~v",
    "v < q",
    "v // q",
    "v % 3",
    "v @ q",
    "v | q",
    "v << 2",
    "v := 3",
    "c = v",
    "f'{v}'",
    "'c*v'",
    "b'c'",
    "None",
    "True*v",
    "...",
    "1j*v",
    "1e400*v",
    "-1e999*v",
    "9" * 250,
    "10**400",
    "v**0.5",
    "v**-1",
    "v**q",
    "v**c",
    "v**100000000",
    "2**3**4**4",
    "eval('v')",
    "exec(v)",
    "open(v)",
    "max(v, q)",
    "sin",
    "sin()",
    "sin(v, q)",
    "sin(x=v)",
    "sin(*v)",
    "sin(v)(q)",
    "q[0]",
    "q[1:2]",
    "q[-1]",
    "q['']",
    "q[elbow][wrist]",
    "t[elbow]",
    "c[elbow]*v",
    "await v",
    "yield v",
    "lambda: v",
    "c*v;c",
    "c*v)",
    "((c*v",
    "c v",
    "1__000*v",
    "d\u00e9bit*v",
    "parameter_with_a_name_that_never_ends*v",
    "(" * 200 + "v" + ")" * 200,
    "-" * 250 + "v",
    "sin(" * 60 + "v" + ")" * 60,
    "+".join(["c*v"] * 80),
    "c*v*" * 100 + "v",
    "v" * (LONGEST + 1),
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_formulas_are_refused_in_one_line(text: str) -> None:
    start = time.process_time()
    with pytest.raises(EffectError) as caught:
        parse_formula(text)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 600
    assert caught.value.remedy
    assert time.process_time() - start < 2.0  # nothing grows without bounds


@pytest.mark.parametrize("wrong", [None, 3, b"c*v", ["c*v"]])
def test_only_texts_are_formulas(wrong) -> None:
    with pytest.raises(EffectError, match="text"):
        parse_formula(wrong)


def test_the_limits_leave_room_for_long_laws() -> None:
    text = "c*v*(" + " + ".join(f"sin({k}*q)^2" for k in range(1, 20)) + ")"
    assert 200 < len(text) < LONGEST
    parse_formula(text)
    with pytest.raises(EffectError, match=f"{MOST_NODES}"):
        parse_formula("*".join(["(v+q)"] * 45))
