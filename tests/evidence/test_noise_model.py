"""The noise model on series of known noise: it scales as they do and forgets their order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from dynident.criteria import NoiseCriteria
from dynident.evidence.noise_model import (
    NoiseModel,
    SpeedClasses,
    differences,
    flat_noise,
    inflation,
    measure_noise,
    systematic_square,
)

CRITERIA = NoiseCriteria()
SAMPLES = 4000


def coloured(memory: float, seed: int, count: int = SAMPLES) -> np.ndarray:
    """First-order autoregressive noise of variance one."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=count + 500) * np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], white))[500:]


def speed(count: int = SAMPLES) -> np.ndarray:
    return np.sin(np.arange(count) / 40.0)


def white_after(noise: np.ndarray, probe: np.ndarray) -> np.ndarray:
    model = measure_noise([noise], SpeedClasses.of([speed(len(noise))], CRITERIA), CRITERIA)
    return model.whiten(probe[:, None], speed(len(probe)))[CRITERIA.order :, 0]


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_what_was_measured_whitens_other_noise_of_its_kind(memory: float) -> None:
    white = white_after(coloured(memory, 0), coloured(memory, 1))
    assert np.mean(white**2) == pytest.approx(1.0, rel=0.15)
    for lag in (1, 2, 5):
        assert abs(np.corrcoef(white[lag:], white[:-lag])[0, 1]) < 0.08


@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e6])
def test_units_do_not_matter(factor: float) -> None:
    noise, probe = coloured(0.6, 2), coloured(0.6, 3)
    scaled = white_after(factor * noise, factor * probe)
    assert scaled == pytest.approx(white_after(noise, probe), rel=1e-9)


def test_the_sign_of_the_noise_and_of_the_speed_do_not_matter() -> None:
    noise = coloured(0.6, 4)
    one = measure_noise([noise], SpeedClasses.of([speed()], CRITERIA), CRITERIA)
    other = measure_noise([-noise], SpeedClasses.of([-speed()], CRITERIA), CRITERIA)
    assert other.std == one.std
    assert np.array_equal(other.colour, one.colour)
    assert np.array_equal(other.scales, one.scales)


def test_stretches_in_any_order_say_the_same() -> None:
    parts = [coloured(0.6, seed, 1000) for seed in range(4)]
    speeds = [speed(1000) * (k + 1) for k in range(4)]
    one = measure_noise(parts, SpeedClasses.of(speeds, CRITERIA), CRITERIA)
    other = measure_noise(parts[::-1], SpeedClasses.of(speeds[::-1], CRITERIA), CRITERIA)
    assert other.std == pytest.approx(one.std, rel=1e-12)
    assert other.colour == pytest.approx(one.colour, rel=1e-9)
    assert other.scales == pytest.approx(one.scales, rel=1e-9)


def test_noise_that_grows_at_rest_is_seen_where_it_does() -> None:
    rng = np.random.default_rng(5)
    v = speed()
    local = np.where(np.abs(v) < 0.2, 3.0, 1.0)
    model = measure_noise(
        [local * rng.normal(size=SAMPLES)], SpeedClasses.of([v], CRITERIA), CRITERIA
    )
    at_rest, moving = np.interp([0.05, 0.8], model.speeds, model.scales) * model.std
    assert at_rest == pytest.approx(3.0, rel=0.15)
    assert moving == pytest.approx(1.0, rel=0.15)


def test_scales_stay_within_their_limits() -> None:
    v = speed()
    local = np.where(np.abs(v) < 0.05, 1000.0, 1.0)
    noise = local * np.random.default_rng(6).normal(size=SAMPLES)
    model = measure_noise([noise], SpeedClasses.of([v], CRITERIA), CRITERIA)
    assert np.all(model.scales >= CRITERIA.least_scale)
    assert np.all(model.scales <= CRITERIA.largest_scale)


@pytest.mark.parametrize("misfit", [0.0, 2.5])
def test_no_noise_is_flat_noise_of_the_size_of_what_is_missing(misfit: float) -> None:
    model = measure_noise(
        [np.zeros(100)], SpeedClasses.of([speed(100)], CRITERIA), CRITERIA, misfit
    )
    flat = flat_noise(misfit or 1.0)
    probe = np.arange(20.0)[:, None]
    assert np.array_equal(model.whiten(probe, speed(20)), flat.whiten(probe, speed(20)))


def test_flat_noise_divides_by_its_size() -> None:
    probe = np.random.default_rng(7).normal(size=(50, 3))
    assert flat_noise(4.0).whiten(probe, speed(50)) == pytest.approx(probe / 4.0)


def test_whitening_is_linear_and_column_by_column() -> None:
    model = measure_noise([coloured(0.7, 8)], SpeedClasses.of([speed()], CRITERIA), CRITERIA)
    one, two = np.random.default_rng(9).normal(size=(2, 200, 2))
    v = speed(200)
    together = model.whiten(2.0 * one - two, v)
    assert together == pytest.approx(2.0 * model.whiten(one, v) - model.whiten(two, v))
    assert model.whiten(one[:, 1:], v)[:, 0] == pytest.approx(model.whiten(one, v)[:, 1])


def test_after_a_gap_noise_is_whitened_by_what_has_come_since() -> None:
    """Exactly: within a stretch the whitened noise has the unit matrix as its covariance.

    Of noise that is far larger than its innovations, the first row after a gap would otherwise
    outweigh all others.
    """
    poles = np.array([0.95, 0.9 * np.exp(0.5j), 0.9 * np.exp(-0.5j), 0.4])
    colour = np.real(np.poly(poles))
    impulse = np.asarray(lfilter([1.0], colour, np.eye(1, 3000)[0]))
    covariance = [impulse[: 3000 - lag] @ impulse[lag:] for lag in range(90)]
    assert covariance[0] > 25.0
    noise = NoiseModel(1.0, np.zeros(1), np.ones(1), colour)
    told = np.ones((1, 90), dtype=bool)
    told[0, 30:42] = told[0, 60] = told[0, 63] = False
    weights = np.ones((1, 90))
    whitening = noise.whitened([[[np.eye(90)]]], weights, told)[0, 0].T
    found = whitening @ toeplitz(covariance) @ whitening.T
    for stretch in (slice(30), slice(42, 60), slice(61, 63), slice(64, 90)):
        np.testing.assert_allclose(found[stretch, stretch], np.eye(90)[stretch, stretch], atol=1e-9)
    assert not whitening[~told[0]].any() and not whitening[:, ~told[0]].any()
    whole = noise.whitened([[[np.eye(90)]]], weights)[0, 0].T
    np.testing.assert_allclose(whitening[46:60], whole[46:60], atol=1e-12)


@pytest.mark.parametrize("coloured_noise", [True, False])
def test_signals_without_samples_stay_without(coloured_noise: bool) -> None:
    model = measure_noise([coloured(0.7, 8)], SpeedClasses.of([speed()], CRITERIA), CRITERIA)
    assert len(model.colour) > 1
    found = (model if coloured_noise else flat_noise(2.0)).whiten(np.zeros((0, 3)), np.zeros(0))
    assert found.shape == (0, 3)


def test_few_samples_make_a_model_without_colour() -> None:
    model = measure_noise([coloured(0.9, 10, 12)], SpeedClasses.of([speed(12)], CRITERIA), CRITERIA)
    assert len(model.colour) == 1
    assert np.all(np.isfinite(model.whiten(np.ones((12, 1)), speed(12))))


@pytest.mark.parametrize("memory", [0.3, 0.6])
def test_a_mean_of_noise_with_memory_varies_more(memory: float) -> None:
    """(1 + r) / (1 - r) for a first-order autoregression, up to the lags that are summed."""
    noise = [coloured(memory, seed) for seed in range(5)]
    assert inflation(noise, CRITERIA) == pytest.approx((1 + memory) / (1 - memory), rel=0.2)
    squared = (1 + memory**2) / (1 - memory**2)
    assert inflation(noise, CRITERIA, power=2) == pytest.approx(squared, rel=0.2)


def test_a_mean_of_noise_never_varies_less_than_without_memory() -> None:
    assert inflation([coloured(-0.8, 0)], CRITERIA) == 1.0
    assert inflation([np.zeros(50)], CRITERIA) == 1.0


@pytest.mark.parametrize("kind", ["repeated", "noise_augmented"])
def test_what_replicates_share_is_no_noise_and_noise_is_not_shared(kind) -> None:
    rng = np.random.default_rng(11)
    shared = np.sin(np.arange(SAMPLES) / 3.0)
    measured = shared + 0.5 * rng.normal(size=SAMPLES)
    copies = 4
    if kind == "repeated":
        residual = shared + 0.5 * rng.normal(size=(copies, SAMPLES))
    else:
        more = measured + 0.5 * rng.normal(size=(copies, SAMPLES))
        residual = np.concatenate([measured[None], more])
    assert systematic_square(residual, kind) == pytest.approx(0.5, rel=0.1)
    assert np.var(differences(residual, kind)) == pytest.approx(0.25, rel=0.1)
    exact = np.tile(shared, (copies, 1))
    assert differences(exact, kind) == pytest.approx(np.zeros_like(differences(exact, kind)))
    assert systematic_square(exact, kind) == pytest.approx(np.mean(shared**2))
