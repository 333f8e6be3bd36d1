"""What every estimator of this room does: scikit-learn's interface, equivariance, hard input."""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from sklearn.exceptions import NotFittedError
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from dynident.errors import DynidentWarning, FitError
from dynident.moments import SecondMoments
from dynident.regression.bayesian_factors import BayesianFactorRegression
from dynident.regression.corrected import CorrectedLeastSquares
from dynident.regression.joint_factors import JointFactorRegression
from dynident.regression.ordinary import TruncatedLeastSquares
from dynident.regression.statistics_regressor import StatisticsRegressor
from dynident.regression.stepwise import StepwiseRegression
from dynident.regression.total import TotalLeastSquares

EVERY = [
    TruncatedLeastSquares(),
    TotalLeastSquares(),
    StepwiseRegression(),
    CorrectedLeastSquares(),
    JointFactorRegression(max_iter=300),
    BayesianFactorRegression(max_iter=300),
    BayesianFactorRegression(queries="noiseless", max_iter=300),
]
NAMES = [
    type(one).__name__ + ("-noiseless" if getattr(one, "queries", "") == "noiseless" else "")
    for one in EVERY
]
HASTY = [one.another(max_iter=30) if hasattr(one, "max_iter") else one for one in EVERY]
"""The same after a few rounds, for an interface does not depend on them."""
every = pytest.mark.parametrize("regression", EVERY, ids=NAMES)


def data(seed: int = 0, rows: int = 300) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    T = rng.standard_normal((rows, 5))
    y = T @ [1.0, -2.0, 0.5, 0.0, 0.0] + 0.3 * rng.standard_normal(rows)
    return T + 0.2 * rng.standard_normal(T.shape), y


@parametrize_with_checks(HASTY)
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.slow
def test_scikit_learns_own_checks(estimator, check) -> None:
    check(estimator)


@every
def test_it_finds_what_is_there(regression: StatisticsRegressor) -> None:
    X, y = data(rows=3000)
    found = regression.another().fit(X, y)
    assert found.score(X, y) > 0.9
    assert abs(found.coef_[1] + 2.0) < 0.2 and np.abs(found.coef_[3:]).max() < 0.05


@every
def test_blocks_give_what_all_rows_give(regression: StatisticsRegressor) -> None:
    X, y = data()
    whole, parts = regression.another().fit(X, y), regression.another()
    for a in range(0, 300, 60):
        parts.partial_fit(X[a : a + 60], y[a : a + 60])
    np.testing.assert_allclose(parts.coef_, whole.coef_, rtol=1e-9, atol=1e-11)
    assert parts.intercept_ == pytest.approx(whole.intercept_, abs=1e-10)
    summed = SecondMoments.of(X[:40], y[:40]) + SecondMoments.of(X[40:], y[40:])
    elsewhere = regression.another().fit_statistics(summed)
    np.testing.assert_allclose(elsewhere.predict(X), whole.predict(X), atol=1e-9)


@every
def test_equivariance(regression: StatisticsRegressor) -> None:
    """To order, scale, sign and offset of the inputs, and to scale and offset of the output."""
    X, y = data()
    order = np.array([3, 1, 4, 0, 2])
    factors = np.array([1e3, -1.0, 1e-4, 2.0, -30.0])
    first = regression.another().fit(X, y)
    other = regression.another().fit(
        (X * factors + [1.0, -5.0, 0.1, 0.0, 7.0])[:, order], -2 * y + 3
    )
    expected = (-2.0 * first.coef_ / factors)[order]
    np.testing.assert_allclose(
        other.coef_ / np.abs(expected).max(), expected / np.abs(expected).max(), atol=1e-10
    )
    np.testing.assert_allclose(other.coef_ * factors[order], -2.0 * first.coef_[order], atol=1e-10)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.slow
def test_equivariance_after_hundreds_of_rounds_along_a_ridge(seed: int) -> None:
    """Correlated inputs of unknown noise: neither steps nor the end may hang on rounding."""
    rng = np.random.default_rng([9, seed])
    T = rng.standard_normal((3000, 7)) @ rng.standard_normal((7, 7))
    X = T + 0.5 * rng.standard_normal(T.shape) * T.std(axis=0)
    y = T @ (rng.standard_normal(7) * (rng.random(7) < 0.7)) + rng.standard_normal(3000)
    factors = 10.0 ** rng.uniform(-3, 3, 7) * rng.choice([-1, 1], 7)
    order = rng.permutation(7)
    first = BayesianFactorRegression(queries="noiseless").fit(X, y)
    other = BayesianFactorRegression(queries="noiseless").fit(
        (X * factors + rng.standard_normal(7))[:, order], -2 * y + 3
    )
    np.testing.assert_allclose(
        other.coef_ * factors[order] / np.abs(first.coef_).max(),
        -2.0 * first.coef_[order] / np.abs(first.coef_).max(),
        atol=1e-10,
    )


@every
def test_without_a_constant_it_goes_through_the_origin(regression: StatisticsRegressor) -> None:
    X, y = data()
    found = regression.another(fit_intercept=False).fit(X, y)
    assert found.intercept_ == 0.0
    mirrored = regression.another(fit_intercept=False)
    # The mirror image of every row says the same of a line through the origin.
    mirrored.fit(np.vstack([X, -X]), np.concatenate([y, -y]))
    np.testing.assert_allclose(mirrored.coef_, found.coef_, atol=0.05)


@every
def test_a_constant_column_gets_no_coefficient(regression: StatisticsRegressor) -> None:
    X, y = data()
    with_constant = np.column_stack([X[:, :2], np.full(300, 0.1), X[:, 2:]])
    plain, found = regression.another().fit(X, y), regression.another().fit(with_constant, y)
    assert found.coef_[2] == 0.0 and found.constant_[2]
    np.testing.assert_allclose(np.delete(found.coef_, 2), plain.coef_, atol=1e-10)


@every
def test_all_columns_constant_leave_the_mean(regression: StatisticsRegressor) -> None:
    found = regression.another().fit(np.ones((10, 2)), np.arange(10.0))
    np.testing.assert_array_equal(found.predict(np.ones((3, 2))), 4.5)


@pytest.mark.parametrize(
    "regression", [one for one in EVERY if not isinstance(one, CorrectedLeastSquares)]
)
def test_a_duplicated_column_predicts_as_one(regression: StatisticsRegressor) -> None:
    X, y = data()
    twice = np.column_stack([X, X[:, 1]])
    plain, found = regression.another().fit(X, y), regression.another().fit(twice, y)
    assert np.all(np.isfinite(found.coef_))
    assert found.score(twice, y) > plain.score(X, y) - 0.02


def test_a_duplicated_column_is_refused_where_it_cannot_be_shared_out() -> None:
    X, y = data()
    with pytest.raises(FitError, match="combinations of others"):
        CorrectedLeastSquares(0.01).fit(np.column_stack([X, X[:, 1]]), y)
    with pytest.raises(FitError, match="combinations of others"):
        CorrectedLeastSquares().fit(X[:4], y[:4])


@pytest.mark.parametrize(
    "regression", [one for one in EVERY if not isinstance(one, CorrectedLeastSquares)]
)
def test_more_columns_than_rows(regression: StatisticsRegressor) -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((20, 40))
    y = 3.0 * X[:, 7] + 0.1 * rng.standard_normal(20)
    found = regression.another().fit(X, y)
    assert np.all(np.isfinite(found.coef_)) and np.all(np.isfinite(found.predict(X)))


@every
def test_scales_of_any_size(regression: StatisticsRegressor) -> None:
    X, y = data()
    found = regression.another().fit(X * [1e120, 1e-120, 1.0, 1e8, 1e-8], 1e100 * y)
    plain = regression.another().fit(X, y)
    np.testing.assert_allclose(
        found.predict(X * [1e120, 1e-120, 1.0, 1e8, 1e-8]) / 1e100,
        plain.predict(X),
        rtol=1e-6,
        atol=1e-9,
    )


@every
def test_one_row_is_refused(regression: StatisticsRegressor) -> None:
    with pytest.raises(ValueError, match="n_samples = 1"):
        regression.another().fit([[1.0, 2.0]], [3.0])
    with pytest.raises(FitError, match="two rows"):
        regression.another().fit_statistics(SecondMoments.of(np.ones((1, 2)), np.ones(1)))


@every
def test_it_works_in_a_pipeline_and_in_cross_validation(regression: StatisticsRegressor) -> None:
    X, y = data()
    scores = cross_val_score(make_pipeline(StandardScaler(), regression.another()), X, y, cv=3)
    assert scores.min() > 0.85


@every
def test_columns_of_a_data_frame_have_names(regression: StatisticsRegressor) -> None:
    X, y = data()
    frame = pd.DataFrame(X, columns=list("abcde"))
    found = regression.another().fit(frame, y)
    assert found.input_names() == list("abcde")
    with pytest.raises(ValueError, match="feature names"):
        found.predict(frame.rename(columns={"a": "z"}))


def test_truncated_and_stepwise_are_what_they_say() -> None:
    X, y = data()
    want = LinearRegression().fit(X, y)
    np.testing.assert_allclose(TruncatedLeastSquares().fit(X, y).coef_, want.coef_, rtol=1e-10)
    # Of all solutions both choose the smallest, here in standardised inputs.
    dependent = StandardScaler().fit_transform(np.column_stack([X, X[:, 0] + X[:, 1]]))
    want = LinearRegression().fit(dependent, y)
    found = TruncatedLeastSquares().fit(dependent, y)
    assert found.rank_ == 5
    np.testing.assert_allclose(found.coef_, want.coef_, atol=1e-8)
    chosen = StepwiseRegression().fit(X, y).chosen_
    assert {0, 1, 2} <= set(chosen) and len(chosen) <= 4
    want = LinearRegression().fit(X[:, chosen], y).coef_
    np.testing.assert_allclose(StepwiseRegression().fit(X, y).coef_[chosen], want, rtol=1e-9)


@every
def test_a_constant_output_needs_no_input(regression: StatisticsRegressor) -> None:
    X, _ = data()
    for constant in (0.0, 0.1, 1e5):
        found = regression.another().fit(X, np.full(300, constant))
        np.testing.assert_array_equal(found.coef_, 0.0)
        np.testing.assert_allclose(found.predict(X), constant)


@every
def test_rows_that_are_refused_have_not_been_seen(regression: StatisticsRegressor) -> None:
    X, y = data()
    found = regression.another().partial_fit(X[:100], y[:100])
    with pytest.raises(ValueError, match="NaN"):
        found.partial_fit(np.full((3, 5), np.nan), y[:3])
    assert found.statistics_.count == 100


@every
def test_a_fit_that_is_refused_leaves_the_one_before(regression: StatisticsRegressor) -> None:
    X, y = data()
    found = regression.another().fit(X, y)
    before = found.predict(X)
    with pytest.raises(FitError, match="two rows"):
        found.fit_statistics(SecondMoments.of(np.ones((1, 2)), np.ones(1)))
    bad = SecondMoments(np.full((4, 4), np.nan), 100)
    with pytest.raises(FitError, match="not finite"):
        found.fit_statistics(bad)
    assert found.n_features_in_ == 5
    np.testing.assert_array_equal(found.predict(X), before)


@every
def test_blocks_may_be_shorter_than_a_fit_needs(regression: StatisticsRegressor) -> None:
    X, y = data()
    found = regression.another()
    with pytest.warns(DynidentWarning, match=r"not fitted yet: n_samples = 1.*two rows"):
        found.partial_fit(X[:1], y[:1])
    with pytest.raises(NotFittedError):
        found.predict(X)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DynidentWarning)
        # By twos until there are more rows than inputs, and on.
        for a, b in pairwise((1, 3, 5, 7, 9, 11, 61)):
            found.partial_fit(X[a:b], y[a:b])
    whole = regression.another().fit(X[:61], y[:61])
    np.testing.assert_allclose(found.predict(X), whole.predict(X), rtol=1e-4, atol=1e-4)


@every
def test_units_so_small_that_squares_underflow(regression: StatisticsRegressor) -> None:
    """Down to where they do the answer is the same, and below they are refused by name."""
    X, y = data()
    usual = regression.another().fit(X, y).predict(X)
    for size in (1e-140, 1e140):
        unit = np.array([size, 1.0, 1.0, 1.0, 1.0])
        found = regression.another().fit(X * unit, y)
        np.testing.assert_allclose(found.predict(X * unit), usual, rtol=1e-6, atol=1e-8)
    with pytest.raises(FitError, match=r"input 0.*underflow"):
        regression.another().fit(X * [1e-155, 1, 1, 1, 1], y)
    with pytest.raises(FitError, match=r"the output.*underflow"):
        regression.another().fit(X, y * 1e-160)


@every
def test_constants_are_constants_however_long(regression: StatisticsRegressor) -> None:
    rng = np.random.default_rng(1)
    X = np.column_stack([rng.standard_normal(200_000), *np.full((2, 200_000), [[0.1], [0.3]])])
    y = 2 * X[:, 0] + 1e4
    found = regression.another().fit(X, y)
    np.testing.assert_array_equal(found.constant_, [False, True, True])
    np.testing.assert_array_equal(found.coef_[1:], 0.0)


def test_an_exact_law_takes_no_other_inputs_in() -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((1000, 20))
    found = StepwiseRegression().fit(X, 3 * X[:, 1] - X[:, 5])
    np.testing.assert_array_equal(found.chosen_, [1, 5])


def test_stepwise_keeps_what_is_irrelevant_out_at_its_level() -> None:
    rng = np.random.default_rng(2)
    wrong = 0
    for _ in range(200):
        X = rng.standard_normal((100, 1))
        wrong += len(StepwiseRegression().fit(X, rng.standard_normal(100)).chosen_)
    assert 2 <= wrong <= 20, "5 % of 200"


def test_total_least_squares_is_right_where_all_noise_is_alike() -> None:
    rng = np.random.default_rng(0)
    T = rng.standard_normal((100_000, 2))
    y = T @ [1.0, 1.0] / np.sqrt(2.0)
    X, y = T + 0.3 * rng.standard_normal(T.shape), y + 0.3 * rng.standard_normal(len(y))
    found = TotalLeastSquares().fit(X, y)
    np.testing.assert_allclose(found.coef_, 1.0 / np.sqrt(2.0), atol=0.01)
    assert found.noise_share_ == pytest.approx(0.09 / 1.09, rel=0.02)


@pytest.mark.parametrize(
    ("regression", "words"),
    [
        (StepwiseRegression(enter=0.2, leave=0.1), "leave = 0.1"),
        (StepwiseRegression(max_iter=0), "max_iter"),
        (TruncatedLeastSquares(rcond=float("nan")), "rcond"),
        (TotalLeastSquares(rcond="a"), "rcond"),  # type: ignore[arg-type]
        (CorrectedLeastSquares("repeats"), "'repeats' is no number"),
        (CorrectedLeastSquares([0.1, 0.2]), "shape"),
        (CorrectedLeastSquares(-1.0), "covariance"),
        (CorrectedLeastSquares(float("nan")), "covariance"),
        (CorrectedLeastSquares(100.0), "input noise is all"),
        (JointFactorRegression(100.0), "input x"),
        (JointFactorRegression([0.1, 0.2]), "shape"),
        (JointFactorRegression(reliability=1.0), "reliability"),
        (JointFactorRegression(reliability=1e-300), "reliability"),
        (JointFactorRegression(tol="a"), "tol"),  # type: ignore[arg-type]
        (JointFactorRegression(max_iter=0), "max_iter"),
        (BayesianFactorRegression(relevance_shape=0.0), "relevance_shape"),
        (BayesianFactorRegression(queries="both"), "queries"),  # type: ignore[arg-type]
    ],
)
def test_settings_that_cannot_be_are_refused(regression, words: str) -> None:
    with pytest.raises(FitError, match=words):
        regression.fit(*data())
