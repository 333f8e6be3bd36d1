"""Bayesian regression with noise in the inputs: joint factor analysis that prunes."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dynident.moments import SecondMoments
from dynident.regression.factor_analysis import LEAST_RELIABILITY, Gamma
from dynident.regression.iterations import Analysis
from dynident.regression.joint_factors import JointFactorRegression

_EXPLAINS = 2.0
"""Standard errors of an input alone, below which its coefficient explains no more than noise."""


class BayesianFactorRegression(JointFactorRegression):
    """Bayesian joint factor analysis: as its parent, and inputs that do not matter are pruned.

    One relevance for both weights of an input, with a Gamma prior, takes inputs out that explain
    little. It also speaks against the reliability of the rest: where `input_noise` is not given,
    b_true is what start and prior say, and `start_sensitivity` shows how much. It is held at
    twice b_noise there, and at zero where an input explains no more than noise does.

    Parameters
    ----------
    input_noise, reliability, queries, max_iter, tol, fit_intercept :
        as of `JointFactorRegression`.
    relevance_shape, relevance_rate : of the Gamma prior; near zero they say next to nothing.

    Attributes
    ----------
    relevance_ : (d,) precision of the prior of each input's standardised weights: large where the
        input is switched off; infinite for constants.
    """

    words = "Bayesian regression with input noise"

    def __init__(
        self,
        input_noise: ArrayLike | None = None,
        reliability: float = 0.8,
        queries: Literal["noisy", "noiseless"] = "noisy",
        max_iter: int = 20_000,
        tol: float = 0.01,
        relevance_shape: float = 1e-8,
        relevance_rate: float = 1e-8,
        *,
        fit_intercept: bool = True,
    ) -> None:
        super().__init__(
            input_noise, reliability, queries, max_iter, tol, fit_intercept=fit_intercept
        )
        self.relevance_shape = relevance_shape
        self.relevance_rate = relevance_rate

    def prior(self) -> Gamma:
        """Return the prior of the inputs' relevance."""
        return Gamma(self.relevance_shape, self.relevance_rate)

    def _check(self) -> None:
        super()._check()
        for setting in ("relevance_shape", "relevance_rate"):
            self._require(setting, 1e-300, 1e300)

    def _unfolded(self, analysis: Analysis, unit: SecondMoments, inputs: np.ndarray) -> np.ndarray:
        low = (analysis.factors.reliability < LEAST_RELIABILITY) & ~self.known_[inputs]
        b = analysis.coefficients
        alone = np.sqrt(unit.residual(b) / unit.count / np.diag(unit.gram))
        self.pruned_[inputs] = low & (np.abs(b) < _EXPLAINS * alone)
        true = super()._unfolded(analysis, unit, inputs)
        # Where nothing but the prior speaks of a reliability, it may not blow a coefficient up.
        true = np.where(low, analysis.factors.noisy / LEAST_RELIABILITY, true)
        return np.where(self.pruned_[inputs], 0.0, true)

    def _keep(self, analysis: Analysis, unit: SecondMoments, inputs: np.ndarray) -> None:
        super()._keep(analysis, unit, inputs)
        self.relevance_ = np.full(len(self._scale) - 1, np.inf)
        self.relevance_[inputs] = analysis.factors.relevance
