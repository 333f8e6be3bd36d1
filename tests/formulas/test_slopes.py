"""Derivatives of formulas by their parameters, and what a linear parameter multiplies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from dynident.formulas import (
    Signal,
    evaluate,
    evaluate_slopes,
    linear_parameters,
    multiplied_by,
    parse_formula,
    text_of,
)

RNG = np.random.default_rng(3)
Q, V = RNG.normal(size=(2, 40)) + 0.1
WIDTH = 0.7  # of dry friction, rad/s


@dataclass
class Given:
    """Samples, and parameters."""

    parameters: dict[str, float]

    def signal(self, signal: Signal) -> np.ndarray:
        return {"q": Q, "v": V}[signal.quantity]

    def parameter(self, name: str) -> float:
        return self.parameters[name]

    def sign(self, speed: np.ndarray, joints: tuple[str | None, ...]) -> np.ndarray:
        return np.tanh(speed / WIDTH)

    def sign_slope(self, sign: np.ndarray, joints: tuple[str | None, ...]) -> np.ndarray:
        return (1.0 - sign**2) / WIDTH


@pytest.mark.parametrize(
    "text",
    [
        "v*sin(k*q + p)",
        "cos(k*q) - p*tanh(v/k)",
        "exp(-abs(v)/k)*sign(v - p)",
        "sqrt(k + q^2)/(p + v^2)",
        "(k*q + p)^4 - abs(p*v - k)",
        "-k*k/p + k^3*q",
        "p*(q/k)^2/(1 + k^2*v^2)",
    ],
)
def test_slopes_are_those_of_differences(text: str) -> None:
    formula, at, step = parse_formula(text), {"k": 1.3, "p": 0.4}, 1e-6
    found = evaluate_slopes(formula, Given(at), ["k", "p"])
    for name, slope in zip(at, found, strict=True):
        more, less = (Given({**at, name: at[name] + s}) for s in (step, -step))
        chord = (evaluate(formula, more) - evaluate(formula, less)) / (2 * step)
        np.testing.assert_allclose(np.broadcast_to(slope, 40), chord, rtol=1e-6, atol=1e-8)


def test_by_a_parameter_that_does_not_occur_the_slope_is_zero() -> None:
    assert evaluate_slopes(parse_formula("k*q"), Given({"k": 2.0}), ["p"]) == [0.0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("v*(c*sin(k*q) + e*cos(k*q))", ["v*sin(k*q)", "v*cos(k*q)"]),
        ("c*v - e*q/k", ["v", "-(q/k)"]),
        ("-(c + e*k)*q", ["-1*q", "-k*q"]),
        ("k*c*v + q*e*k + c*q", ["k*v + q", "q*k"]),
        ("0*c*k + e*v", ["0", "v"]),
    ],
)
def test_what_a_linear_parameter_multiplies_is_its_column(text: str, expected: list[str]) -> None:
    formula = parse_formula(text)
    linear = linear_parameters(formula, ["k"])
    columns = [multiplied_by(formula, name, ["k"]) for name in linear]
    assert [text_of(one) for one in columns] == expected
    for name, column in zip(linear, columns, strict=True):
        whole = Given({"k": 1.7, **{one: float(one == name) for one in linear}})
        np.testing.assert_allclose(
            np.broadcast_to(evaluate(column, whole), 40),
            np.broadcast_to(evaluate(formula, whole), 40),
            rtol=1e-14,
        )
