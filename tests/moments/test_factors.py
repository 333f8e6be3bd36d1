"""Triangular factors: the products of the rows without the rows, group by group."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from dynident.moments.factors import (
    TriangularFactors,
    combine,
    factorise,
    in_pieces,
    products_of,
)

RNG = np.random.default_rng(3)
COLUMNS = RNG.standard_normal((900, 2, 4))
TORQUE = COLUMNS @ [1.0, -2.0, 0.0, 3.0] + 0.1 * RNG.standard_normal((900, 2))


def rows(group: int) -> np.ndarray:
    return np.column_stack([COLUMNS[:, group], TORQUE[:, group]])


def blocks(*cuts: int) -> TriangularFactors:
    edges = [0, *cuts, 900]
    pairs = pairwise(edges)
    return factorise((COLUMNS[a:b], TORQUE[a:b]) for a, b in pairs)


@pytest.mark.parametrize("cuts", [(), (1,), (3, 500, 512)])
def test_factors_have_the_products_of_the_rows(cuts: tuple[int, ...]) -> None:
    found = blocks(*cuts)
    for j in range(2):
        np.testing.assert_allclose(found.R[j].T @ found.R[j], rows(j).T @ rows(j), rtol=1e-10)
    assert found.rows == 1800 and found.size == 4
    values = np.array([1.0, -2.0, 0.5, 3.0])
    left = np.linalg.norm(TORQUE - COLUMNS @ values, axis=0)
    np.testing.assert_allclose(found.residual_norms(values), left, rtol=1e-10)


def test_no_condition_number_is_squared() -> None:
    """Columns apart by 1e-10: their products cannot tell, the factor can."""
    one = RNG.standard_normal((500, 1))
    near = np.hstack([one, one + 1e-10 * RNG.standard_normal((500, 1))])
    R = factorise([(near[:, None], (near @ [1.0, 1.0])[:, None])]).R[0]
    exact = np.linalg.svd(near, compute_uv=False)[-1]
    assert np.linalg.svd(R[:2, :2], compute_uv=False)[-1] == pytest.approx(exact, rel=1e-4)


def test_parts_together_are_the_whole() -> None:
    whole = blocks()
    parts = [factorise([(COLUMNS[k::3], TORQUE[k::3])]) for k in range(3)]
    both = combine(parts)
    np.testing.assert_array_equal(both.counts, whole.counts)
    np.testing.assert_allclose(np.abs(both.R), np.abs(whole.R), atol=1e-10)
    weights = np.array([1.0, 0.5])
    pieces = in_pieces(parts, weights)
    assert pieces.R.shape == (3, 5, 5) and pieces.rows == whole.rows
    weighted = np.sum([w**2 * rows(j).T @ rows(j) for j, w in enumerate(weights)], axis=0)
    np.testing.assert_allclose(products_of(pieces).total, weighted, rtol=1e-10)
    kept = products_of(pieces.keeping([0, 3])).total
    np.testing.assert_allclose(kept, weighted[np.ix_([0, 3, 4], [0, 3, 4])], rtol=1e-10)


def test_instruments_stand_before_the_regressor() -> None:
    V = COLUMNS + 0.3 * RNG.standard_normal(COLUMNS.shape)
    found = factorise([(np.concatenate([V, COLUMNS], axis=2), TORQUE)], instruments=4)
    values = RNG.standard_normal(4)
    assert found.size == 4
    left = [np.linalg.norm(TORQUE - columns @ values, axis=0) for columns in (COLUMNS, V)]
    np.testing.assert_allclose(found.residual_norms(values), left[0], rtol=1e-10)
    np.testing.assert_allclose(found.simulated_norms(values), left[1], rtol=1e-10)
    relative = np.linalg.norm(left[0]) / np.linalg.norm(TORQUE)
    assert found.relative(left[0]) == pytest.approx(relative)


def test_nothing_has_no_factor() -> None:
    with pytest.raises(ValueError, match="no rows"):
        factorise([])
