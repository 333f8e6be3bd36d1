"""Constraint sets: results satisfy them by independent arithmetic, alone and together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from chains import SOLVERS, Case, chain_case, least
from dynident.constraints import (
    Bounds,
    CentreInBox,
    CentreInEllipsoid,
    ConstraintSet,
    Known,
    ParameterSpace,
    Sum,
    Symmetric,
    TotalMass,
    Vanishing,
    Within,
)
from dynident.errors import FitError
from dynident.fitting.consistent.programs import solve
from dynident.nlp.certificate import OPTIMAL

CENTRE, SEMI = np.array([0.05, 0.02, 0.1]), np.array([0.03, 0.02, 0.04])
AXES = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
TOLERANCE = 1e-7


def value(space: ParameterSpace, x: np.ndarray, name: str) -> float:
    return float(x[space.names.index(name)])


def body(space: ParameterSpace, x: np.ndarray, name: str) -> np.ndarray:
    return np.array([value(space, x, f"{p}.{name}") for p in ("m", "mx", "my", "mz")])


def total_mass(space: ParameterSpace, x: np.ndarray) -> None:
    assert sum(x[space.names.index(f"m.l{k}")] for k in range(3)) == pytest.approx(12.0)


def known(space: ParameterSpace, x: np.ndarray) -> None:
    assert value(space, x, "m.l1") == pytest.approx(3.0, abs=TOLERANCE)
    assert value(space, x, "Fv@j2") == pytest.approx(0.7, abs=TOLERANCE)


def bounds(space: ParameterSpace, x: np.ndarray) -> None:
    assert value(space, x, "mx.l0") >= 1.0 - TOLERANCE
    assert value(space, x, "Izz.l2") <= 0.01 + TOLERANCE


def weighted(space: ParameterSpace, x: np.ndarray) -> None:
    got = 2 * value(space, x, "m.l0") - value(space, x, "m.l2") + value(space, x, "Fv@j0")
    assert 8.0 - TOLERANCE <= got <= 9.0 + TOLERANCE


def in_box(space: ParameterSpace, x: np.ndarray) -> None:
    m, *h = body(space, x, "l1")
    com = np.array(h) / m
    assert np.all(com >= np.array([0.0, -0.02, 0.0]) - 1e-6)
    assert np.all(com <= np.array([0.06, 0.02, 0.1]) + 1e-6)


def in_ellipsoid(space: ParameterSpace, x: np.ndarray) -> None:
    m, *h = body(space, x, "l2")
    local = AXES.T @ (np.array(h) / m - CENTRE)
    assert np.sum((local / SEMI) ** 2) <= 1 + 1e-5


def symmetric(space: ParameterSpace, x: np.ndarray) -> None:
    """Points of one mirrored in y are those of the other: moments that are odd in y flip."""
    even = ("m", "mx", "mz", "Ixx", "Iyy", "Izz", "Ixz")
    odd = ("my", "Ixy", "Iyz")
    for names, sign in ((even, 1.0), (odd, -1.0)):
        for p in names:
            left, right = value(space, x, f"{p}.l0"), value(space, x, f"{p}.l1")
            assert left == pytest.approx(sign * right, abs=1e-7)


def mirror_of_itself(space: ParameterSpace, x: np.ndarray) -> None:
    for p in ("mz", "Ixz", "Iyz"):
        assert value(space, x, f"{p}.l0") == pytest.approx(0.0, abs=1e-8)


Check = Callable[[ParameterSpace, np.ndarray], None]
SETS: dict[str, tuple[tuple[ConstraintSet, ...], Check]] = {
    "total mass": ((TotalMass(12.0, 12.0),), total_mass),
    "known": ((Known("m.l1", 3.0), Known("Fv@j2", 0.7)), known),
    "bounds": ((Bounds("mx.l0", 1.0), Bounds("Izz.l2", upper=0.01)), bounds),
    "sum": ((Sum({"m.l0": 2.0, "m.l2": -1.0, "Fv@j0": 1.0}, 8.0, 9.0),), weighted),
    "box": ((CentreInBox("l1", [0.0, -0.02, 0.0], [0.06, 0.02, 0.1]),), in_box),
    "ellipsoid": ((CentreInEllipsoid("l2", CENTRE, SEMI, AXES),), in_ellipsoid),
    "symmetric": ((Symmetric("l0", "l1", "y"),), symmetric),
    "mirror of itself": ((Symmetric("l0", "l0", "z"),), mirror_of_itself),
}
COMBINATIONS = [
    *((name,) for name in SETS),
    ("total mass", "known", "box"),
    ("ellipsoid", "sum", "mirror of itself"),
    ("total mass", "box", "ellipsoid", "symmetric"),
]


def chain_of_three(within: Within) -> Case:
    return chain_case(3, 1, within, spread=1.0)


# Several sets at once are tried on the quicker solver; without consistency there is but one.
CASES = [
    pytest.param(names, consistency, solver, id=f"{'+'.join(names)}-{consistency}-{solver}")
    for names in COMBINATIONS
    for consistency in ("full", "semi", "none")
    for solver in SOLVERS
    if solver == "conic" or (consistency != "none" and len(names) == 1)
]


@pytest.mark.parametrize(("names", "consistency", "solver"), CASES)
def test_results_satisfy_their_sets(names, consistency, solver) -> None:
    sets = tuple(one for name in names for one in SETS[name][0])
    case = chain_of_three(Within(consistency, sets))
    space = case.problem.space
    answer = solve(case.problem, solver)
    for name in names:
        with pytest.raises(AssertionError):
            SETS[name][1](space, case.x_hat)  # else the set was no constraint
        SETS[name][1](space, answer.x)
    proof = answer.certificate
    assert abs(proof.gap) <= (1e-6 if solver == "conic" else OPTIMAL) and proof.optimal
    if consistency != "none":
        assert np.all(answer.x[:30:10] > 0.1), "no link loses its mass"
        assert min(least(phi, consistency) for phi in answer.x[:30].reshape(3, 10)) >= -1e-9
    assert np.all(answer.x[30:] >= -1e-9), "friction opposes motion"
    free = solve(chain_of_three(Within(consistency)).problem, "conic")
    assert proof.bound >= free.certificate.objective * (1 - 1e-6), "a smaller set is no better"


def test_a_set_that_holds_already_changes_nothing() -> None:
    free = solve(chain_of_three(Within("full")).problem, "conic")
    mass = float(free.x[[0, 10, 20]].sum())
    loose = (TotalMass(mass - 1, mass + 1), Bounds("Fv@j0", -5.0, 5.0))
    held = solve(chain_of_three(Within("full", loose)).problem, "conic")
    np.testing.assert_allclose(held.x, free.x, rtol=1e-7, atol=1e-9)


def test_combinations_that_vanish() -> None:
    case = chain_of_three(Within("full"))
    rows = np.zeros((2, case.problem.space.size))
    rows[0, case.problem.space.names.index("mx.l0")] = 1.0
    rows[1, [1, 11]] = [1.0, -2.0]
    found = solve(chain_of_three(Within("full", (Vanishing(rows),))).problem, "conic")
    np.testing.assert_allclose(rows @ found.x, 0.0, atol=1e-9)
    assert np.max(np.abs(rows @ case.x_hat)) > 0.01


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("sets", "named"),
    [
        ((TotalMass(1.0, 2.0), Known("m.l1", 5.0)), ["total mass", "m.l1"]),
        ((Known("m.l1", -1.0),), ["m.l1"]),
        ((Bounds("Fv@j0", upper=-1.0),), ["Fv@j0"]),
        (
            (
                CentreInBox("l1", [0.0] * 3, [0.1] * 3),
                CentreInEllipsoid("l1", [9.0] * 3, [0.1] * 3),
                Bounds("m.l1", 1.0),
            ),
            ["box", "ellipsoid", "l1"],
        ),
    ],
)
def test_sets_that_exclude_each_other_are_named(sets, named, solver) -> None:
    with pytest.raises(FitError, match="no robot satisfies all") as raised:
        solve(chain_of_three(Within("full", sets)).problem, solver)
    for word in named:
        assert word in str(raised.value)


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (Known("m.l9", 1.0), r"no standard parameter 'm.l9'.*did you mean 'm.l\d'"),
        (Sum({"Fv@elbow": 1.0}, 0.0, 1.0), r"'Fv@elbow'.*Fv@j2"),
        (CentreInBox("hand", [0, 0, 0], [1, 1, 1]), r"no link 'hand'.*l0, l1, l2"),
        (CentreInEllipsoid("hand", [0, 0, 0], [1, 1, 1]), r"no link 'hand'.*l0, l1, l2"),
        (Symmetric("l0", "hand"), r"no link 'hand'.*l0, l1, l2"),
        (Bounds("m.l0", 2.0, 1.0), "lower must not exceed upper"),
        (Known("m.lo", 1.0), r"did you mean 'm.l\d'"),
        (TotalMass(float("nan"), 1.0), r"total mass: a bound is not a number \(NaN\)"),
        (Bounds("m.l0", "1", 2.0), "m.l0: a bound is a str. give a number"),  # type: ignore[arg-type]
        (TotalMass(1.0, None), "total mass: a bound is None"),  # type: ignore[arg-type]
        (Sum({"m.l0": float("inf")}, 0.0, 1.0), "a weight is not finite"),
        (Sum({"m.l0": float("nan")}, 0.0, 1.0), "the weight of m.l0 is not a number"),
        (Vanishing(np.ones((2, 3))), r"irrelevant: rows of 3\d finite numbers"),
        (Known("m.l0", float("inf")), "hold nothing"),
        (Bounds("m.l0", upper=-float("inf")), "hold nothing"),
        (CentreInBox("l0", [1, 0, 0], [0, 1, 1]), "box is empty"),
        (CentreInBox("l0", [0, 0], [1, 1]), "three finite numbers"),
        (CentreInEllipsoid("l0", [0, 0, 0], [1, 0, 1]), "semi-axis is not positive"),
        (CentreInEllipsoid("l0", [0, 0, np.nan], [1, 1, 1]), "three finite numbers"),
        (CentreInEllipsoid("l0", [0, 0, 0], [1, 1, 1], np.ones((3, 3))), "not orthonormal"),
    ],
)
def test_sets_that_make_no_sense_are_refused(one, words) -> None:
    with pytest.raises(FitError, match=words):
        solve(chain_of_three(Within("full", (one,))).problem, "conic")


def test_what_to_lie_within() -> None:
    assert Within("semi", TotalMass(1.0, 2.0)).sets == (TotalMass(1.0, 2.0),)  # type: ignore[arg-type]
    with pytest.raises(FitError, match="full, semi, none"):
        Within("strict")  # type: ignore[arg-type]
    for inset in (-1.0, 0.5, np.nan):
        with pytest.raises(FitError, match="inset"):
            Within(inset=inset)


def test_the_inset_keeps_off_the_boundary() -> None:
    for inset in (0.0, 1e-6, 1e-2):
        case = chain_case(7, 0, Within("full", inset=inset), spread=3.0)
        x, space = solve(case.problem, "conic").x, case.problem.space
        margin = []
        for k in range(7):
            part = slice(10 * k, 10 * k + 10)
            margin.append(least(x[part] - inset * space.references[k], "full"))
        assert -1e-9 <= min(margin) < 1e-5
