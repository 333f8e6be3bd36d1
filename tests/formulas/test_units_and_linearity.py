"""Units follow from the motion's, nonsense is refused; what is linear is told from what is not."""

from __future__ import annotations

import pytest

from dynident.errors import EffectError
from dynident.formulas import Signal, Unit, linear_parameters, parse_formula, units_of

UNITS = {
    "q": Unit.of(rad=1),
    "v": Unit.of(rad=1, s=-1),
    "a": Unit.of(rad=1, s=-2),
    "load": Unit.of(N=1, m=1),
    "t": Unit.of(s=1),
    "temperature": Unit.of(degC=1),
}
SLIDER = UNITS | {"q": Unit.of(m=1), "v": Unit.of(m=1, s=-1), "load": Unit.of(N=1)}


def units(text: str, at: dict[str, Unit] = UNITS) -> dict[str, str]:
    def unit(signal: Signal) -> Unit:
        return (SLIDER if signal.joint == "slider" else at)[signal.quantity]

    return {n: str(u) for n, u in units_of(parse_formula(text), unit, at["load"]).items()}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("c*v*cos(q)", {"c": "N m s/rad"}),
        ("c*v*sin(k*q + p)", {"c": "N m s/rad", "k": "1", "p": "rad"}),
        ("c*v*abs(v)", {"c": "N m s^2/rad^2"}),
        ("c*load*v + d*load^2", {"c": "s/rad", "d": "1/(N m)"}),
        ("c*sign(v)*exp(-(v/w)^2)", {"c": "N m", "w": "rad/s"}),
        ("c*exp(-t/T)", {"c": "N m", "T": "s"}),
        ("c*sqrt(v^2 + 0.01)", {"c": "N m s/rad"}),
        ("c*tanh(v/0.05)", {"c": "N m"}),
        ("c*(q - 1)/(1 + (q/w)^2)", {"c": "N m/rad", "w": "rad"}),
        ("c*(temperature - 20)*v", {"c": "N m s/(rad degC)"}),
        ("c*v[slider]", {"c": "N s"}),
        ("c*a + d*sqrt(load)*v", {"c": "N m s^2/rad", "d": "N^0.5 m^0.5 s/rad"}),
    ],
)
def test_units_of_parameters(text: str, expected: dict[str, str]) -> None:
    assert units(text) == expected


def test_units_at_a_prismatic_joint() -> None:
    assert units("c*v", SLIDER) == {"c": "N s/m"}
    assert units("c*sin(k*q)", SLIDER) == {"c": "N", "k": "rad/m"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("c*sin(v)", "rad/s"),
        ("c*(q + v)", "adds rad and rad/s"),
        ("c*v + c*v*q", "adds the unit of c times rad/s and the unit of c times rad.2/s"),
        ("c*exp(q)", "a pure number"),
        ("c*tanh(load)", "N m"),
        ("c*sign(q)", "not of a speed"),
        ("c*sign(v/2*q)", "rad"),
        ("c*sin(3*v)", "rad"),
        ("c*v + c*q", "unit of c"),
        ("c*cos(q[slider])", "m, and rad"),
        ("c*k*v", "c and k"),
    ],
)
def test_nonsense_is_refused_with_its_reason(text: str, says: str) -> None:
    with pytest.raises(EffectError, match=says):
        units(text)


@pytest.mark.parametrize(
    ("text", "shapes", "linear"),
    [
        ("c*v*sin(k*q + p)", ("k", "p"), ("c",)),
        ("a1*v + b1*abs(v)*v", (), ("a1", "b1")),
        ("-(c*v - d*q)/w", ("w",), ("c", "d")),
        ("v*(c + d*q)", (), ("c", "d")),
        ("c*v + 0*q", (), ("c",)),
    ],
)
def test_linear_parameters(text: str, shapes: tuple[str, ...], linear: tuple[str, ...]) -> None:
    assert linear_parameters(parse_formula(text), shapes) == linear


@pytest.mark.parametrize(
    ("text", "shapes", "says"),
    [
        ("v", (), "no factor"),
        ("k*v", ("k",), "no factor"),
        ("c*v + 3", (), "term 3"),
        ("c*v + q", (), "term q"),
        ("c*v + sin(k*q)", ("k",), "term sin"),
        ("c*sin(k*q)", (), "'k' stands inside sin"),
        ("c*d*v", (), "multiplies the parameters c and d"),
        ("v/c", (), "divisor"),
        ("(c*v)^2", (), "power"),
        ("c*v", ("k",), "not in the formula"),
    ],
)
def test_what_is_not_linear_is_refused(text: str, shapes: tuple[str, ...], says: str) -> None:
    with pytest.raises(EffectError, match=says) as caught:
        linear_parameters(parse_formula(text), shapes)
    assert caught.value.remedy
