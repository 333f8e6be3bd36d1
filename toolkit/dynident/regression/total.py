"""Total least squares: errors in the inputs as large as those of the output."""

from __future__ import annotations

import numpy as np

from dynident.errors import FitError
from dynident.moments import SecondMoments
from dynident.regression.ordinary import squared_tolerance
from dynident.regression.statistics_regressor import StatisticsRegressor

_NO_OUTPUT = 1e-8  # part of the output in the null direction, below which there is no solution


class TotalLeastSquares(StatisticsRegressor):
    """Total (orthogonal) least squares of the standardised inputs and output.

    Right where all of them have the same noise, relative to their spread, and wrong elsewhere.
    Van Huffel and Vandewalle, "The Total Least Squares Problem" (1991), with the truncation of its
    chapter 3 for dependent inputs.

    Parameters
    ----------
    rcond : as of `TruncatedLeastSquares`; directions below it belong to the null space.
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    rank_ : directions of the inputs kept.
    noise_share_ : variance of the noise of every column, relative to the column's own.
    """

    words = "total least squares"

    def __init__(self, rcond: float = 1e-7, *, fit_intercept: bool = True) -> None:
        super().__init__(fit_intercept=fit_intercept)
        self.rcond = rcond

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        self._require("rcond", 0.0, 0.5)
        spectrum = np.linalg.eigvalsh(unit.gram)
        self.rank_ = int(
            np.sum(spectrum > squared_tolerance(unit, self.rcond) * spectrum.max(initial=0.0))
        )
        values, vectors = np.linalg.eigh(unit.total)
        null = vectors[:, : len(spectrum) + 1 - self.rank_]
        self.noise_share_ = float(max(values[len(spectrum) - self.rank_], 0.0) / unit.count)
        output = null[-1]
        if unit.power > 0 and output @ output < _NO_OUTPUT**2:
            what = "the smallest direction of inputs and output leaves the output out"
            raise FitError(what, remedy="choose a larger rcond, or another estimator")
        # The member of the null space with an output of -1 and the least inputs.
        size = output @ output
        found = -null[:-1] @ output / size if size > 0 else np.zeros(len(spectrum))
        self._set(self._in_units(found, inputs))
