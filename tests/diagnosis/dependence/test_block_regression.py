"""A held-out block predicted from the inverse of the whole, against a fit without it."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.dependence.block_regression import centred, kernel, left_of_each_unit
from dynident.diagnosis.dependence.motion_blocks import HeldOutUnit
from dynident.errors import FitError


def test_what_is_left_of_a_block_is_that_of_a_fit_to_all_rows_that_are_not_left_out() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(60, 2)), rng.normal(size=60)
    similarity = 3.0 * kernel(x)
    units = [
        HeldOutUnit(np.arange(k, k + 20), np.arange(max(k - 4, 0), min(k + 24, 60)))
        for k in (0, 20, 40)
    ]
    found = left_of_each_unit(similarity, y, units)
    for unit in units:
        learnt = np.setdiff1d(np.arange(60), unit.left_out)
        inner = similarity[np.ix_(learnt, learnt)] + np.eye(len(learnt))
        predicted = similarity[np.ix_(unit.rows, learnt)] @ np.linalg.solve(inner, y[learnt])
        assert found[unit.rows] == pytest.approx(y[unit.rows] - predicted, abs=1e-10)


def test_functions_of_a_centred_kernel_have_no_mean() -> None:
    x = np.random.default_rng(1).normal(size=(30, 1))
    assert centred(kernel(x)).sum(axis=0) == pytest.approx(np.zeros(30), abs=1e-12)


def test_a_constant_input_has_no_kernel() -> None:
    assert not centred(kernel(np.zeros((30, 1)))).any()


def test_a_kernel_that_is_none_is_refused() -> None:
    units = [HeldOutUnit(np.arange(5), np.arange(5))]
    with pytest.raises(FitError, match="singular"):
        left_of_each_unit(np.full((5, 5), -2.0), np.ones(5), units)
