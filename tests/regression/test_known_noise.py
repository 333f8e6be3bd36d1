"""Input noise that is known: consistency, honest intervals, and what the data refuse to tell."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.exceptions import NotFittedError

from dynident.errors import FitError
from dynident.moments import SecondMoments
from dynident.regression.bayesian_factors import BayesianFactorRegression
from dynident.regression.corrected import CorrectedLeastSquares
from dynident.regression.identifiability import (
    StartSensitivity,
    reliability_profile,
    start_sensitivity,
)
from dynident.regression.joint_factors import JointFactorRegression
from dynident.regression.ordinary import TruncatedLeastSquares

TRUE = np.array([1.0, -2.0, 0.5, 0.0])
NOISE = 0.25
MIXED = np.array([[1.0, 0.8, 0.0, 0.2], [0.0, 0.6, 0.5, 0.0], [0.0, 0.0, 0.8, 0.5], [0, 0, 0, 0.8]])


def data(seed: int, rows: int, mixing: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, rows])
    T = rng.standard_normal((rows, 4)) @ (np.eye(4) if mixing is None else mixing)
    y = T @ TRUE + 0.5 * rng.standard_normal(rows)
    return T + np.sqrt(NOISE) * rng.standard_normal(T.shape), y


@pytest.mark.parametrize(
    ("regression", "mixing"),
    [
        (JointFactorRegression(NOISE, queries="noiseless"), None),
        (BayesianFactorRegression(NOISE, queries="noiseless", max_iter=2000), None),
        (CorrectedLeastSquares(NOISE), None),
        (CorrectedLeastSquares(NOISE), MIXED),
    ],
    ids=["factors", "bayes", "corrected", "corrected, correlated inputs"],
)
@pytest.mark.slow
def test_the_error_falls_with_the_data_while_that_of_least_squares_stays(regression, mixing):
    def errors(rows: int) -> tuple[float, float]:
        squares = np.zeros(2)
        for seed in range(12):
            X, y = data(seed, rows, mixing)
            for k, one in enumerate((regression, TruncatedLeastSquares())):
                squares[k] += np.sum((one.fit(X, y).coef_ - TRUE) ** 2) / 12
        return float(np.sqrt(squares[0])), float(np.sqrt(squares[1]))

    (few, plain_few), (many, plain_many) = errors(1000), errors(64_000)
    # A factor of 8 in the error for 64 in the rows, within what a dozen trials scatter.
    assert 5 < few / many < 13
    assert 0.8 < plain_few / plain_many < 1.25 and plain_many > 10 * many


def test_corrected_least_squares_takes_correlated_noise_as_it_is() -> None:
    rng = np.random.default_rng(0)
    T = rng.standard_normal((200_000, 4)) @ MIXED
    factor = np.array([[0.5, 0.4, 0, 0], [0, 0.3, 0, 0], [0, 0, 0.2, -0.3], [0, 0, 0, 0.1]])
    X = T + rng.standard_normal(T.shape) @ factor
    y = T @ TRUE
    found = CorrectedLeastSquares(factor.T @ factor).fit(X, y)
    assert np.all(np.abs(found.coef_ - TRUE) < 4 * found.sigma_)
    assert np.all(found.sigma_ < 0.02)
    shares = CorrectedLeastSquares(0.3 * np.diag(factor.T @ factor)).fit(X, y)
    assert np.any(np.abs(shares.coef_ - TRUE) > 10 * shares.sigma_)


@pytest.mark.slow
@pytest.mark.parametrize("coupling", [0.0, 0.1, 0.8])
def test_intervals_cover(coupling: float) -> None:
    """95 % intervals over 200 trials and 4 inputs, however the inputs are correlated.

    One coefficient is two to three of its standard deviations, where pruning errs. The standard
    error of a rate is 0.8 %.
    """
    rows, trials = 400, 200
    mixing = np.eye(4)
    mixing[0, 1] = coupling
    weak = np.array([1.0, -2.0, 0.5, 0.13])
    noisy = np.linalg.solve(mixing.T @ mixing + NOISE * np.eye(4), mixing.T @ mixing @ weak)
    covered = dict.fromkeys(("true", "noisy", "corrected"), 0)
    off_true, off_corrected = [], []
    for seed in range(trials):
        rng = np.random.default_rng([seed, 3])
        T = rng.standard_normal((rows, 4)) @ mixing
        y = T @ weak + 0.5 * rng.standard_normal(rows)
        X = T + np.sqrt(NOISE) * rng.standard_normal(T.shape)
        # Where rounds end b_true is less than a tenth of its sigma from there.
        one = JointFactorRegression(NOISE, queries="noiseless", tol=0.1, max_iter=120).fit(X, y)
        low, high = one.interval().T
        covered["true"] += int(np.sum((low < weak) & (high > weak)))
        # That of noisy inputs is of least squares: rounds do not change it.
        plain = JointFactorRegression(queries="noisy", max_iter=1).fit(X, y)
        low, high = plain.interval().T
        covered["noisy"] += int(np.sum((low < noisy) & (high > noisy)))
        assert one.corrected_ is not None
        off = np.abs(one.corrected_.coef_ - weak)
        covered["corrected"] += int(np.sum(off < 1.96 * one.corrected_.sigma_))
        off_corrected.append(off / one.corrected_.sigma_)
        off_true.append((one.coef_true_ - weak) / one.sigma_true_)
    rates = {name: count / (4 * trials) for name, count in covered.items()}
    assert 0.92 < rates["noisy"] < 0.98 and 0.92 < rates["corrected"] < 0.98, rates
    # b_true is not what its interval is made for: that is wide enough, and wider.
    assert rates["true"] > 0.93, rates
    # In units of sigma: 1, where sigma is neither too small nor too large.
    assert 0.9 < np.sqrt(np.mean(np.square(off_corrected))) < 1.1
    assert 0.6 < np.sqrt(np.mean(np.square(off_true))) < 1.05


def test_without_degrees_of_freedom_there_are_no_intervals() -> None:
    X, y = data(0, 5)
    for rows in (4, 5):
        found = JointFactorRegression(0.01).fit(X[:rows], y[:rows])
        assert np.all(np.isnan(found.interval())) and np.all(np.isfinite(found.coef_))


def test_correlated_inputs_are_told_and_corrected_least_squares_stands_beside() -> None:
    X, y = data(0, 4000, MIXED)
    found = BayesianFactorRegression(NOISE, queries="noiseless").fit(X, y)
    assert found.corrected_ is not None
    plain = CorrectedLeastSquares(NOISE).fit(X, y)
    np.testing.assert_array_equal(found.corrected_.coef_, plain.coef_)
    assert np.any(np.abs(found.coef_true_ - TRUE) > 5 * plain.sigma_)
    assert "not independent. Prefer it" in found.summary()
    low, high = found.interval().T
    assert np.all((low < TRUE) & (high > TRUE)), "as wide as it is wrong"
    independent = BayesianFactorRegression(NOISE).fit(*data(0, 4000))
    assert "not independent" not in independent.summary()


@pytest.mark.slow
def test_what_the_data_do_not_tell_is_said() -> None:
    rng = np.random.default_rng(2)
    T = rng.standard_normal((3000, 3))
    y = T @ [1.0, 1.0, 0.0] + 3.0 * rng.standard_normal(3000)
    X = T + 0.5 * rng.standard_normal(T.shape)
    found = JointFactorRegression(tol=1e-3).fit(X, y)
    assert np.all(np.isnan(found.sigma_true_)) and "was not given" in found.summary()
    profile = reliability_profile(found)
    assert profile.flat and np.ptp(profile.likelihoods) < 0.01
    assert "do not tell" in str(profile.table())
    starts = start_sensitivity(found)
    assert np.ptp(starts.bounds) < 0.01 and starts.spread > 0.3
    assert "differs by" in str(starts.table())


@pytest.mark.slow
def test_what_the_data_do_tell_is_said_too() -> None:
    """Hardly any noise in the output: there is no room for much in the inputs."""
    rng = np.random.default_rng(2)
    X = rng.standard_normal((3000, 3))
    y = X @ [1.0, 1.0, 0.0] + 0.1 * rng.standard_normal(3000)
    found = JointFactorRegression(max_iter=2000).fit(X, y)
    profile = reliability_profile(found)
    words = " ".join(str(profile.table()).split())
    assert not profile.flat and "independent inputs would speak against" in words
    assert "not independent" not in words
    assert profile.likelihoods[0] < profile.likelihoods[-1] - 100
    given = JointFactorRegression(0.01).fit(X, y)
    with pytest.raises(FitError, match="given"):
        reliability_profile(given)


def test_correlated_inputs_do_not_speak_of_their_noise() -> None:
    """The likelihood prefers less noise than there is; that is told to be no evidence."""
    rng = np.random.default_rng(0)
    T = rng.multivariate_normal(np.zeros(3), 0.1 * np.eye(3) + 0.9, size=5000)
    X = T + 0.5 * rng.standard_normal(T.shape)
    y = T @ [1.0, 2.0, 3.0] + 0.1 * rng.standard_normal(5000)
    profile = reliability_profile(JointFactorRegression().fit(X, y), (0.8, 0.95))
    assert profile.likelihoods[1] > profile.likelihoods[0] + 2, "0.8 is the truth"
    assert profile.correlation == pytest.approx(0.9 / 1.25, abs=0.03)
    words = " ".join(str(profile.table()).split())
    assert "not independent" in words and "no evidence" in words


def test_bounds_are_other_optima_only_where_they_converged() -> None:
    def sensitivity(*converged: bool) -> str:
        k = len(converged)
        words = tuple("converged" if one else "not converged" for one in converged)
        found = StartSensitivity(
            names=("a",),
            reliabilities=np.linspace(0.5, 0.9, k),
            coef_true=np.ones((k, 1)),
            sizes=np.ones(1),
            bounds=-10.0 * np.arange(k),
            endings=words,
            converged=np.array(converged),
        )
        return " ".join(str(found.table()).split())

    assert "different optima" in sensitivity(True, True)
    assert "different" not in sensitivity(True, False)
    assert "not converged" in sensitivity(True, False)


@pytest.mark.slow
def test_a_flat_ridge_is_told_with_what_is_left_along_it() -> None:
    """A single input: nothing but the prior speaks of its reliability, and that hardly."""
    rng = np.random.default_rng(1)
    t = rng.standard_normal(100_000)
    X, y = (t + 0.5 * rng.standard_normal(len(t)))[:, None], 2 * t + rng.standard_normal(len(t))
    statistics = SecondMoments.of(X, y)
    starts = (0.8, 0.95)
    usual = [BayesianFactorRegression(reliability=r).fit_statistics(statistics) for r in starts]
    patient = [
        BayesianFactorRegression(reliability=r, tol=1e-4, max_iter=100_000).fit_statistics(
            statistics
        )
        for r in starts
    ]
    best = max(one.bounds_[-1] for one in patient)
    for one in usual:
        assert not one.converged_ and one.ending_ == "ended on a flat ridge"
        assert 0.5 * (best - one.bounds_[-1]) < one.left_ < 1.1 * (best - one.bounds_[-1])
        assert one.drift_ > 0.01 and "flat ridge" in one.summary()
    assert all(one.converged_ for one in patient)
    np.testing.assert_allclose(patient[0].coef_true_, patient[1].coef_true_, rtol=1e-2)
    assert abs(usual[0].coef_true_[0] / usual[1].coef_true_[0] - 1) > 0.02


def test_what_is_asked_of_a_fit_that_is_none_is_refused() -> None:
    found = JointFactorRegression()
    for asked in (found.summary, found.interval, lambda: start_sensitivity(found)):
        with pytest.raises(NotFittedError):
            asked()
    found.fit(*data(0, 200))
    for level in (95, 0.0, -1.0):
        with pytest.raises(FitError, match="level"):
            found.interval(level)
    for wrong in ((), (float("nan"),), (0.5, 1.0)):
        with pytest.raises(FitError, match="reliabilities"):
            reliability_profile(found, wrong)


def test_a_covariance_with_the_rounding_of_a_product_is_one() -> None:
    X, y = data(4, 400)
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 4)))[0]
    found = CorrectedLeastSquares(Q @ (NOISE * np.eye(4)) @ Q.T).fit(X, y)
    np.testing.assert_allclose(found.coef_, CorrectedLeastSquares(NOISE).fit(X, y).coef_)


def test_constants_have_no_interval() -> None:
    X, y = data(0, 300)
    X = np.column_stack([X, np.full(300, 3.0)])
    found = JointFactorRegression(NOISE * np.array([1, 1, 1, 1, 0.0])).fit(X, y)
    assert found.corrected_ is not None and np.isnan(found.corrected_.sigma_[-1])
    assert np.isnan(found.sigma_true_[-1]) and np.all(np.isfinite(found.sigma_true_[:-1]))


def test_noise_known_of_some_inputs_only() -> None:
    X, y = data(3, 20_000)
    noise = np.array([NOISE, np.nan, NOISE, NOISE])
    found = BayesianFactorRegression(noise, queries="noiseless").fit(X, y)
    known = np.isfinite(noise)
    np.testing.assert_array_equal(found.known_, known)
    np.testing.assert_allclose(found.coef_[known], TRUE[known], atol=0.05)
    assert "x1 was not given" in found.summary()
    np.testing.assert_allclose(found.reliability_[known], 0.8, atol=0.02)
    assert found.corrected_ is None and np.all(np.isnan(found.sigma_true_))


def test_what_is_irrelevant_is_pruned_by_name() -> None:
    X, y = data(5, 3000)
    found = BayesianFactorRegression().fit(X, y)
    assert list(found.pruned_) == [False, False, False, True]
    # The prior speaks against the reliability of whatever is not needed, and is not followed far.
    assert np.all(np.abs(found.coef_true_) <= 2.001 * np.abs(found.coef_noisy_))
    assert found.coef_true_[3] == 0.0 and "Pruned" in found.summary()
    assert found.relevance_[3] > 1e3 * found.relevance_[:3].max()


def test_combinations_of_other_inputs_are_named() -> None:
    X, y = data(6, 500)
    found = JointFactorRegression(NOISE).fit(np.column_stack([X, X[:, 0] - X[:, 1]]), y)
    assert found.basis_ is not None and len(found.basis_.dependent) == 1
    assert found.corrected_ is None
    assert "combinations of other inputs" in found.summary()
    assert np.isnan(found.sigma_noisy_[[0, 1, 4]]).all()
    assert np.isfinite(found.sigma_noisy_[[2, 3]]).all()


def test_rounds_that_do_not_suffice_are_told() -> None:
    X, y = data(7, 500)
    found = BayesianFactorRegression(max_iter=5).fit(X, y)
    assert not found.converged_ and found.n_iter_ == 5 and "Not converged" in found.summary()


def test_statistics_of_recordings_suffice() -> None:
    X, y = data(8, 600)
    parts = [SecondMoments.of(X[k::3], y[k::3]) for k in range(3)]
    # As many rounds for both: rounding may end one of them a round sooner.
    one = BayesianFactorRegression(NOISE, max_iter=200).fit(X, y)
    other = BayesianFactorRegression(NOISE, max_iter=200).fit_statistics(
        parts[2] + (parts[0] + parts[1])
    )
    np.testing.assert_allclose(other.coef_true_, one.coef_true_, rtol=1e-8)
