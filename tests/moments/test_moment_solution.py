"""The quick solution of a regression on second moments is that of its directions."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import regress, regression_values
from row_moments import row_moments

RELIABLE = 0.05


def moments(noise: float, dependence: float) -> SecondMoments:
    """Moments of six columns and their output in three repetitions, of units far apart.

    The last column is the sum of two others but for a part of a size, and carries noise.
    """
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((400, 6))
    columns[:, 5] = columns[:, 0] - columns[:, 1] + dependence * columns[:, 5]
    columns *= 10.0 ** np.arange(-4.0, 8.0, 2.0)
    output = columns @ (np.arange(1.0, 7.0) / 10.0 ** np.arange(-4.0, 8.0, 2.0))
    rows = np.repeat(np.column_stack([columns, output])[None], 3, axis=0)
    rows[:, :, 5] += noise * 1e6 * rng.standard_normal(rows.shape[:2])
    rows[:, :, 6] += 0.1 * rng.standard_normal(rows.shape[:2])
    return row_moments(rows, rows, np.array([0, 400]), "repeated").pooled()


@pytest.mark.parametrize("dependence", [1.0, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0])
@pytest.mark.parametrize("noise", [0.0, 0.3, 30.0])
def test_values_are_those_of_the_directions(noise: float, dependence: float) -> None:
    """Also where a direction is left out: one that depends on others, or is noise."""
    made = moments(noise, dependence)
    whole = regress(made, RELIABLE)
    deviations = np.sqrt(np.diag(whole.covariance)) * 0.1
    apart = regression_values(made, RELIABLE) - whole.values
    assert np.all(np.abs(apart) <= 1e-8 * deviations)


def test_the_cases_leave_out_what_they_should() -> None:
    ranks = {key: regress(moments(*key), RELIABLE).rank for key in [(0, 1), (0, 0), (30, 1)]}
    assert ranks == {(0, 1): 6, (0, 0): 5, (30, 1): 5}


def test_columns_of_zeros_have_no_value() -> None:
    made = moments(0.0, 1.0)
    empty = np.ones(7)
    empty[2] = 0.0
    made = made.scaled(empty)
    values = regression_values(made, RELIABLE)
    assert abs(values[2]) < 1e-9
    np.testing.assert_allclose(values, regress(made, RELIABLE).values, atol=1e-12)
