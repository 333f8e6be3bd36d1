"""Sufficient statistics: those of blocks add up to those of all rows, whatever their offset."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from dynident.errors import FitError
from dynident.moments import SecondMoments


def data(seed: int = 0, rows: int = 500, inputs: int = 4) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.standard_normal((rows, inputs)) * [1, 2, 3, 4] + 5.0, rng.standard_normal(rows) - 2.0


def test_blocks_add_up() -> None:
    X, y = data()
    whole = SecondMoments.of(X, y)
    cuts = [0, 1, 2, 130, 131, 500]
    parts = SecondMoments.over((X[a:b], y[a:b]) for a, b in pairwise(cuts))
    assert parts.count == 500
    np.testing.assert_allclose(parts.centre, whole.centre, rtol=1e-13)
    np.testing.assert_allclose(parts.total, whole.total, rtol=1e-12, atol=1e-10)
    both = np.column_stack([X, y])
    np.testing.assert_allclose(whole.total / 499, np.cov(both.T), rtol=1e-12)


def test_a_large_offset_costs_no_digits() -> None:
    X, y = data()
    near = SecondMoments.of(X, y)
    far = SecondMoments.over((X[a : a + 50] + 1e6, y[a : a + 50] - 1e7) for a in range(0, 500, 50))
    np.testing.assert_allclose(far.total, near.total, rtol=1e-8, atol=1e-5)


def test_about_the_origin_is_plain_sums_of_products() -> None:
    X, y = data()
    raw = SecondMoments.of(X, y).about_origin()
    np.testing.assert_allclose(raw.gram, X.T @ X, rtol=1e-12)
    np.testing.assert_allclose(raw.cross, X.T @ y, rtol=1e-11)
    b = np.array([1.0, -1.0, 0.5, 0.0])
    assert raw.residual(b) == pytest.approx(np.sum((y - X @ b) ** 2))


def test_a_constant_has_no_scale_and_a_small_variation_has() -> None:
    X, y = data()
    X[:, 0], X[:, 1] = 0.1, 1e3 + 1e-6 * X[:, 1]
    parts = SecondMoments.over((X[a : a + 7], y[a : a + 7]) for a in range(0, 500, 7))
    assert parts.scale[0] == 0.0
    assert parts.scale[1] == pytest.approx(2e-6, rel=0.1)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda X, y: (X[:0], y[:0]), "shape"),
        (lambda X, y: (X, y[:-1]), "shape"),
        (lambda X, y: (X[0], y), "shape"),
        (lambda X, y: (np.where(X[3, 2] == X, np.nan, X), y), "input 2"),
        (lambda X, y: (X, np.where(y[7] == y, np.inf, y)), "the output"),
        (lambda X, y: (X * [1, 1e200, 1, 1], y), "input 1"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_no_data_is_refused(spoil, words: str) -> None:
    with pytest.raises(FitError, match=words):
        SecondMoments.of(*spoil(*data()))


def test_blocks_of_other_inputs_are_refused() -> None:
    X, y = data()
    with pytest.raises(FitError, match="3 inputs after 4"):
        SecondMoments.over([(X, y), (X[:, :3], y)])
    with pytest.raises(FitError, match="no rows"):
        SecondMoments.over([])


def blocks_of_time(seed: int) -> SecondMoments:
    rng = np.random.default_rng(seed)
    total, free = rng.standard_normal((2, 4, 3, 3))
    return SecondMoments(total, np.arange(1, 5), None, free)


def test_blocks_of_time_add_up_joint_by_joint_and_stand_side_by_side() -> None:
    one, two = blocks_of_time(0), blocks_of_time(1)
    both = one + two
    np.testing.assert_allclose(both.total, one.total + two.total)
    np.testing.assert_allclose(both.signal, one.signal + two.signal)
    assert both.count == 20
    beside = SecondMoments.stacked([one, two])
    assert beside.total.shape == (8, 3, 3) and beside.count == 20
    np.testing.assert_allclose(beside.pooled().signal, both.pooled().signal)
    np.testing.assert_allclose(
        list(beside.without_each())[5].total, beside.pooled().total - two.total[1], atol=1e-12
    )
    assert list(beside.without_each())[5].count == 18


def test_what_has_no_known_noise_counts_as_signal_beside_what_has() -> None:
    noisy, bare = blocks_of_time(0), SecondMoments(np.ones((2, 3, 3)), np.ones(2))
    assert bare.signal is bare.total
    beside = SecondMoments.stacked([noisy, bare])
    np.testing.assert_allclose(beside.signal[:4], noisy.signal)
    np.testing.assert_allclose(beside.signal[4:], bare.total)


def test_selections_weights_and_other_signals_go_through_both_kinds_of_products() -> None:
    one = blocks_of_time(2)
    part = one.among(np.array([0, 2]))
    np.testing.assert_allclose(part.signal, one.signal[:, [0, 2]][:, :, [0, 2]])
    np.testing.assert_allclose(one.columns(slice(1, 2)).total, one.total[:, :, 1:2])
    half = one.weighted(np.array([1.0, 0.0, 1.0, 0.0]))
    np.testing.assert_allclose(half.pooled().signal, one.signal[::2].sum(axis=0))
    other = one.with_signal(2.0 * one.signal)
    np.testing.assert_allclose(other.pooled().signal, 2.0 * one.pooled().signal)
    assert other.total is one.total
