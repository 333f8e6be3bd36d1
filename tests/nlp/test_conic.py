"""The conic optimum beside closed forms and other programs, and the two notions of consistency."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from chains import COUNTEREXAMPLE, SOLVERS, chain_case, clipped, least, one_body, pseudo, spatial
from dynident.constraints import CentreInEllipsoid, TotalMass, Within
from dynident.errors import FitError
from dynident.fitting.consistent.programs import solve
from dynident.inertia import (
    distance_rows,
    from_com,
    from_log_cholesky,
    from_pseudo_inertia,
    log_cholesky,
    margins,
    to_com,
)
from dynident.nlp import Entropy, Problem, lower_bound, pose_conic, solve_conic

ROUND = from_pseudo_inertia(np.eye(4))  # a body whose metric is the Frobenius norm


def impossible(seed: int) -> np.ndarray:
    B = np.random.default_rng(seed).normal(size=(4, 4))
    return from_pseudo_inertia(B + B.T + 0.5 * np.eye(4))


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("seed", range(8))
def test_one_body_is_its_pseudo_inertia_with_negative_eigenvalues_clipped(seed, solver) -> None:
    rng = np.random.default_rng([seed, 1])
    B = rng.normal(size=(4, 4))
    for reference in (ROUND, from_pseudo_inertia(B @ B.T + 0.3 * np.eye(4))):
        phi = impossible(seed)
        problem = one_body(phi, Within("full", inset=1e-9), distance_rows(reference))
        best = clipped(phi, reference)
        assert least(best, "full") > -1e-12 and least(phi, "full") < -1e-3
        answer = solve(problem, solver)
        true_gap = answer.certificate.objective / problem.objective(best) - 1
        off = np.linalg.norm(distance_rows(reference) @ (answer.x - best))
        if solver == "conic":
            assert abs(true_gap) < 1e-8 and abs(answer.certificate.gap) < 1e-8
            assert off < 1e-7 * np.linalg.norm(distance_rows(reference) @ best)
        else:  # flat in several directions, which its parameters reach at infinity only
            assert true_gap < 1e-2
            assert answer.certificate.gap == pytest.approx(true_gap, abs=1e-6), "and says so"


def semi_body(eta: np.ndarray) -> np.ndarray:
    """A semi-consistent body: log of the mass, centre of mass, a factor of its inertia."""
    factor = np.zeros((3, 3))
    factor[np.tril_indices(3)] = eta[4:]
    return from_com(np.exp(eta[0]), eta[1:4], factor @ factor.T)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_no_other_program_finds_a_better_semi_consistent_body(seed) -> None:
    phi = impossible(seed)
    assert least(phi, "semi") < -1e-3
    problem = one_body(phi, Within("semi", inset=0.0), distance_rows(ROUND))
    answer = solve(problem, "conic")
    assert least(answer.x, "semi") > -1e-9
    rng = np.random.default_rng(seed)
    found = [
        minimize(lambda eta: problem.objective(semi_body(eta)), 0.7 * rng.normal(size=10)).fun
        for _ in range(8)
    ]
    assert min(found) >= answer.certificate.bound * (1 - 1e-9)
    assert min(found) == pytest.approx(answer.certificate.objective, rel=1e-3)
    full = solve(one_body(phi, Within("full", inset=0.0), distance_rows(ROUND)), "conic")
    assert full.certificate.bound >= answer.certificate.objective * (1 - 1e-6), "a smaller set"


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_no_other_program_finds_a_better_entropic_body(seed) -> None:
    """Over log-Cholesky parameters, from several starts."""
    rng = np.random.default_rng(seed)
    phi = impossible(seed)
    near = one_body(phi, Within("full"), rng.normal(size=(6, 10)))
    problem = Problem(near.space, near.A, near.b, near.within, entropy=Entropy(0.3, ROUND[None]))
    answer = solve(problem, "conic")
    assert answer.certificate.gap <= 1e-6 and least(answer.x, "full") > 0
    starts = [log_cholesky(ROUND) + 0.3 * rng.normal(size=10) for _ in range(5)]
    ends = [minimize(lambda eta: problem.objective(from_log_cholesky(eta)), s).fun for s in starts]
    assert min(ends) == pytest.approx(answer.certificate.objective, rel=1e-6)
    assert min(ends) >= answer.certificate.bound * (1 - 1e-9)


def test_the_entropic_objective_is_the_log_det_divergence() -> None:
    B = np.random.default_rng(3).normal(size=(4, 4))
    P, Q = B @ B.T + np.eye(4), np.diag([1.0, 2.0, 3.0, 4.0])
    near = one_body(from_pseudo_inertia(P), Within(), np.zeros((0, 10)))
    entropy = Entropy(2.0, from_pseudo_inertia(Q)[None])
    problem = Problem(near.space, near.A, near.b, near.within, entropy=entropy)
    ratio = np.linalg.inv(Q) @ P
    want = 2 * (np.trace(ratio) - np.log(np.linalg.det(ratio)) - 4)
    x = from_pseudo_inertia(P)
    assert problem.objective(x) == pytest.approx(want)
    step = 1e-6 * np.eye(10)
    slope = [(problem.objective(x + d) - problem.objective(x - d)) / 2e-6 for d in step]
    np.testing.assert_allclose(problem.gradient(x), slope, rtol=1e-6, atol=1e-7)
    # Without any row of data the centre itself is the answer.
    np.testing.assert_allclose(solve_conic(problem).x, entropy.centres[0], atol=1e-4)


# --- the two notions -----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_counterexample_is_semi_consistent_only(solver) -> None:
    phi = COUNTEREXAMPLE
    assert np.linalg.eigvalsh(pseudo(phi))[0] == pytest.approx(-0.5)
    assert np.all(np.linalg.eigvalsh(spatial(phi)) > 0)
    assert margins(phi).semi_consistent and not margins(phi).consistent
    weak = solve(one_body(phi, Within("semi")), solver)
    np.testing.assert_allclose(weak.x, phi, atol=1e-9)
    assert "equation 5" in weak.certificate.notion and "triangle" in weak.certificate.notion
    strong = solve(one_body(phi, Within("full")), solver)
    assert np.linalg.norm(strong.x - phi) > 0.1 and margins(strong.x).consistent
    assert np.linalg.eigvalsh(pseudo(strong.x))[0] >= 0
    assert "fully consistent" in strong.certificate.notion and strong.certificate.optimal


@pytest.mark.parametrize("consistency", ["full", "semi"])
@pytest.mark.parametrize("seed", range(4))
def test_what_lies_within_or_on_the_boundary_stays(consistency, seed) -> None:
    """By the solver itself, not by an early return; on the boundary as far as the inset."""
    B = np.random.default_rng(seed).normal(size=(4, 4))
    inside = from_pseudo_inertia(B @ B.T + 0.1 * np.eye(4))
    flat = from_pseudo_inertia(B[:, :3] @ B[:, :3].T)
    if consistency == "semi":  # a rod: one moment about the centre of mass is zero
        body = to_com(inside)
        axis = np.linalg.qr(B[:3, :3])[0]
        flat = from_com(body.mass, body.com, axis @ np.diag([0.0, 0.2, 0.2]) @ axis.T)
    rows = np.random.default_rng(9).normal(size=(30, 10))  # a metric of full rank
    for phi, tolerance in ((inside, 1e-9), (flat, 1e-6)):
        problem = one_body(phi, Within(consistency), rows)
        solution = solve_conic(problem)
        assert np.linalg.norm(solution.x - phi) < tolerance * np.linalg.norm(phi)
        answer = solve(problem, "conic")
        assert np.linalg.norm(answer.x - phi) < 1e-9 * np.linalg.norm(phi)
        assert answer.certificate.optimal


@pytest.mark.parametrize("seed", range(4))
def test_projecting_twice_is_projecting_once(seed) -> None:
    for consistency in ("full", "semi"):
        rows = np.random.default_rng(seed).normal(size=(30, 10))
        once = solve(one_body(impossible(seed), Within(consistency), rows), "conic").x
        again = solve_conic(one_body(once, Within(consistency), rows)).x
        assert np.linalg.norm(again - once) < 1e-8 * np.linalg.norm(once)


# --- statements of the problem -------------------------------------------------------------------


def test_a_metric_that_leaves_directions_free_is_refused() -> None:
    case = chain_case(7, 0, Within("full"))
    problem = case.problem
    data = Problem(problem.space, problem.A[:-1] * 0, problem.b[:-1], problem.within)
    with pytest.raises(FitError, match="77 of 77 directions free"):
        pose_conic(data)
    A = np.linalg.qr(np.random.default_rng(0).normal(size=(77, 77)))[0][:52] / problem.space.scale
    for solver in SOLVERS:
        with pytest.raises(FitError, match=r"25 of 77 directions free.*prior"):
            solve(Problem(problem.space, A, A @ case.x_hat, problem.within), solver)


def test_reducing_the_rows_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    rows, b = rng.normal(size=(50, 10)), rng.normal(size=50)
    near = one_body(ROUND, Within(), rows)
    problem = Problem(near.space, rows, b, near.within)
    small = problem.reduced()
    assert len(small.b) == 11
    for x in rng.normal(size=(5, 10)):
        assert small.objective(x) == pytest.approx(problem.objective(x))
        np.testing.assert_allclose(small.gradient(x), problem.gradient(x), atol=1e-9)
    np.testing.assert_allclose(solve(small, "conic").x, solve(problem, "conic").x, atol=1e-7)


def test_newtons_steps_add_the_digits_that_the_solver_leaves() -> None:
    """From half of the digits to nearly all, on matrices, bounds, equalities and cones."""
    sets = (TotalMass(9.0, 9.5), CentreInEllipsoid("l1", [0.05] * 3, [0.04, 0.05, 0.06]))
    for within in (Within("full"), Within("semi"), Within("full", sets), Within("semi", sets)):
        case = chain_case(3, 1, within, spread=10.0)
        raw, found = pose_conic(case.problem).solve(), solve_conic(case.problem)
        assert raw.multipliers is not None and found.multipliers is not None
        before = lower_bound(case.problem, raw.x, raw.multipliers)
        after = lower_bound(case.problem, found.x, found.multipliers)
        assert after.stationarity < 1e-9 < before.stationarity
        assert after.dual_feasibility >= -1e-9
        assert case.problem.objective(found.x) == pytest.approx(after.value, rel=1e-12)
        assert after.value == pytest.approx(before.value, rel=1e-6)
        assert case.problem.violation(found.x) < 1e-12


def test_the_program_is_drakes_and_can_be_added_to() -> None:
    problem = one_body(COUNTEREXAMPLE, Within("full"))
    posed = pose_conic(problem)
    free = posed.solve()
    assert free.status.ok and free.status.solver == "Clarabel"
    # Hold the mass at 2 kg: z is the mass from the origin, in units of its size.
    at = (2.0 - posed.origin[0]) / problem.space.scale[0]
    posed.program.AddLinearEqualityConstraint(posed.z[0] == at)
    held = posed.solve()
    assert held.x[0] == pytest.approx(2.0, abs=1e-7) and abs(free.x[0] - 2.0) > 1e-3
    assert problem.objective(held.x) > problem.objective(free.x)


def test_an_unknown_solver_is_refused() -> None:
    with pytest.raises(FitError, match="conic or nlp"):
        solve(one_body(COUNTEREXAMPLE, Within()), "simplex")  # type: ignore[arg-type]
