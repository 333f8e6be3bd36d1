"""Least squares by truncated singular values: what the data do not excite stays at zero."""

from __future__ import annotations

import numpy as np

from dynident.regression.statistics import Statistics
from dynident.regression.statistics_regressor import StatisticsRegressor

_ROUNDING = 10.0 * np.finfo(float).eps


def squared_tolerance(unit: Statistics, rcond: float) -> float:
    """Share of the largest eigenvalue of X'X below which one is zero."""
    return max(rcond**2, _ROUNDING * max(unit.inputs, 1))


class TruncatedLeastSquares(StatisticsRegressor):
    """Ordinary least squares, by singular values of the standardised inputs down to a tolerance.

    Parameters
    ----------
    rcond : singular values below this share of the largest are taken as zero, and those that
        the rounding of sums of squares hides.
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    rank_ : directions kept.
    """

    words = "least squares by truncated singular values"

    def __init__(self, rcond: float = 1e-7, *, fit_intercept: bool = True) -> None:
        super().__init__(fit_intercept=fit_intercept)
        self.rcond = rcond

    def _solve(self, unit: Statistics, inputs: np.ndarray) -> None:
        self._require("rcond", 0.0, 0.5)
        values, vectors = np.linalg.eigh(unit.gram)
        kept = values > squared_tolerance(unit, self.rcond) * values.max(initial=0.0)
        self.rank_ = int(kept.sum())
        along = vectors[:, kept]
        self._set(self._in_units(along @ ((along.T @ unit.cross) / values[kept]), inputs))
