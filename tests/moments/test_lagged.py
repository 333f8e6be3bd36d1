"""Products of rows with later ones, whatever the blocks that they come in."""

from __future__ import annotations

import itertools

import numpy as np

from dynident.moments.lagged import LaggedColumns, lagged_products


def test_blocks_do_not_matter_and_stretches_do() -> None:
    rng = np.random.default_rng(0)
    X, e = rng.normal(size=(50, 2, 3)), rng.normal(size=(50, 2))
    cuts = [0, 1, 3, 20, 21, 22, 50]
    begins = {0, 20}
    counts = rng.random((50, 2)) < 0.8
    blocks = [(a in begins, X[a:b], e[a:b], counts[a:b]) for a, b in itertools.pairwise(cuts)]
    found = lagged_products(blocks, 4)
    X, e = X * counts[:, :, None], e * counts
    for k in range(5):
        pairs = [t for t in range(50 - k) if (t < 20) == (t + k < 20)]
        both = np.sum([counts[t] & counts[t + k] for t in pairs], axis=0)
        np.testing.assert_array_equal(found.pairs[:, k], both)
        columns = sum(np.einsum("ja,jb->jab", X[t], X[t + k]) for t in pairs)
        np.testing.assert_allclose(found.columns[:, k], columns, atol=1e-12)
        np.testing.assert_allclose(
            found.residual[:, k], sum(e[t] * e[t + k] for t in pairs), atol=1e-12
        )


def test_a_stretch_in_which_no_row_of_a_joint_counts_adds_nothing() -> None:
    rng = np.random.default_rng(2)
    X = rng.normal(size=(400, 2, 3))
    X[:, 1] = 0.0
    found = LaggedColumns(4)
    for start in (0, 200):
        found.add(start, X[start : start + 200])
    assert not found.columns[1].any() and found.columns[0].any()


def test_some_rows_say_what_all_do_whatever_the_blocks() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(20000) / 50.0
    X = np.stack([np.sin(t + p)[:, None] * np.cos(0.3 * t + p)[:, None] for p in range(3)], axis=2)
    X = X + 0.1 * rng.normal(size=X.shape)
    every, some, again = LaggedColumns(4), LaggedColumns(4, 0.25), LaggedColumns(4, 0.25)
    for one, cuts in ((every, [0, 20000]), (some, [0, 20000]), (again, [0, 7, 3000, 3001, 20000])):
        for a, b in itertools.pairwise(cuts):
            one.add(a, X[a:b])
    np.testing.assert_allclose(again.columns, some.columns, rtol=1e-12)
    np.testing.assert_array_equal(again.pairs, some.pairs)
    assert every.complete and not some.complete
    np.testing.assert_array_equal(every.pairs, 20000 - np.arange(5))
    assert 0.2 < some.pairs[0] / every.pairs[0] < 0.3
    mean, like = (one.columns / one.pairs[:, None, None] for one in (every, some))
    np.testing.assert_allclose(like, mean, atol=0.1 * np.abs(mean).max())


def test_every_lag_of_a_long_stretch_keeps_the_digits_of_its_columns() -> None:
    """Rows of many windows; columns as far apart in size as masses and inertias."""
    rng = np.random.default_rng(2)
    T, lags = 1000, 12
    X = np.cumsum(rng.normal(size=(T, 1, 3)), axis=0) * np.array([1.0, 1e-6, 1e5])
    counts = np.ones((T, 1), dtype=bool)
    found = lagged_products([(True, X, X[:, :, 0], counts)], lags).columns[0]
    sizes = np.linalg.norm(X[:, 0], axis=0)
    for k in range(lags + 1):
        direct = X[: T - k, 0].T @ X[k:, 0]
        np.testing.assert_array_less(np.abs(found[k] - direct), 1e-14 * np.outer(sizes, sizes))
