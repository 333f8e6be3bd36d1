"""Moments from replicates: what noise does to squares, it does not do to products."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.moments.replicates import TimeVarying, time_varying_products
from dynident.moments.solution import regress
from row_moments import row_moments

RELIABLE = DEFAULTS.noise.reliable
RNG = np.random.default_rng(11)


def repeated(signal: np.ndarray, replicates: int, std: float, rng) -> np.ndarray:
    return signal + std * rng.normal(size=(replicates, *signal.shape))


@pytest.mark.parametrize("replicates", [2, 3, 5])
def test_signal_moments_are_free_of_noise_in_the_mean(replicates: int) -> None:
    signal = RNG.normal(size=(60, 3))
    edges = np.array([0, 20, 60])
    total = np.zeros((3, 3))
    trials = 2000
    for _ in range(trials):
        noisy = repeated(signal, replicates, 0.5, RNG)
        total += row_moments(noisy, noisy, edges, "repeated").signal.sum(axis=0)
    expected = replicates * signal.T @ signal
    # One trial's standard deviation is about 0.5 * 2 * sqrt(60) * versions at most.
    tolerance = 5 * 8.0 * replicates / np.sqrt(trials)
    assert np.allclose(total / trials, expected, atol=tolerance)


def test_moments_of_noisy_copies_are_corrected_in_the_mean() -> None:
    signal = RNG.normal(size=(80, 2))
    total = np.zeros((2, 2))
    trials = 1500
    for _ in range(trials):
        measured = signal + 0.5 * RNG.normal(size=signal.shape)
        copies = np.stack([measured, *(measured + 0.5 * RNG.normal(size=(3, 80, 2)))])
        total += row_moments(copies, copies, np.array([0, 80]), "noise_augmented").signal[0]
    assert np.allclose(total / trials, signal.T @ signal, atol=5 * 12.0 / np.sqrt(trials))


def test_blocks_add_up_and_the_moments_are_symmetric() -> None:
    data = RNG.normal(size=(3, 40, 4))
    whole = row_moments(data, data, np.array([0, 40]), "repeated")
    parts = row_moments(data, data, np.array([0, 7, 29, 40]), "repeated")
    assert np.allclose(whole.signal[0], parts.signal.sum(axis=0))
    assert np.allclose(whole.signal, whole.signal.transpose(0, 2, 1))
    assert np.allclose(whole.total[0], data.reshape(-1, 4).T @ data.reshape(-1, 4))


def test_instruments_do_not_shrink_what_least_squares_shrinks() -> None:
    """Noisy columns: least squares attenuates by 1 / (1 + noise), the signal moments do not."""
    truth = np.array([1.0, -2.0])
    found, plain = [], []
    for _ in range(200):
        clean = RNG.normal(size=(200, 2))
        columns = repeated(clean, 2, 0.7, RNG)
        torque = np.repeat((clean @ truth)[None, :, None], 2, axis=0)
        data = np.concatenate([columns, torque], axis=2)
        summed = row_moments(data, data, np.array([0, 200]), "repeated")
        pooled = summed.pooled()
        found.append(regress(pooled, RELIABLE).values)
        plain.append(np.linalg.solve(pooled.gram, pooled.cross))
    assert np.allclose(np.mean(found, axis=0), truth, atol=0.05)
    assert np.allclose(np.mean(plain, axis=0), truth / 1.49, atol=0.05)


def test_directions_without_signal_are_left_out() -> None:
    clean = RNG.normal(size=(300, 1))
    columns = np.stack([np.hstack([clean, RNG.normal(size=(300, 1))]) for _ in range(2)])
    torque = np.repeat(3.0 * clean[None], 2, axis=0)
    data = np.concatenate([columns, torque], axis=2)
    solution = regress(row_moments(data, data, np.array([0, 300]), "repeated").pooled(), RELIABLE)
    assert solution.rank == 1
    assert np.allclose(solution.values, [3.0, 0.0], atol=0.1)


def test_dependent_columns_get_the_smallest_answer_and_no_explosion() -> None:
    clean = RNG.normal(size=(2, 300, 1))
    data = np.concatenate([clean, 2 * clean, 5 * clean], axis=2)
    solution = regress(row_moments(data, data, np.array([0, 300]), "single").pooled(), RELIABLE)
    assert solution.rank == 1
    assert np.allclose(solution.values @ [1.0, 2.0], 5.0)


def test_products_of_each_group_are_those_of_all_that_are_its_own() -> None:
    count, groups, width = 60, 4, 3
    shape = (2, 3, count, groups * width)
    both = RNG.normal(size=shape), RNG.normal(size=shape)
    columns = TimeVarying(*both, np.zeros(groups * width, dtype=bool))
    edges = np.array([0, 13, 30, count])
    every = time_varying_products(columns, columns, edges)
    found = columns.products_of_each(width, edges)
    assert found.shape == (len(every), groups, width, width)
    for k in range(groups):
        own = slice(k * width, (k + 1) * width)
        np.testing.assert_allclose(found[:, k], every[:, own, own], atol=1e-12)
