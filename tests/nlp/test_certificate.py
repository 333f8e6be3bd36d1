"""The certificate: a bound that is one, whoever found the multipliers, and words that fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chains import Case, chain_case, one_body
from dynident.constraints import CentreInBox, CentreInEllipsoid, Symmetric, TotalMass, Within
from dynident.fitting.consistent.programs import solve
from dynident.inertia import distance_rows, from_com
from dynident.nlp import Bound, Multipliers, Problem, Status, certify, lower_bound, solve_conic
from dynident.nlp.certificate import OPTIMAL
from dynident.nlp.problem import TOLERANCE

SOLVED = Status("test", "solved", "by hand")
SETS = (
    TotalMass(9.0, 9.5),
    CentreInBox("l0", [-0.1] * 3, [0.06] * 3),
    CentreInEllipsoid("l1", [0.05] * 3, [0.04, 0.05, 0.06]),
    Symmetric("l0", "l2", "z"),
)


@pytest.fixture(
    scope="module",
    params=[
        ("full", (), "quadratic"),
        ("semi", (), "quadratic"),
        ("full", SETS, "quadratic"),
        ("semi", SETS, "quadratic"),
        ("none", SETS, "quadratic"),
        ("full", (), "entropic"),
        ("full", SETS, "entropic"),
    ],
    ids=lambda p: f"{p[0]}-{len(p[1])}-{p[2]}",
)
def case(request) -> Case:
    consistency, sets, distance = request.param
    return chain_case(3, 1, Within(consistency, sets), distance, spread=10.0)


def feasible_points(problem: Problem, optimum: np.ndarray, count: int) -> list[np.ndarray]:
    """Random points of the set, from far away to next to the optimum."""
    rng = np.random.default_rng(4)
    corners: list[np.ndarray] = []
    for _ in range(20):
        # The nearest to anything is a point of the set, and so are those in between.
        rows = np.diag(1 / problem.space.scale)
        target = problem.space.reference + 3 * problem.space.scale * rng.normal(
            size=problem.space.size
        )
        other = replace(problem, A=rows, b=rows @ target, entropy=None)
        corner = other.retracted(solve_conic(other).x)
        # Some are as far outside as the solver errs, which depends on the processor.
        corners += [corner] * (problem.violation(corner) < TOLERANCE / 10)
        if len(corners) == 6:
            break
    assert len(corners) == 6
    shares = 10.0 ** rng.uniform(-7, 0, (6, count // 6))
    return [
        optimum + t * (c - optimum) for c, row in zip(corners, shares, strict=True) for t in row
    ]


def test_no_point_of_the_set_is_below_the_bound(case: Case) -> None:
    problem = case.problem
    solution = solve_conic(problem)
    assert solution.multipliers is not None
    assert not problem.feasible(case.x_hat), "else nothing is tested"
    bound = lower_bound(problem, solution.x, solution.multipliers)
    answer = problem.retracted(solution.x)
    tight = problem.objective(answer) / bound.value - 1
    assert -1e-8 < tight < 1e-6, "constraints broken by a solver's error can gain that much"
    points = feasible_points(problem, answer, 300)
    objectives = np.array([problem.objective(x) for x in points])
    broken = [max(problem.violation(x), problem.body_violation(x)) for x in points]
    assert max(broken) < 1e-7
    assert np.all(objectives >= bound.value * (1 - 1e-12))
    finite = objectives[np.isfinite(objectives)]
    assert finite.min() < bound.value * (1 + 1e-5) and finite.max() > 2 * bound.value


def test_wrong_multipliers_give_a_weaker_bound_that_still_holds(case: Case) -> None:
    problem = case.problem
    solution = solve_conic(problem)
    right = solution.multipliers
    assert right is not None
    best = lower_bound(problem, solution.x, right).value
    rng = np.random.default_rng(5)
    size = max(np.abs(right.bodies).max(initial=0.0), 1.0)
    wrong = [
        Multipliers(0.5 * right.bodies, 0.5 * right.linear, tuple(0.5 * c for c in right.cones)),
        Multipliers(-right.bodies, -right.linear, tuple(-c for c in right.cones)),
        Multipliers(
            right.bodies + 0.1 * size * rng.normal(size=right.bodies.shape),
            right.linear * rng.normal(size=right.linear.shape),
            tuple(c + rng.normal(size=c.shape) for c in right.cones),
        ),
    ]
    for multipliers in wrong:
        assert lower_bound(problem, solution.x, multipliers).value <= best * (1 + 1e-7)
    random = lower_bound(problem, solution.x, wrong[-1]).value
    assert random < 0.9 * best, "what is wrong proves less"
    objective = problem.objective(problem.retracted(solution.x))
    assert best <= objective * (1 + 1e-8)
    # Developed somewhere else, the right ones prove the same of a quadratic.
    if problem.entropy is None:
        elsewhere = solution.x + problem.space.scale * rng.normal(size=problem.space.size)
        assert lower_bound(problem, elsewhere, right).value == pytest.approx(best, rel=1e-6)


def test_without_multipliers_the_bound_is_the_unconstrained_minimum() -> None:
    problem = chain_case(3, 2, Within("full"), spread=1.0).problem
    d = problem.matrices.shape[1]
    none = Multipliers(np.zeros((3, d, d)), np.zeros(len(problem.linear.A)), ())
    scaled = problem.A * problem.space.scale
    free = np.linalg.lstsq(scaled, problem.b, rcond=None)[0]
    minimum = 0.5 * np.sum((scaled @ free - problem.b) ** 2)
    x = problem.space.reference
    assert lower_bound(problem, x, none).value == pytest.approx(minimum, rel=1e-7)


def test_directions_that_nothing_holds_have_no_bound() -> None:
    problem = one_body(np.ones(10), Within("full"), rows=np.eye(10)[:9])
    multipliers = Multipliers(np.eye(4)[None], np.zeros(0), ())
    assert lower_bound(problem, problem.space.reference, multipliers).value == -np.inf


def test_an_entropic_bound_from_far_away_is_none_rather_than_wrong() -> None:
    problem = chain_case(3, 1, Within("full"), "entropic").problem
    solution = solve_conic(problem)
    assert solution.multipliers is not None
    objective = problem.objective(solution.x)
    some = 0
    for t in (1e-4, 1e-3, 1e-2, 0.1, 1.0):
        at = solution.x + t * (problem.space.reference - solution.x)
        value = lower_bound(problem, at, solution.multipliers).value
        assert value <= objective
        some += np.isfinite(value)
    assert 1 <= some < 5


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
def test_a_poor_answer_is_told_from_the_optimum(distance) -> None:
    problem = chain_case(3, 1, Within("full"), distance).problem
    answer = solve(problem, "conic")
    proof = answer.certificate
    assert proof.optimal and proof.gap <= 1e-6 and "This is the optimum" in proof.sentence
    below = replace(proof, objective=proof.bound * (1 - 1e-12), gap=0.0)
    assert below.sentence.endswith("no point of the set is better, but for rounding.")
    assert "fully consistent" in proof.notion
    bound = Bound(proof.bound, proof.stationarity, proof.dual_feasibility)
    poor = answer.x + 0.2 * (problem.space.reference - answer.x)
    told = certify(problem, poor, SOLVED, "a guess", bound, (problem.objective(poor),))
    assert told.gap > 10 * OPTIMAL and not told.optimal
    assert told.gap == pytest.approx(problem.objective(poor) / proof.bound - 1)
    assert "NOT proved to be the optimum" in told.sentence
    written = told.to_dict()
    assert written["optimal"] is False and "NOT" in written["sentence"]
    assert written["starts"] == [problem.objective(poor)]
    assert "NOT proved" in str(told.table()) and "a guess" in str(told.table())
    nothing = certify(problem, poor, SOLVED, "a guess", None)
    assert not nothing.optimal and "Nothing is proved" in nothing.sentence


def test_what_breaks_a_constraint_is_no_solution() -> None:
    case = chain_case(3, 1, Within("full"))
    bound = Bound(0.0, 0.0, 0.0)
    told = certify(case.problem, case.x_hat, SOLVED, "no constraints", bound)
    assert not told.optimal and "not a solution" in told.sentence
    assert told.worst_margin[0] in case.problem.space.bodies and told.worst_margin[2] < 0


def test_stationarity_and_dual_feasibility_are_reported_and_small() -> None:
    for consistency in ("full", "semi"):
        proof = solve(
            chain_case(7, 3, Within(consistency), spread=3.0).problem, "conic"
        ).certificate
        assert 0 < proof.stationarity < 1e-9
        assert -1e-9 < proof.dual_feasibility <= 0


@pytest.mark.parametrize("excess", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize("consistency", ["full", "semi"])
def test_points_barely_outside_are_solved_to_the_optimum(excess, consistency) -> None:
    """However small the objective: a gap over next to nothing is not called open."""
    flat = [0.02, 0.03, 0.05] if consistency == "full" else [0.0, 0.03, 0.03]
    phi = from_com(2.0, [0.1, 0.0, 0.2], np.diag(flat))
    phi[9 if consistency == "full" else 4] += excess * (1 if consistency == "full" else -1)
    reference = one_body(phi, Within()).space.references[0]
    problem = one_body(phi, Within(consistency), 30 * distance_rows(reference))
    answer = solve(problem, "conic")
    assert answer.certificate.optimal
    assert np.linalg.norm(answer.x - phi) < 10 * excess + 1e-6
