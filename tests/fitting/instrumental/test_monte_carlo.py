"""200 noisy recordings in closed loop, no filter: errors and intervals of instruments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import loops
from dynident.fitting import IV, LeastSquares
from dynident.recording import Dataset, Filter, Noise

SEEDS = 200
STD = 3e-5


@dataclass(frozen=True)
class Trials:
    truth: np.ndarray
    inertial: slice
    least_squares: np.ndarray
    values: np.ndarray
    sigma: np.ndarray


@pytest.fixture(scope="module")
def trials() -> Trials:
    model = loops.model(coulomb=False)
    # Eight at a time side by side in one plant, each with noise of its own.
    recordings = [
        one
        for seed in range(SEEDS // 8)
        for one in loops.experiment(seed, STD, seconds=5.0, motions=8).run()
    ]
    noise = Noise(np.full(2, STD), np.full(2, 1e-9))
    plain, values, sigma = [], [], []
    for one in recordings:
        dataset = Dataset((one,), Filter(), noise)
        found = IV(loops.LOOP, start="description").fit(model, dataset)
        plain.append(LeastSquares().fit(model, dataset).values)
        values.append(found.values)
        sigma.append(found.sigma)
    part = slice(0, model.base.rank)
    truth = loops.truth(model)
    return Trials(truth, part, np.array(plain), np.array(values), np.array(sigma))


@pytest.mark.slow
def test_errors_are_a_tenth_of_those_of_least_squares(trials):
    def rms(values):
        return np.sqrt(np.mean(((values - trials.truth)[:, trials.inertial]) ** 2, axis=0))

    assert len(trials.values) == SEEDS
    assert np.all(rms(trials.values) < rms(trials.least_squares) / 10)


@pytest.mark.slow
def test_intervals_cover_what_they_say(trials):
    inside = np.abs(trials.values - trials.truth) < 1.96 * trials.sigma
    assert 0.92 < np.mean(inside) < 0.98
    # One parameter alone: 0.95 within 3 standard errors of 200 draws.
    assert np.all(np.mean(inside, axis=0) > 0.90)


@pytest.mark.slow
def test_measured_noise_gives_intervals_as_wide(trials):
    """Where no noise is stated it is measured: a little too much, for the loop reacts to it."""
    model = loops.model(coulomb=False)
    (one,) = loops.experiment(0, STD, seconds=5.0).run()
    found = IV(loops.LOOP, start="description").fit(model, Dataset((one,), Filter()))
    ratio = found.sigma / trials.sigma.mean(axis=0)
    assert np.all(ratio > 0.95) and np.all(ratio < 1.25)
