"""Sufficient statistics: those of blocks add up to those of all rows, whatever their offset."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from dynident.errors import FitError
from dynident.regression.statistics import Statistics


def data(seed: int = 0, rows: int = 500, inputs: int = 4) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.standard_normal((rows, inputs)) * [1, 2, 3, 4] + 5.0, rng.standard_normal(rows) - 2.0


def test_blocks_add_up() -> None:
    X, y = data()
    whole = Statistics.of(X, y)
    cuts = [0, 1, 2, 130, 131, 500]
    parts = Statistics.over((X[a:b], y[a:b]) for a, b in pairwise(cuts))
    assert parts.count == 500
    np.testing.assert_allclose(parts.mean, whole.mean, rtol=1e-13)
    np.testing.assert_allclose(parts.scatter, whole.scatter, rtol=1e-12, atol=1e-10)
    both = np.column_stack([X, y])
    np.testing.assert_allclose(whole.scatter / 499, np.cov(both.T), rtol=1e-12)


def test_a_large_offset_costs_no_digits() -> None:
    X, y = data()
    near = Statistics.of(X, y)
    far = Statistics.over((X[a : a + 50] + 1e6, y[a : a + 50] - 1e7) for a in range(0, 500, 50))
    np.testing.assert_allclose(far.scatter, near.scatter, rtol=1e-8, atol=1e-5)


def test_about_the_origin_is_plain_sums_of_products() -> None:
    X, y = data()
    raw = Statistics.of(X, y).about_origin()
    np.testing.assert_allclose(raw.gram, X.T @ X, rtol=1e-12)
    np.testing.assert_allclose(raw.cross, X.T @ y, rtol=1e-11)
    b = np.array([1.0, -1.0, 0.5, 0.0])
    assert raw.residual(b) == pytest.approx(np.sum((y - X @ b) ** 2))


def test_a_constant_has_no_scale_and_a_small_variation_has() -> None:
    X, y = data()
    X[:, 0], X[:, 1] = 0.1, 1e3 + 1e-6 * X[:, 1]
    parts = Statistics.over((X[a : a + 7], y[a : a + 7]) for a in range(0, 500, 7))
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
        Statistics.of(*spoil(*data()))


def test_blocks_of_other_inputs_are_refused() -> None:
    X, y = data()
    with pytest.raises(FitError, match="3 inputs after 4"):
        Statistics.over([(X, y), (X[:, :3], y)])
    with pytest.raises(FitError, match="no rows"):
        Statistics.over([])
