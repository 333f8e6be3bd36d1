"""Regression with noise in the inputs by joint factor analysis, Bayesian or not."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special
from sklearn.utils.validation import check_is_fitted

from dynident.errors import FitError
from dynident.moments import SecondMoments
from dynident.regression.corrected import CorrectedLeastSquares
from dynident.regression.factor_analysis import Gamma, start_of
from dynident.regression.factor_tables import factor_tables
from dynident.regression.given_noise import variances_of
from dynident.regression.iterations import Analysis, AnalysisEnding, analyse
from dynident.regression.ordinary import identified, ordinary
from dynident.regression.statistics_regressor import StatisticsRegressor

RELIABILITIES = (1e-3, 1.0 - 1e-6)
"""Least and largest that the iterations may start from, or be held at."""


class JointFactorRegression(StatisticsRegressor):
    """Joint factor analysis: maximum likelihood with noise in inputs and output.

    Two sets of coefficients come out. `coef_noisy_` (b_noise) predicts the output of inputs that
    have noise, as those of the fit had. `coef_true_` (b_true) is the law behind it, for inputs
    without noise: b_noise over the reliability of each input. **The data do not identify
    the reliability**: where `input_noise` is not given, maximum likelihood leaves it where it
    started.

    The model takes the inputs as independent. Where they are not, b_true is biased even with noise
    that is known; `corrected_` is not, and stands beside it.

    Parameters
    ----------
    input_noise : variance of the inputs' noise: one for all, or (d,) with NaN for an input whose
        noise is not known, or its covariance (d, d), whose diagonal counts; None where it is not
        known of any.
    reliability : share of the inputs' variance that is signal, where the iterations start.
    queries : what `predict` and `coef_` are for: "noisy" inputs or "noiseless" ones.
    max_iter : at most so many rounds of expectation maximisation.
    tol : nats of the bound that some thousand further rounds may still gain when the iterations
        end; half a nat is what one standard deviation is worth. Where the noise is not known, the
        bound may go on along the reliability, ever slower: `left_` says how far.
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    coef_noisy_, coef_true_ : (d,) b_noise and b_true.
    intercept_noisy_, intercept_true_ : to go with them.
    reliability_ : (d,) of each input, found or known; zero of constant ones.
    known_ : (d,) bool, inputs whose noise was given.
    pruned_ : (d,) bool, inputs that were taken out: their b_true is zero.
    basis_ : which inputs are combinations of the others, and the rank decision.
    bounds_ : lower bound of the log evidence in nats, in order: of rounds, and of leaps over some.
    ending_ : how the iterations ended, in words.
    converged_ : whether by themselves, and not on a flat ridge of the bound.
    left_, drift_ : nats of the bound that are seen to be left there, and how far a reliability
        would go on for them; NaN where it was not looked for.
    n_iter_ : rounds.
    least_squares_, sigma_noisy_ : (d,) ordinary least squares and its standard deviations, which
        are b_noise's before anything was shrunk; NaN for combinations of other inputs.
    corrected_ : corrected least squares with the same noise; None where the noise is not known of
        every input, or too much.
    sigma_true_ : (d,) standard deviation of b_true: that of `corrected_`, and how far b_true is
        from it; NaN without one.

    Notes
    -----
    Ting, Mistry, Peters, Schaal and Nakanishi, "Bayesian Nonlinear Parameter Estimation of Rigid
    Body Dynamics", RSS 2006: equations 3 and 4, which collapse to b_noise = wx wz/(wx^2 + px) and
    b_true = wz/wx.
    """

    words = "joint factor analysis"

    def __init__(
        self,
        input_noise: ArrayLike | None = None,
        reliability: float = 0.8,
        queries: Literal["noisy", "noiseless"] = "noisy",
        max_iter: int = 20_000,
        tol: float = 0.01,
        *,
        fit_intercept: bool = True,
    ) -> None:
        super().__init__(fit_intercept=fit_intercept)
        self.input_noise = input_noise
        self.reliability = reliability
        self.queries = queries
        self.max_iter = max_iter
        self.tol = tol

    def prior(self) -> Gamma | None:
        """Return the prior of the inputs' relevance; None without one."""
        return None

    def interval(self, level: float = 0.95) -> np.ndarray:
        """Return intervals of what `predict` estimates, (d, 2); NaN where there is none.

        For noisy inputs these are those of least squares: what was shrunk or pruned has none of
        its own, and would not be in the middle of an honest one. For noiseless inputs the middle
        is b_true.

        Raises
        ------
        FitError
            If the level is not between 0 and 1.
        """
        check_is_fitted(self)
        if not 0 < level < 1:
            raise FitError(f"level = {level!r}", remedy="choose it between 0 and 1, such as 0.95")
        if self.queries == "noisy":
            middle, sigma = self.least_squares_, self.sigma_noisy_
        else:
            middle, sigma = self.coef_true_, self.sigma_true_
        half = special.stdtrit(max(self.freedom_, 1), (1 + level) / 2) * sigma
        return np.column_stack([middle - half, middle + half])

    def summary(self) -> str:
        """Return inputs, coefficients and caveats as text."""
        check_is_fitted(self)
        return "\n".join(str(part) for part in factor_tables(self))

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        self._check()
        d = len(self._scale) - 1
        known = variances_of(self.input_noise, d)
        self.known_ = np.isfinite(known)
        share = known[inputs] / self._scale[inputs] ** 2
        if np.any(share >= 1):
            worst = self.input_names()[inputs[int(np.nanargmax(share))]]
            what = "its noise is said to be larger than all that it holds"
            raise FitError(what, f"input {worst}", "check the unit: a variance is wanted")
        rho = np.where(np.isfinite(share), 1 - share, self.reliability)
        prior = self.prior()
        analysis = analyse(
            unit,
            start_of(unit, rho, prior),
            prior,
            np.isfinite(share),
            rounds=self.max_iter,
            tolerance=self.tol,
        )
        self._keep(analysis, unit, inputs)

    def _check(self) -> None:
        if self.queries not in ("noisy", "noiseless"):
            raise FitError(f"queries = {self.queries!r}", remedy='choose "noisy" or "noiseless"')
        self._require("reliability", *RELIABILITIES)
        self._require("max_iter", 1, np.inf)
        self._require("tol", 1e-300, np.inf)

    def _keep(self, analysis: Analysis, unit: SecondMoments, inputs: np.ndarray) -> None:
        d, factors = len(self._scale) - 1, analysis.factors
        self.bounds_, self.n_iter_ = analysis.bounds, analysis.rounds
        self.ending_ = analysis.ending.value
        self.converged_ = analysis.ending in (AnalysisEnding.CONVERGED, AnalysisEnding.ROUNDING)
        self.left_, self.drift_ = analysis.left, analysis.drift
        self.reliability_, self.pruned_ = np.zeros(d), np.zeros(d, dtype=bool)
        self.reliability_[inputs] = factors.reliability
        self.coef_noisy_ = self._in_units(analysis.coefficients, inputs)
        self.coef_true_ = self._in_units(self._unfolded(analysis, unit, inputs), inputs)
        self.intercept_noisy_ = self._intercept(self.coef_noisy_)
        self.intercept_true_ = self._intercept(self.coef_true_)
        self._least_squares(unit, inputs)
        self._correct(unit)
        self._set(self.coef_noisy_ if self.queries == "noisy" else self.coef_true_)

    def _unfolded(self, analysis: Analysis, unit: SecondMoments, inputs: np.ndarray) -> np.ndarray:
        """Return b_true = wz / wx of standardised inputs; zero where both are."""
        wz, wx = analysis.factors.wz, analysis.factors.wx
        return np.divide(wz, wx, out=np.zeros_like(wz), where=wx != 0)

    def _least_squares(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        """Set ordinary least squares, with its standard deviations and degrees of freedom."""
        self.basis_ = identified(unit, tuple(self.input_names()[m] for m in inputs))
        self.freedom_ = self._freedom(unit, self.basis_.rank if self.basis_ else 0)
        d = len(self._scale) - 1
        self.least_squares_, self.sigma_noisy_ = np.full(d, np.nan), np.full(d, np.nan)
        if self.basis_ is None or self.freedom_ <= 0:
            return
        found = ordinary(unit, self.basis_, self.freedom_)
        own = inputs[found.inputs]
        units = self._scale[-1] / self._scale[own]
        self.least_squares_[own] = found.values * units
        self.sigma_noisy_[own] = found.sigma * units

    def _correct(self, unit: SecondMoments) -> None:
        """Set corrected least squares, and what it says of b_true."""
        self.corrected_: CorrectedLeastSquares | None = None
        self.sigma_true_ = np.full(len(self._scale) - 1, np.nan)
        if not np.all(self.known_ | self.constant_):
            return
        noise = np.array(self.input_noise, dtype=float)
        if noise.shape == self.known_.shape:
            noise = np.where(self.known_, noise, 0.0)  # of constants
        regression = CorrectedLeastSquares(noise, fit_intercept=self.fit_intercept)
        try:
            self.corrected_ = regression.fit_statistics(self._seen)
        except FitError:
            return
        self.sigma_true_ = np.hypot(regression.sigma_, self.coef_true_ - regression.coef_)
