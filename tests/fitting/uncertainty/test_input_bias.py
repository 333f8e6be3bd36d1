"""Noise of the positions in least squares: the bias that is foretold, and what is said of it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import carriage
import two_link_loop as lab
from dynident.fitting import Estimate, LeastSquares, fit, sample
from dynident.fitting.uncertainty.input_bias import InputBias, input_bias
from dynident.fitting.uncertainty.trembling import trembling
from dynident.model import Model
from dynident.recording import Dataset, Filter, Noise, Recording, default_filter, lowpass
from dynident.recording.white_noise import encoder_noise_std
from synthetic import arm, synthetic

TORQUE = (2.0, 0.8)
NOISY, HEALTHY, LOUD, LOUDER = 1e-5, 1e-5, 1e-4, 2e-4


@lru_cache
def recorded(std: float, seeds: range = range(40, 41), seconds: float = 6.0) -> list[Recording]:
    return lab.Lab(torque_std=TORQUE, position_std=std, seconds=seconds).recordings(seeds)


def foretold(data: Dataset) -> tuple[Estimate, InputBias]:
    """The estimate with sigma of the noise alone, and the bias."""
    model = lab.model()
    found, solution = LeastSquares(errors="independent").without_bias(model, data)
    bias = input_bias(model, data, found.values, solution, found.sigma)
    assert bias is not None
    return found, bias


def test_raw_derivatives_of_noisy_positions_are_said_in_the_first_line() -> None:
    (one,) = recorded(NOISY)
    found = fit(lab.model(), Dataset((one,), Filter()))
    assert found.summary().startswith("Noise in the positions biases this fit")
    for words in ("Izz.upper", "no 95 % intervals", "position_cutoff_hz", "--method iv"):
        assert words in found.headline
    assert any(note.startswith("Expected bias") for note in found.notes)


@pytest.mark.parametrize("settings", [None, Filter()], ids=["default filter", "no filter"])
def test_nothing_is_said_where_there_is_no_reason(settings: Filter | None) -> None:
    """Noise behind the default filter, and no noise without any."""
    (one,) = recorded(HEALTHY if settings is None else 0.0)
    found = fit(lab.model(), Dataset((one,), settings))
    assert not found.headline
    assert not any("bias" in note for note in found.notes)


def test_a_robot_that_follows_its_encoders_is_told_from_noise_in_the_columns() -> None:
    """No filter of the record mends it, and none is advised.

    What blunted friction leaves is as slow as the motion, so that sigma holds some of it: of less
    noise the bias is a note.
    """
    (less,), (one,) = recorded(LOUDER), recorded(2 * LOUDER)
    noted = fit(lab.model(), less)
    assert not noted.headline and any("Fc@elbow" in note for note in noted.notes)
    found = fit(lab.model(), one)
    assert found.headline.startswith("The robot trembles")
    assert "Fc@elbow" in found.headline and "position_cutoff_hz" not in found.headline


@pytest.mark.slow
def test_a_low_pass_that_hides_the_motion_is_not_called_a_trembling_robot() -> None:
    """Of a carriage whose encoder has no noise, and of one that trembles, a low-pass lower too."""
    data = carriage.recorded(0.5, 0.05, 0)
    low = replace(data, filter=Filter(position_cutoff_hz=2.0, cutoff_hz=18.0, ends="keep"))
    found = fit(carriage.model(), low)
    assert found.headline.startswith("The low-pass of the positions hides motion")
    assert "leave position_cutoff_hz = 2 out of [filter]; 80 Hz suits" in found.headline
    (one,) = recorded(2 * LOUDER)
    lower = replace(default_filter(lab.RATE), position_cutoff_hz=30.0)
    assert fit(lab.model(), Dataset((one,), lower)).headline.startswith("The robot trembles")


def test_the_trembling_is_that_of_the_true_motion() -> None:
    (one,) = recorded(LOUDER)
    rng = np.random.default_rng([40, 15])
    rng.normal(size=(2, 2, 5))
    noise = LOUDER * rng.normal(size=(round(6.5 * lab.RATE) + 1, 2))
    true = np.diff(one.q - noise[-one.samples :], axis=0) * lab.RATE
    true -= lowpass(true, lab.RATE, 40.0)
    model = lab.model()
    found = trembling(model, lab.truth(model), one, 40.0).between(0.5)[:-1]
    left = np.std(found - true, axis=0) / np.std(true, axis=0)
    assert np.all(left < 0.2), left


@pytest.mark.parametrize("heavy", [1.0, 1e-6])
def test_noise_of_a_torque_is_no_trembling_however_small_the_inertia(heavy: float) -> None:
    """A drive that does not feel the encoders: what of its torque follows them is chance."""
    model, rng = Model(arm()), np.random.default_rng(4)
    one = synthetic(model, model.given_values(), rate_hz=200.0, duration=6.0, period=None)
    read = one.q + 1e-5 * rng.normal(size=one.q.shape)
    one = one.replace(q=read, tau=one.tau + 0.05 * rng.normal(size=one.tau.shape))
    assert not trembling(model, heavy * model.given_values(), one, 25.0).q.any()
    follows = one.replace(tau=one.tau - 2e4 * (read - lowpass(read, one.rate_hz, 25.0)))
    assert trembling(model, heavy * model.given_values(), follows, 25.0).q.any()


def test_the_size_of_the_noise_is_found_beside_motion_and_jumps() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(6000) / 500.0
    q = np.stack([np.sin(9.0 * t), np.abs(np.sin(2.0 * t)) * np.sin(2.0 * t)], axis=1)
    std = np.array([1e-5, 3e-4])
    found = encoder_noise_std(q + std * rng.normal(size=q.shape))
    np.testing.assert_allclose(found, std, rtol=0.08)
    assert np.all(encoder_noise_std(q) < 1e-9)


def test_stated_noise_counts_instead_of_measured_noise() -> None:
    (one,) = recorded(1e-6)
    few = Noise(np.full(2, 1e-8), np.array(TORQUE))
    assert fit(lab.model(), Dataset((one,), Filter())).headline
    assert not fit(lab.model(), Dataset((one,), Filter(), few)).headline


def test_the_bias_grows_with_the_variance_of_the_noise() -> None:
    (one,) = recorded(0.0)
    found = []
    for std in (1e-7, 2e-7):
        noise = Noise(np.full(2, std), np.array(TORQUE))
        found.append(foretold(Dataset((one,), Filter(), noise))[1].values)
    inertial = slice(0, 6)
    np.testing.assert_allclose(found[1][inertial], 4.0 * found[0][inertial], rtol=0.1)


@pytest.mark.slow
def test_a_part_of_a_long_recording_foretells_the_same() -> None:
    """Along the samples that are looked at at most, against twice as many."""
    (one,) = recorded(1e-6, seconds=40.0)
    assert sample(one, Filter()).motion.samples > 2 * 16384
    whole = foretold(Dataset((one,), Filter()))[1].values
    halves = [one.replace(window=limits) for limits in ((0.0, 20.0), (20.0, 40.0))]
    both = [foretold(Dataset((half,), Filter()))[1].values for half in halves]
    inertia = lab.model().names.index("Izz.upper")
    assert whole[inertia] == pytest.approx(np.mean(both, axis=0)[inertia], rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("std", "settings", "names"),
    [(1e-6, Filter(), ("Izz.upper", "Izz.fore")), (LOUD, None, ("Fv@elbow", "Fc@elbow"))],
    ids=["raw", "loop"],
)
def test_the_bias_is_that_of_many_recordings_and_intervals_hold_it(
    std: float, settings: Filter | None, names: tuple[str, ...]
) -> None:
    """Of forty recordings; without the bias 0.5 and 0.8 of the truth is inside."""
    model = lab.model()
    truth, errors, said, inside, without = lab.truth(model), [], [], [], []
    for one in recorded(std, range(3100, 3140), 12.0):
        data = Dataset((one,), settings)
        plain, bias = foretold(data)
        errors.append(plain.values - truth)
        said.append(bias.values)
        without.append(np.abs(plain.values - truth) < 1.96 * bias.sigma)
        found = fit(model, data)
        inside.append(np.abs(found.values - truth) < 1.96 * found.sigma)
    at = [model.names.index(name) for name in names]
    bias = np.mean(said, axis=0)[at]
    np.testing.assert_allclose(bias, np.mean(errors, axis=0)[at], rtol=0.4)
    assert np.mean(inside) >= 0.93, np.mean(inside)
    assert np.mean(without) < 0.85, np.mean(without)
