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


def made() -> Trials:
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
        plain.append(LeastSquares(errors="independent").fit(model, dataset).values)
        values.append(found.values)
        sigma.append(found.sigma)
    part = slice(0, model.base.rank)
    truth = loops.truth(model)
    return Trials(truth, part, np.array(plain), np.array(values), np.array(sigma))


def rms(values: np.ndarray, trials: Trials) -> np.ndarray:
    return np.sqrt(np.mean(((values - trials.truth)[:, trials.inertial]) ** 2, axis=0))


# One test of all that the trials show: they take most of its time.
@pytest.mark.slow
def test_errors_are_a_tenth_of_those_of_least_squares_and_intervals_cover_what_they_say():
    """Where no noise is stated it is measured: a little too much, for the loop reacts to it."""
    trials = made()
    assert len(trials.values) == SEEDS
    assert np.all(rms(trials.values, trials) < rms(trials.least_squares, trials) / 10)
    inside = np.abs(trials.values - trials.truth) < 1.96 * trials.sigma
    assert 0.92 < np.mean(inside) < 0.98
    # One parameter alone: 0.95 within 3 standard errors of 200 draws.
    assert np.all(np.mean(inside, axis=0) > 0.90)
    (one,) = loops.experiment(0, STD, seconds=5.0).run()
    measured = IV(loops.LOOP, start="description").fit(
        loops.model(coulomb=False), Dataset((one,), Filter())
    )
    ratio = measured.sigma / trials.sigma.mean(axis=0)
    assert np.all(ratio > 0.95) and np.all(ratio < 1.25)
