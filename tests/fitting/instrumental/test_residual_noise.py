"""Noise measured where a loop feeds the encoders' noise back, against what it truly is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
import two_link_loop as lab
from dynident.fitting.instrumental import estimate_assembly
from dynident.fitting.instrumental.noise_level import noise_level, position_noise
from dynident.fitting.instrumental.residual_spectrum import NoiseVariances, residual_noise
from dynident.recording import Dataset, Filter

POSITION, TORQUE = 1e-5, (0.4, 0.2)
LOOP = lab.Lab(seconds=5.0, position_std=POSITION, torque_std=TORQUE)
METHOD = di.IV(lab.controller(), start="description")


@pytest.mark.parametrize("settings", [Filter(), None], ids=["no filter", "default filter"])
def test_the_loop_has_no_part_in_the_noise_of_the_residual(settings: Filter | None) -> None:
    (one,) = LOOP.recordings(range(1))
    found = METHOD.iterated(lab.model(), Dataset((one,), settings))
    rough = position_noise(found.source, found.instruments)
    measured = residual_noise(
        found.model,
        found.values,
        found.source.measured,
        found.instruments,
        rough,
        found.solution.rank,
    )
    std = np.sqrt(measured.values)
    np.testing.assert_allclose(std[:2], POSITION, rtol=0.15)
    np.testing.assert_allclose(std[2:], TORQUE, rtol=0.25)
    # What the measured positions differ by from the simulated ones has the loop's answer in it.
    assert rough[1] > 1.05 * POSITION


@pytest.mark.slow
def test_a_negative_variance_is_said_and_never_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    joints = ("shoulder", "elbow")
    values, std = np.array([1e-10, 1e-10, 0.1, -0.5]), np.array([1e-12, 1e-12, 0.01, 0.1])
    found = noise_level(joints, NoiseVariances(values=values, std=std))
    assert "negative at the torque of elbow" in found.doubt and np.all(found.torque_std > 0)
    # Zero within its standard error: there may be as much as that.
    near = noise_level(joints, NoiseVariances(values=values, std=np.append(std[:3], 0.4)))
    assert not near.doubt and near.torque_std[1] == pytest.approx(np.sqrt(0.4))

    (one,) = LOOP.recordings(range(1))
    data, method = Dataset((one,), Filter()), METHOD
    trusted = di.fit(lab.model(), data, method)
    original = estimate_assembly.noise_level
    monkeypatch.setattr(
        estimate_assembly, "noise_level", lambda *args: replace(original(*args), doubt="no noise")
    )
    doubted = di.fit(lab.model(), data, method)
    assert "could not be measured: no noise" in doubted.summary()
    assert "scatter between blocks" in doubted.words_of_sigma
    np.testing.assert_array_equal(doubted.values, trusted.values)
    ratio = doubted.sigma / trusted.sigma
    assert 0.5 < np.exp(np.mean(np.log(ratio))) < 2.0


@pytest.mark.slow
def test_intervals_cover_what_they_say_without_given_noise() -> None:
    """Of inertial parameters; with the rest of a residual as torque noise they covered 0.2."""
    model, inside = lab.model(), []
    truth, part = lab.truth(model), slice(0, model.base.rank)
    for one in LOOP.recordings(range(7100, 7130)):
        found = di.fit(model, Dataset((one,), Filter()), METHOD)
        inside.append((np.abs(found.values - truth) < 1.96 * found.sigma)[part])
    assert 0.89 <= np.mean(inside) <= 0.99
