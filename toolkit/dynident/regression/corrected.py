"""Least squares corrected for input noise that is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from dynident.errors import FitError
from dynident.moments import SecondMoments
from dynident.regression.given_noise import covariance_of
from dynident.regression.statistics_regressor import StatisticsRegressor

LEAST_SHARE = 4.0
"""Standard deviations of the signal's share, below which intervals are too narrow."""
_DEPENDENT = 1e-14  # eigenvalue of the inputs' correlations that is rounding around zero, per input


class CorrectedLeastSquares(StatisticsRegressor):
    """b = (X'X - N Psi)^-1 X'y for inputs whose noise has the covariance Psi.

    Consistent whatever the correlation of the inputs, as long as their noise is independent of
    the motion and of the output. What is taken off makes the problem worse conditioned: see
    `signal_share_`.

    Parameters
    ----------
    input_noise : Psi per row: a variance for all inputs, (d,) variances, or (d, d).
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    covariance_ : (d, d) of the coefficients, for Gaussian noise that is independent from row to
        row and known exactly; NaN of constants, and where no degree of freedom is left.
    sigma_ : (d,) standard deviations from it.
    signal_share_ : of the direction in which noise is worst, the share of X'X that is no noise.
    signal_share_doubt_ : its standard deviation, if the rows were independent.
    condition_number_ : of X'X - N Psi, for standardised inputs.
    noise_variance_ : of the output; negative where the input noise is overstated.

    Notes
    -----
    Fuller, "Measurement Error Models" (1987), section 2.2.
    """

    words = "corrected least squares"

    def __init__(self, input_noise: ArrayLike = 0.0, *, fit_intercept: bool = True) -> None:
        super().__init__(fit_intercept=fit_intercept)
        self.input_noise = input_noise

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        N, scale = unit.count, self._scale
        own = np.ix_(inputs, inputs)
        psi = covariance_of(self.input_noise, len(scale) - 1)[own]
        psi = psi / np.outer(scale[inputs], scale[inputs])
        signal = unit.gram / N - psi
        if np.linalg.eigvalsh(unit.gram / N).min(initial=1.0) < _DEPENDENT * max(len(inputs), 1):
            what = "some inputs are combinations of others: no row tells them apart"
            raise FitError(what, remedy="leave them out, or give more rows than inputs")
        # Of an empty set of inputs all is signal.
        shares = eigh(psi, unit.gram / N, eigvals_only=True) if len(psi) else np.zeros(1)
        self.signal_share_ = 1.0 - float(shares[-1])
        # X'X of a Gaussian direction has a relative variance of 2 / N.
        self.signal_share_doubt_ = float(shares[-1]) * np.sqrt(2.0 / N)
        if self.signal_share_ <= 0:
            what = "in some direction the input noise is all that the inputs hold"
            remedy = "excite more, leave inputs out, or look whether the noise is overstated"
            raise FitError(what, remedy=remedy)
        inverse = np.linalg.inv(signal)
        found = inverse @ unit.cross / N
        self.condition_number_ = float(np.linalg.cond(signal)) if len(psi) else 1.0
        # The residual y - x'b holds the output's noise and, through the inputs', psi b.
        freedom = self._freedom(unit, len(found))
        seen = unit.residual(found) / freedom if freedom > 0 else np.nan
        covariance = inverse * seen
        covariance += inverse @ (psi * seen + np.outer(psi @ found, psi @ found)) @ inverse
        covariance /= N
        self._set(self._in_units(found, inputs))
        units = scale[-1] / scale[inputs]
        self.covariance_ = np.full((len(scale) - 1,) * 2, np.nan)
        self.sigma_ = np.full(len(scale) - 1, np.nan)
        self.sigma_[inputs] = np.sqrt(np.diag(covariance)) * units
        with np.errstate(over="ignore"):  # units whose squares no number holds
            self.covariance_[own] = covariance * np.outer(units, units)
        self.noise_variance_ = float(seen - found @ psi @ found) * scale[-1] ** 2
