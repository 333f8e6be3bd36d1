"""Variational EM of joint factor analysis: the golden case, the bound, and its limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy import stats

from dynident.moments import SecondMoments
from dynident.regression.factor_analysis import Gamma, Loadings, Posterior, begun, start_of
from dynident.regression.iterations import Analysis, AnalysisEnding, _leaps, analyse


def standardised(X: np.ndarray, y: np.ndarray) -> SecondMoments:
    found = SecondMoments.of(X, y)
    unit = found.scaled(1.0 / found.scale)
    return SecondMoments(unit.total, unit.count)


def analysed(
    statistics: SecondMoments, prior: Gamma | None, reliability=0.8, known=False, **options
):
    d = statistics.inputs
    options = {"rounds": 20_000, "tolerance": 1e-7, **options}
    start = start_of(statistics, reliability, prior)
    return analyse(statistics, start, prior, np.full(d, known), **options)


def random_problem(seed: int) -> SecondMoments:
    """Any mixture of relevant, redundant and irrelevant noisy inputs, few or many rows."""
    rng = np.random.default_rng([5, seed])
    d, N = int(rng.integers(1, 12)), int(rng.integers(4, 200))
    T = rng.standard_normal((N, d)) @ rng.standard_normal((d, d))
    b = rng.standard_normal(d) * (rng.uniform(size=d) < 0.6)
    X = T + rng.uniform(0, 1) * rng.standard_normal((N, d))
    y = T @ b + 10.0 ** rng.uniform(-3, 0.5) * rng.standard_normal(N)
    if d > 2 and rng.uniform() < 0.3:
        X[:, 1] = X[:, 0] + X[:, 2]
    return standardised(X, y)


def test_golden_case() -> None:
    """Three inputs, a hundred rows, fifty rounds: figures of an independent implementation."""
    G = np.array([[100.0, 20.0, 5.0], [20.0, 100.0, 10.0], [5.0, 10.0, 100.0]])
    c = np.array([60.0, 30.0, 1.0])
    scatter = np.block([[G, c[:, None]], [c[None], np.array([[100.0]])]])
    statistics, prior = SecondMoments(scatter, 100), Gamma(1e-8, 1e-8)
    wz = np.array([0.6241129877, 0.2125492585, -0.0408715201])
    same, none = np.ones(3), np.zeros(3)
    weights = Loadings(
        wz=wz,
        wx=0.894427191 * same,
        wz_var=none,
        wx_var=none,
        relevance=none,
        pz=0.1008179203 * same,
        px=0.2 * same,
        py=0.3024537609,
    )
    start = begun(weights, statistics.count, prior)
    known = np.zeros(3, dtype=bool)
    at, bounds = Posterior(start, statistics), []
    for _ in range(50):
        bounds.append(at.bound(prior))
        at = Posterior(at.updated(prior, known), statistics)
    factors = at.factors
    true = factors.wz / factors.wx
    np.testing.assert_allclose(true, [0.731331938, 0.292150673, -0.056722096], atol=1e-8)
    assert factors.py == pytest.approx(0.154685317, abs=1e-8)
    noisy = [0.548914852, 0.179634291, -0.032347832]
    np.testing.assert_allclose(at.b, noisy, atol=1e-8)
    assert bounds[0] == pytest.approx(-615.512416333, abs=1e-8)
    assert bounds[-1] == pytest.approx(-613.566175782, abs=1e-8)


@pytest.mark.parametrize("prior", [None, Gamma()])
@pytest.mark.slow
def test_the_bound_never_falls(prior: Gamma | None) -> None:
    for seed in range(200):
        problem = random_problem(seed)
        bounds = analysed(problem, prior, rounds=150, tolerance=-np.inf).bounds
        assert len(bounds) > 1 and np.all(np.isfinite(bounds)), seed
        rounding = 1e-11 * np.maximum(np.abs(bounds[:-1]), problem.count)
        assert np.all(np.diff(bounds) >= -rounding), seed


@pytest.mark.parametrize("prior", [None, Gamma()])
@pytest.mark.parametrize("known", [False, True])
def test_data_without_noise_end_in_rounding(prior: Gamma | None, known: bool) -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((100_000, 4))
    statistics = standardised(X, X @ [1.0, -2.0, 0.5, 0.0])
    found = analysed(statistics, prior, 1.0 if known else 0.8, known, rounds=3000, tolerance=1e-3)
    falls = np.diff(found.bounds)
    assert np.all(falls[:-1] >= 0.0) and falls[-1] > -0.1
    assert found.ending is not AnalysisEnding.ROUNDS_EXHAUSTED
    if known:
        least_squares = np.linalg.solve(statistics.gram, statistics.cross)
        np.testing.assert_allclose(found.coefficients, least_squares, atol=1e-5)


def test_badly_conditioned_inputs_are_not_left_half_way() -> None:
    """Input noise next to none: the answer is least squares to a fraction of its sigma."""
    rng = np.random.default_rng(1)
    mixing = np.linalg.qr(rng.standard_normal((10, 10)))[0] * np.logspace(0, -3, 10)
    X = rng.standard_normal((100_000, 10)) @ mixing.T
    statistics = standardised(X, X @ np.arange(10.0) + 0.3 * rng.standard_normal(100_000))
    least_squares = np.linalg.solve(statistics.gram, statistics.cross)
    variance = statistics.residual(least_squares) / statistics.count
    sigma = np.sqrt(variance * np.diag(np.linalg.inv(statistics.gram)))
    found = analysed(statistics, None, 1.0 - 1e-8, known=True, tolerance=1e-3)
    assert found.ending is AnalysisEnding.CONVERGED
    off = np.abs(found.factors.wz / found.factors.wx - least_squares) / sigma
    assert off.max() < 0.1


def test_the_likelihood_is_that_of_a_gaussian() -> None:
    """Plain joint factor analysis: its bound is log p(x, y) itself."""
    rng = np.random.default_rng(3)
    X = rng.standard_normal((60, 3))
    statistics = standardised(X, X @ [1.0, 0.5, 0.0] + rng.standard_normal(60))
    found = analysed(statistics, None, rounds=7, tolerance=-np.inf)
    f = found.factors
    across = f.wx * f.wz
    spread = np.diag(f.wx**2 + f.px)
    own = np.sum(f.wz**2 + f.pz) + f.py
    covariance = np.block([[spread, across[:, None]], [across[None], np.array([[own]])]])
    N, S = statistics.count, statistics.total
    # Sum of log densities over samples with this scatter about zero.
    constant = cast(Any, stats.multivariate_normal).logpdf(np.zeros(4), cov=covariance) * N
    expected = constant - 0.5 * np.trace(np.linalg.solve(covariance, S))
    assert found.bounds[-1] == pytest.approx(expected, rel=1e-12)


def test_maximum_likelihood_predicts_as_least_squares_from_any_start() -> None:
    """And leaves the reliability to the start: the data do not tell it."""
    rng = np.random.default_rng(1)
    T = rng.standard_normal((2000, 4))
    X = T + 0.3 * rng.standard_normal(T.shape)
    y = T @ [1.0, -2.0, 0.5, 0.1] + 2.0 * rng.standard_normal(2000)
    statistics = standardised(X, y)
    least_squares = np.linalg.solve(statistics.gram, statistics.cross)
    each = [analysed(statistics, None, rho) for rho in (0.85, 0.97)]
    for one in each:
        assert one.ending is AnalysisEnding.CONVERGED
        np.testing.assert_allclose(one.coefficients, least_squares, atol=1e-4)
    first, second = (one.factors.wz / one.factors.wx for one in each)
    assert each[0].bound == pytest.approx(each[1].bound, abs=1e-3)
    assert np.linalg.norm(first - second) > 0.05 * np.linalg.norm(first)


@pytest.mark.parametrize("prior", [None, Gamma()])
@pytest.mark.slow
def test_without_input_noise_the_answer_goes_to_least_squares(prior: Gamma | None) -> None:
    rng = np.random.default_rng(4)
    X = rng.standard_normal((5000, 3))
    y = X @ [1.0, -2.0, 0.5] + 3.0 * rng.standard_normal(5000)
    statistics = standardised(X, y)
    least_squares = np.linalg.solve(statistics.gram, statistics.cross)

    def distance(noise: float) -> float:
        found = analysed(statistics, prior, 1.0 - noise, known=True, tolerance=1e-3)
        return float(np.linalg.norm(found.factors.wz / found.factors.wx - least_squares))

    far, near, nearest = (distance(noise) for noise in (0.1, 0.01, 1e-4))
    assert far > 5 * near > 5 * nearest
    assert nearest < 1e-3


def test_noise_that_is_known_stays_and_other_noise_moves() -> None:
    statistics = random_problem(17)
    d = statistics.inputs
    known = np.arange(d) % 2 == 0
    start = start_of(statistics, 0.7, None)
    found = analyse(statistics, start, None, known, rounds=50, tolerance=-np.inf).factors
    np.testing.assert_array_equal(found.px[known], start.px[known])
    assert d > 3 and np.all(found.px[~known] != start.px[~known])


@pytest.mark.parametrize("prior", [None, Gamma()])
@pytest.mark.slow
def test_leaps_end_where_plain_rounds_end(prior: Gamma | None) -> None:
    rng = np.random.default_rng(18)
    T = rng.standard_normal((500, 6)) @ rng.standard_normal((6, 6))
    X = T + rng.standard_normal(T.shape)
    statistics = standardised(X, T @ [1.0, -1.0, 0.5, 2.0, 0.0, 0.0] + rng.standard_normal(500))
    known = np.zeros(6, dtype=bool)
    start = start_of(statistics, 0.8, prior)
    at = Posterior(start, statistics)
    for _ in range(10_000):
        at = Posterior(at.updated(prior, known), statistics)
    found = analyse(statistics, start, prior, known, rounds=1000, tolerance=0.01)
    assert found.ending is AnalysisEnding.CONVERGED
    assert found.bound == pytest.approx(at.bound(prior), abs=0.02)
    np.testing.assert_allclose(found.coefficients, at.b, atol=2e-3)


def test_leaps_out_of_the_numbers_have_no_bound() -> None:
    """Over a variance that underflows, as it may far from the end: such a leap is not taken."""
    statistics = random_problem(17)
    factors = start_of(statistics, 0.8, Gamma())
    known = np.zeros(statistics.inputs, dtype=bool)
    lost = replace(factors, wz_var=np.where(np.arange(len(known)) == 0, 0.0, factors.wz_var))
    with np.errstate(all="ignore"):
        (there,) = _leaps(Posterior(lost, statistics), Gamma(), known, (4,))
        assert np.isnan(there.bound(Gamma()))


def test_rounds_that_do_not_suffice_are_told() -> None:
    found = analysed(random_problem(17), Gamma(), rounds=3, tolerance=1e-12)
    assert found.ending is AnalysisEnding.ROUNDS_EXHAUSTED and found.rounds == 3
    assert isinstance(found, Analysis) and found.bound == found.bounds[-1]
