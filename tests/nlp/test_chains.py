"""Chains of seven and more links: the gap, and the nonlinear program beside it."""

from __future__ import annotations

import numpy as np
import pytest

from chains import chain_case, least
from dynident.constraints import Consistency, Within
from dynident.fitting.consistent.programs import solve
from dynident.nlp.certificate import OPTIMAL
from dynident.nlp.parametrised import solve_nonlinear

# --- chains --------------------------------------------------------------------------------------

NOTIONS = [("full", 0.3, 1e-5), ("semi", 3.0, 1e-5)]


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize(("consistency", "spread", "flat"), NOTIONS)
@pytest.mark.slow
def test_twenty_impossible_estimates_of_seven_links(consistency, spread, flat, distance) -> None:
    active = 0
    for seed in range(20):
        case = chain_case(7, seed, Within(consistency), distance, spread=spread)
        space = case.problem.space
        assert space.size == 77 and np.linalg.matrix_rank(space.combination) == 52
        bodies = case.x_hat[:70].reshape(7, 10)
        assert min(least(phi, consistency) for phi in bodies) < -0.01
        answer = solve(case.problem, "conic")
        assert answer.certificate.gap <= 1e-6, seed
        margin = [least(phi, consistency) for phi in answer.x[:70].reshape(7, 10)]
        assert min(margin) >= 0
        active += min(margin) < flat
        if distance == "entropic":
            assert min(margin) > flat, "the divergence keeps off the boundary"
    if distance == "quadratic":
        assert active >= 17, "constraints are active, else nothing was tested"


@pytest.mark.slow
@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize(("consistency", "spread", "flat"), NOTIONS)
def test_the_nonlinear_program_reaches_the_bound(consistency, spread, flat, distance) -> None:
    for seed in range(20):
        case = chain_case(7, seed, Within(consistency), distance, spread=spread)
        answer = solve(case.problem, "nlp")
        assert answer.certificate.gap <= OPTIMAL, seed
        assert answer.certificate.starts, "the starts tried are told"


@pytest.mark.parametrize(("consistency", "spread", "flat"), NOTIONS)
def test_a_start_that_ends_at_the_bound_is_followed_by_none(consistency, spread, flat) -> None:
    """Without a bound, or with one below the optimum, a second start has to agree."""
    case = chain_case(7, 0, Within(consistency), "quadratic", spread=spread)
    problem = case.problem.reduced()
    proved = solve(problem, "nlp").certificate
    assert proved.gap <= 1e-6 and len(proved.starts) == 1
    for bound in (-np.inf, 0.9 * proved.bound):
        assert len(solve_nonlinear(problem, bound).objectives) > 1


@pytest.mark.parametrize("links", [10, pytest.param(30, marks=pytest.mark.slow)])
def test_long_chains(links) -> None:
    notions: tuple[Consistency, ...] = ("full", "semi")
    for consistency in notions:
        case = chain_case(links, 0, Within(consistency), samples=150, spread=1.0)
        answer = solve(case.problem, "conic")
        assert answer.certificate.gap <= OPTIMAL
        bodies = answer.x[: 10 * links].reshape(links, 10)
        assert min(least(phi, consistency) for phi in bodies) >= 0
