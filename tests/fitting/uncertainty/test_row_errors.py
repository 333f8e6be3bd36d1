"""Errors that rows share: intervals of least squares against errors of known truth."""

from __future__ import annotations

import numpy as np
import pytest

import dynident as di
import two_link_loop as lab
from dynident.fitting import LeastSquares, fit, sample, solve_factors
from dynident.fitting.uncertainty.row_errors import row_errors
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset, Filter, Noise, Recording
from synthetic import arm, synthetic, true_values

STD = (2.0, 0.8)


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


def covered(estimates: list[di.fitting.Estimate], truth: np.ndarray) -> float:
    inside = [np.abs(one.values - truth) < 1.96 * one.sigma for one in estimates]
    return float(np.mean(inside))


def drawn(model: Model, clean: Recording, settings: Filter | None, seed: int) -> Dataset:
    noise = np.array(STD) * np.random.default_rng(seed).normal(size=clean.tau.shape)
    return Dataset((clean.replace(tau=clean.tau + noise),), settings)


@pytest.mark.slow
def test_white_unfiltered_noise_gives_the_ordinary_covariance(model: Model) -> None:
    """In the mean of noise draws, in every direction of the parameters."""
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    clean = synthetic(model, truth, 3, rate_hz=100.0, duration=64.0, period=None)
    ratios = []
    for seed in range(20):
        data = drawn(model, clean, Filter(), seed)
        here, there = fit(model, data), fit(model, data, LeastSquares(errors="independent"))
        ratios.append(here.sigma**2 / there.sigma**2)
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.1)


@pytest.mark.slow
def test_behind_a_low_pass_variances_are_those_of_the_errors(model: Model) -> None:
    """Without the noise's colour they are too small by a third.

    Of a record so long that they are not widened for how little is known of the colour.
    """
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    clean = synthetic(model, truth, 3, rate_hz=200.0, duration=64.0, period=None)
    sampled = sample(clean, None)
    X = np.concatenate(list(sampled.columns(model)))
    weights = 1.0 / np.array(STD)
    rows = (X * weights[:, None]).reshape(-1, model.size)
    solve = np.linalg.pinv(rows)
    draws = []
    for seed in range(300):
        noise = np.array(STD) * np.random.default_rng(seed).normal(size=sampled.motion.q.shape)
        draws.append(solve @ (sampled.filtered(noise) * weights).ravel())
    true = np.var(draws, axis=0)
    colour, plain = [], []
    for seed in range(10):
        data = drawn(model, clean, None, 1000 + seed)
        colour.append(fit(model, data).sigma ** 2)
        plain.append(fit(model, data, LeastSquares(errors="independent")).sigma ** 2)
    assert np.mean(np.mean(colour, axis=0) / true) == pytest.approx(1.0, abs=0.12)
    assert np.mean(np.mean(plain, axis=0) / true) < 0.8


def test_the_filter_says_how_rows_hang_together(model: Model) -> None:
    """The measured autocorrelation is that of white noise behind the low-pass."""
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    clean = synthetic(model, truth, 5, rate_hz=200.0, duration=60.0, period=None)
    data = drawn(model, clean, None, 1)
    solution = solve_factors(model, factorise(di.fitting.rows(model, data)))
    found = row_errors(model, data, solution.values, solution)
    impulse = np.zeros((2001, 1))
    impulse[1000] = 1.0
    sampled = sample(data.recordings[0], None)
    spread = sampled.parallel.low_pass(impulse)[:, 0]
    step = sampled.parallel.factor
    want = np.array([spread[: 2001 - k * step] @ spread[k * step :] for k in range(6)])
    ours = found.autocovariance[:, :6] / np.array(STD)[:, None] ** 2
    np.testing.assert_allclose(ours, np.tile(want, (2, 1)), atol=0.05 * want[0])
    assert found.effective_rows < 0.8 * found.rows


def test_what_a_fit_leaves_of_a_gap_is_not_paired(model: Model) -> None:
    """Two recordings are as independent as they are apart: their order does not matter."""
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    pair = [synthetic(model, truth, s, rate_hz=200.0, torque_std=0.5) for s in (1, 2)]
    one, other = fit(model, Dataset(tuple(pair))), fit(model, Dataset(tuple(reversed(pair))))
    np.testing.assert_allclose(one.sigma, other.sigma, rtol=1e-6)


def test_scaling_torques_scales_sigma(model: Model) -> None:
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    data = synthetic(model, truth, 1, rate_hz=200.0, torque_std=0.5)
    loud = data.replace(tau=1e3 * data.tau)
    np.testing.assert_allclose(fit(model, loud).sigma, 1e3 * fit(model, data).sigma, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "there",
    [
        lab.Lab(torque_std=STD, seconds=5.0),
        lab.Lab(torque_std=STD, colour_s=0.05, rate_hz=500.0),
    ],
    ids=["short records", "slow noise"],
)
def test_intervals_cover_where_the_noise_of_the_motions_band_is_hard_to_know(
    there: lab.Lab,
) -> None:
    """Of 100 recordings of a foreign simulator; with even bands the slow noise has 0.86."""
    model = lab.model()
    found = [fit(model, one) for one in there.recordings(range(7200, 7300))]
    assert 0.93 <= covered(found, lab.truth(model)) <= 0.97


@pytest.fixture(scope="module")
def hundred() -> list[Recording]:
    return lab.Lab(torque_std=STD, rate_hz=500.0).recordings(range(7000, 7100))


@pytest.mark.slow
@pytest.mark.parametrize("settings", [None, Filter()], ids=["default filter", "no filter"])
def test_intervals_cover_what_they_say(hundred, settings: Filter | None) -> None:
    """Of 100 recordings of a foreign simulator; rows taken as independent: 0.87 and 0.86."""
    model = lab.model()
    data = [Dataset((one,), settings) for one in hundred]
    found = [fit(model, one) for one in data]
    assert 0.93 <= covered(found, lab.truth(model)) <= 0.97
    independent = LeastSquares(errors="independent")
    assert covered([independent.fit(model, one) for one in data], lab.truth(model)) < 0.91


def test_a_noise_free_fit_has_next_to_no_sigma(model: Model) -> None:
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    clean = synthetic(model, truth, 3, rate_hz=1000.0, duration=8.0, period=None)
    found = fit(model, Dataset((clean,), None, Noise(np.zeros(2), np.zeros(2))))
    assert np.all(found.sigma < 1e-3)


@pytest.mark.slow
def test_a_diagnosis_without_known_noise_has_the_intervals_of_the_same_fit(model: Model) -> None:
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    clean = synthetic(model, truth, 3, rate_hz=200.0, duration=16.0, period=None)
    other = synthetic(model, truth, 4, rate_hz=200.0, duration=16.0, period=None)
    train, test = (drawn(model, one, None, k) for k, one in enumerate((clean, other)))
    estimate = fit(model, train)
    found = di.diagnose(estimate, train, test).after
    assert "as much as" in found.words_of_sigma
    np.testing.assert_allclose(found.sigma[:6], estimate.sigma[:6], rtol=0.1)
