"""Signals between their samples, beside SciPy's splines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dynident.effects.transmissions.finer import finer


def signals(t: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(2 * np.pi * f * t + f) for f in (1.0, 3.0, 7.0)], axis=1)


@pytest.mark.parametrize("per", [1, 2, 5])
def test_they_are_those_of_a_cubic_spline(per: int) -> None:
    samples = signals(np.arange(2001) / 1000)
    found = finer(samples, per)
    at = np.arange(2000 * per + 1) / per
    expected = CubicSpline(np.arange(2001), samples)(at).T
    np.testing.assert_array_equal(found[:, ::per], samples.T)
    inner = slice(40 * per, -40 * per)
    np.testing.assert_allclose(found[:, inner], expected[:, inner], atol=1e-12)
    # At the ends both go on as a cubic does, SciPy's through other samples.
    np.testing.assert_allclose(found, signals(at / 1000).T, atol=3e-7)
    assert found.flags.c_contiguous


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_few_samples_make_a_polynomial(count: int) -> None:
    t = np.arange(count, dtype=float)
    degree = min(count - 1, 3)
    found = finer(np.stack([t**degree, 1.0 - t], axis=1), 4)
    fine = np.arange(4 * (count - 1) + 1) / 4
    np.testing.assert_allclose(found, [fine**degree, 1.0 - fine], atol=1e-9)
