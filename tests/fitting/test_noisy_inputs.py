"""Regressions as methods of `di.fit`: rows of all joints, known noise of the inputs, penalties."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.linear_model import LassoCV, Ridge, RidgeCV
from sklearn.model_selection import PredefinedSplit

import dynident as di
from dynident.errors import FitError
from dynident.fitting import load_estimate, rows
from dynident.fitting.noisy_inputs import encoder_noise, input_noise
from dynident.fitting.noisy_inputs.posed import pieces_of
from dynident.fitting.noisy_inputs.regressors import few_rows
from dynident.moments.factors import TriangularFactors, factorise, in_pieces, products_of
from dynident.regression.bayesian_factors import BayesianFactorRegression
from dynident.regression.names import REGRESSIONS
from synthetic import arm, synthetic, true_values

STD = 2e-4
ROUGH = di.Filter(position_cutoff_hz=80.0, cutoff_hz=60.0, rate_hz=250.0)
"""Lets much of the encoders' noise through."""
KNOWN = di.recording.Noise(np.full(2, STD), np.full(2, 0.1))


@cache
def model() -> di.Model:
    return di.Model(arm()) + di.effects_of("viscous_friction", arm())


@cache
def truth() -> np.ndarray:
    return true_values(model(), Fv__shoulder=1.0, Fv__elbow=0.5)


@cache
def noisy(seed: int = 3, position_std: float = STD) -> di.Dataset:
    one = synthetic(
        model(), truth(), seed, duration=32.0, position_std=position_std, torque_std=0.1
    )
    return di.Dataset((one,), ROUGH, KNOWN)


@pytest.mark.parametrize("name", [name for name in REGRESSIONS if name != "corrected"])
@pytest.mark.slow
def test_every_regression_finds_the_truth_where_there_is_no_input_noise(name: str) -> None:
    found = di.fit(model(), noisy(3, 0.0), di.Regression(name))
    size = np.abs(truth()).max()
    # The two factor analyses unfold by a reliability that no data tell: b_noise is at most halved.
    most = 0.3 if name in ("factors", "bayes") else 0.02
    np.testing.assert_allclose(found.values, truth(), atol=most * size)
    if name == "factors":  # b_noise is that of least squares to the small ones
        regressor: Any = di.Regression(name).regressor(model(), noisy(3, 0.0))
        np.testing.assert_allclose(regressor.coef_noisy_, truth(), atol=0.02 * size)
    assert found.rows == 2 * sum(len(torque) for _, torque in rows(model(), noisy(3, 0.0)))
    assert found.error < 0.1 and found.summary()


def test_the_noise_of_encoders_is_what_it_adds_to_the_columns() -> None:
    """Carried through the filters, measured on repetitions, and as it truly is."""
    clean = noisy(3, 0.0)
    true = np.zeros((model().size, model().size))
    std = di.fit(model(), noisy()).torque_std
    for (with_noise, _), (without, _) in zip(
        rows(model(), noisy()), rows(model(), clean), strict=True
    ):
        difference = ((with_noise - without) / std[:, None]).reshape(-1, model().size)
        true += difference.T @ difference
    for found in (encoder_noise(model(), noisy()), input_noise(model(), noisy())):
        size = np.sqrt(np.diag(true))
        np.testing.assert_allclose(
            found.gram / np.outer(size, size), true / np.outer(size, size), atol=0.12
        )
        assert np.all((found.share >= 0) & (found.share < 1))


def sigma_of_independent_rows(found: di.Estimate) -> np.ndarray:
    """What the textbook's least squares says of its doubt, (p,)."""
    whole = [
        (columns / found.torque_std[:, None]).reshape(-1, len(found.values))
        for columns, _ in rows(model(), noisy())
    ]
    return np.sqrt(np.diag(np.linalg.inv(sum(x.T @ x for x in whole))))


@pytest.mark.parametrize("noise", ["encoders", "repeats"])
def test_corrected_least_squares_is_right_where_least_squares_is_wrong(noise) -> None:
    corrected = di.fit(model(), noisy(), di.Regression("corrected", noise))
    plain = di.fit(model(), noisy())
    off = np.abs(corrected.values - truth()) / corrected.sigma
    assert np.all(off < 4), off
    bias = np.abs(plain.values - truth())
    assert np.max(bias / sigma_of_independent_rows(plain)) > 50
    # It says so, and its sigma holds the bias.
    assert "Noise in the positions biases this fit" in plain.headline
    assert np.max(bias / plain.sigma) < 2
    inertia = corrected.names.index("Izz.fore")
    assert abs(plain.values[inertia]) < 0.7 * truth()[inertia]
    assert "worst direction" in corrected.summary()


def test_bayes_says_that_its_inputs_are_correlated() -> None:
    found = di.fit(model(), noisy(), di.Regression("bayes", "encoders"))
    assert "not independent. Prefer it" in " ".join(found.summary().split())
    corrected = di.fit(model(), noisy(), di.Regression("corrected", "encoders"))
    off = np.hypot(found.values - corrected.values, corrected.sigma)
    np.testing.assert_allclose(found.sigma, off, rtol=1e-6)
    free = di.fit(model(), noisy(), di.Regression("bayes"))
    assert "was not given" in free.summary() and np.isnan(free.sigma).all()
    assert "No sigma" in free.summary()


@pytest.mark.slow
def test_intervals_of_corrected_least_squares_cover_though_noise_is_filtered() -> None:
    """25 draws of the noise, 8 parameters: filtered rows are not independent, the pieces are."""
    clean = synthetic(model(), truth(), 3, duration=32.0, position_std=0.0, torque_std=0.0)
    off = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        recording = clean.replace(
            q=clean.q + STD * rng.standard_normal(clean.q.shape),
            tau=clean.tau + 0.1 * rng.standard_normal(clean.q.shape),
        )
        found = di.fit(
            model(),
            replace(noisy(), recordings=(recording,)),
            di.Regression("corrected", "encoders"),
        )
        off.append((found.values - truth()) / found.sigma)
    covered = np.mean(np.abs(off) < 1.96)
    assert covered > 0.9, covered
    # Wider than needed: what the noise does changes with the motion, between pieces, too.
    size = np.sqrt(np.mean(np.square(off), axis=0))
    assert size.max() < 1.2 and 0.4 < np.sqrt(np.mean(size**2)) < 1.1


def test_input_noise_that_is_overstated_is_told_and_no_other() -> None:
    for seed in range(3):
        quiet = synthetic(
            model(), truth(), seed, duration=32.0, position_std=STD / 3, torque_std=0.001
        )
        stated = di.recording.Noise(np.full(2, STD / 3), np.full(2, 0.001))
        dataset = di.Dataset((quiet,), ROUGH, stated)
        noise = encoder_noise(model(), dataset)
        found = di.fit(model(), dataset, di.Regression("corrected", noise))
        assert "overstated" not in found.summary()
        more = replace(noise, gram=1.3 * noise.gram)
        found = di.fit(model(), dataset, di.Regression("corrected", more))
        assert "overstated: it would leave" in " ".join(found.summary().split())


def test_one_sigma_is_printed_with_what_it_holds(tmp_path: Path) -> None:
    """In the table of parameters, in that of the regression, and in the file."""
    found = di.fit(model(), noisy(), di.Regression("bayes", "encoders"))
    text = " ".join(found.summary().split())
    assert "scatter between 20 consecutive pieces" in text and "as independent" not in text
    regressor: Any = di.Regression("bayes", "encoders").regressor(model(), noisy())
    np.testing.assert_allclose(regressor.sigma_true_, found.sigma, rtol=1e-9)
    again = load_estimate(found.save(tmp_path / "estimate.json"))
    assert again.words_of_sigma == found.words_of_sigma
    plain = di.fit(model(), noisy(), di.LeastSquares(errors="independent"))
    assert "as independent" in plain.words_of_sigma


def test_an_estimator_may_be_set_up_otherwise() -> None:
    few = di.Regression(BayesianFactorRegression(max_iter=3))
    found = di.fit(model(), noisy(), few)
    assert found.status == "not converged" and "Not converged: 3 rounds" in found.summary()


def test_an_estimate_without_intervals_is_saved_and_read(tmp_path: Path) -> None:
    found = di.fit(model(), noisy(), di.Regression("ridge"))
    again = load_estimate(found.save(tmp_path / "estimate.json"))
    np.testing.assert_array_equal(again.values, found.values)
    assert np.isnan(again.sigma).all() and again.method == found.method


def test_few_rows_stand_for_many() -> None:
    """Folded rows have the statistics of all, and penalties validated on them are the same."""
    rng = np.random.default_rng(0)
    X = rng.standard_normal((4000, 6)) @ rng.standard_normal((6, 6))
    y = X @ [1.0, 0.0, 2.0, 0.0, 0.0, -1.0] + 2.0 * rng.standard_normal(4000)
    piece = np.repeat(np.arange(4), 1000)
    parts: list[TriangularFactors] = [
        factorise([(X[piece == k][:, None], y[piece == k][:, None])]) for k in range(4)
    ]
    pieces = in_pieces(parts, np.ones(1))
    few = few_rows(pieces)
    assert len(few.X) == 4 * 2 * 7 and pieces.rows == 4000
    both = np.column_stack([X, y])
    np.testing.assert_allclose(products_of(pieces).total, both.T @ both, rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(few.X.mean(axis=0), 0.0, atol=1e-12)

    on_few, on_all = PredefinedSplit(few.piece), PredefinedSplit(piece)
    options = {"fit_intercept": False, "alphas": np.logspace(-4, 0, 30), "max_iter": 50_000}
    lasso = LassoCV(cv=on_few, **options).fit(few.X, few.y)
    want = LassoCV(cv=on_all, **options).fit(X, y)
    assert lasso.alpha_ == want.alpha_
    np.testing.assert_allclose(lasso.coef_, want.coef_, atol=1e-3)
    penalties, scoring = np.logspace(-6, 1, 30), "neg_mean_squared_error"
    ridge: Any = RidgeCV(penalties * len(few.X), fit_intercept=False, cv=on_few, scoring=scoring)
    other: Any = RidgeCV(penalties * 4000, fit_intercept=False, cv=on_all, scoring=scoring)
    ridge.fit(few.X, few.y)
    other.fit(X, y)
    assert ridge.alpha_ / len(few.X) == pytest.approx(other.alpha_ / 4000)
    np.testing.assert_allclose(ridge.coef_, other.coef_, atol=1e-8)


@pytest.mark.parametrize(
    ("method", "words"),
    [
        (di.Regression("rigde"), "ridge"),
        (di.Regression("corrected"), "needs the noise"),
        (di.Regression("ridge", "encoders"), "no place"),
        (di.Regression("stepwise", "repeats"), "no place"),
        (di.Regression("bayes", "sensors"), "repeats or encoders"),  # type: ignore[arg-type]
    ],
)
def test_what_does_not_fit_together_is_refused(method: di.Regression, words: str) -> None:
    with pytest.raises(FitError, match=words):
        di.fit(model(), noisy(), method)


def test_noise_of_another_model_is_refused() -> None:
    other = encoder_noise(di.Model(arm()), noisy())
    with pytest.raises(FitError, match="other parameters"):
        di.fit(model(), noisy(), di.Regression("corrected", other))
    own = BayesianFactorRegression(0.1)
    with pytest.raises(FitError, match="own input_noise"):
        di.fit(model(), noisy(), di.Regression(own))
    with pytest.raises(FitError, match="Ridge is no regression"):
        di.fit(model(), noisy(), di.Regression(Ridge()))  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_estimator_itself_is_handed_out() -> None:
    method = di.Regression("factors", "encoders")
    found, estimate = method.regressor(model(), noisy()), di.fit(model(), noisy(), method)
    assert isinstance(found, di.regression.JointFactorRegression) and found.known_.all()
    kept = list(estimate.basis.independent)
    assert found.input_names() == [estimate.names[i] for i in kept]
    np.testing.assert_array_equal(found.coef_true_, estimate.values[kept])
    with pytest.raises(FitError, match="ridge is scikit-learn's"):
        di.Regression("ridge").regressor(model(), noisy())


def test_recordings_of_unequal_length_are_cut_into_equal_pieces() -> None:
    short = synthetic(model(), truth(), 4, duration=8.0, torque_std=0.1)
    both = replace(noisy(), recordings=(short, *noisy().recordings))
    pieces = pieces_of(model(), both, None)
    counts = np.array([piece.rows for piece in pieces])
    assert len(pieces) == 20 and np.ptp(counts) <= 2
    assert counts.sum() == sum(torque.size for _, torque in rows(model(), both))


def test_noise_that_nobody_knows_is_asked_for() -> None:
    with pytest.raises(FitError, match="position_std"):
        di.fit(model(), replace(noisy(), noise=None), di.Regression("corrected", "encoders"))
    once = noisy().recordings[0].replace(period=None)
    with pytest.raises(FitError, match="no recording repeats"):
        di.fit(model(), replace(noisy(), recordings=(once,)), di.Regression("bayes", "repeats"))


def test_more_noise_than_signal_is_refused_in_words() -> None:
    rough = replace(noisy(), filter=di.Filter())
    with pytest.raises(FitError, match="in some direction the input noise"):
        di.fit(model(), rough, di.Regression("corrected", "encoders"))
