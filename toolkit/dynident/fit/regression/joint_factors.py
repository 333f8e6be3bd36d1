"""Regression with noise in the inputs by joint factor analysis, Bayesian or not."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from dynident.errors import FitError
from dynident.fit.regression.base import StatisticsRegressor
from dynident.fit.regression.factor_analysis import Analysis, Ending, Gamma, analyse, start_of
from dynident.fit.regression.independence import independent
from dynident.fit.regression.noise import variances_of
from dynident.fit.regression.statistics import Statistics
from dynident.robot import BaseParameters, base_parameters

LEAST_RELIABILITY = 0.5
"""Least reliability that b_true is unfolded with where the input's noise is not known."""
_EXPLAINS = 2.0
"""Standard errors of an input alone, below which its coefficient explains no more than noise."""

_DEPENDENT = 1e-7  # share of an input that the others leave, below which it is their combination


class JointFactorRegression(StatisticsRegressor):
    """Joint factor analysis: maximum likelihood with noise in inputs and output.

    Two sets of coefficients come out. `coef_noisy_` (b_noise) predicts the output of inputs that
    have noise, as those of the fit had. `coef_true_` (b_true) is the law behind it, for inputs
    without noise: b_noise over the reliability of each input. **The data do not tell the
    reliability**: where `input_noise` is not given, maximum likelihood leaves it where it started.

    Parameters
    ----------
    input_noise : variance of the inputs' noise: one for all, or (d,) with NaN for an input whose
        noise is not known; None where none is. A full covariance counts by its diagonal, since
        the model takes the inputs as independent.
    reliability : share of the inputs' variance that is signal, where the iterations start.
    queries : what `predict` and `coef_` are for: "noisy" inputs or "noiseless" ones.
    max_iter : at most so many rounds of expectation maximisation.
    tol : nats that a round has to gain in the bound, or the iterations end.
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    coef_noisy_, coef_true_ : (d,) b_noise and b_true.
    intercept_noisy_, intercept_true_ : to go with them.
    reliability_ : (d,) of each input, found or known; zero of constant ones.
    known_ : (d,) bool, inputs whose noise was given.
    pruned_ : (d,) bool, inputs that explain no more than noise does, and whose reliability, not
        being known, fell below one half: their b_true is zero. That of others whose reliability
        fell there is twice b_noise, and no more.
    basis_ : which inputs are combinations of the others, and the rank decision.
    bounds_ : (n_iter_,) lower bound of the log evidence in nats, in order.
    converged_ : whether the last round gained no more than `tol`.
    n_iter_ : rounds.
    noise_variance_ : of the output, what no input explains (z's variance counts as explained).
    sigma_noisy_, sigma_true_ : (d,) standard deviations; NaN for combinations of other inputs.
        Those of b_true need an input noise that is known, and inputs that are independent.
    independent_ : whether the data let the inputs count as independent, as the model has them;
        if not, b_true is biased, has no intervals, and corrected least squares is what is needed.

    Notes
    -----
    Ting, Mistry, Peters, Schaal and Nakanishi, "Bayesian Nonlinear Parameter Estimation of Rigid
    Body Dynamics", RSS 2006: equations 3 and 4, which collapse to b_noise = wx wz/(wx^2 + px) and
    b_true = wz/wx.
    """

    def __init__(
        self,
        input_noise: ArrayLike | None = None,
        reliability: float = 0.8,
        queries: Literal["noisy", "noiseless"] = "noisy",
        max_iter: int = 20_000,
        tol: float = 1e-4,
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
        """Return intervals of the coefficients of `predict`, (d, 2); NaN where there is none.

        They are as wide as those of least squares: shrinking and pruning make none narrower.
        """
        sigma = self.sigma_noisy_ if self.queries == "noisy" else self.sigma_true_
        half = stats.norm.ppf((1 + level) / 2) * sigma
        return np.column_stack([self.coef_ - half, self.coef_ + half])

    def summary(self) -> str:
        """Return inputs, coefficients and caveats as text."""
        # Imported where it is used: the tables know the estimator.
        from dynident.fit.regression.summary import summary

        return "\n".join(str(part) for part in summary(self))

    def _solve(self, unit: Statistics, inputs: np.ndarray) -> None:
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
            raise FitError(f"queries = {self.queries!r}", mend='choose "noisy" or "noiseless"')
        if not 0 < self.reliability < 1:
            raise FitError(f"reliability = {self.reliability!r}", mend="choose it between 0 and 1")

    def _keep(self, analysis: Analysis, unit: Statistics, inputs: np.ndarray) -> None:
        d, factors = len(self._scale) - 1, analysis.factors
        self.bounds_, self.n_iter_ = analysis.bounds, len(analysis.bounds)
        self.converged_ = analysis.ending is Ending.CONVERGED
        self.reliability_ = np.zeros(d)
        self.reliability_[inputs] = factors.reliability
        lost = self._irrelevant(analysis, unit) & ~self.known_[inputs]
        self.pruned_ = np.zeros(d, dtype=bool)
        self.pruned_[inputs] = lost
        # Where nothing but the prior speaks of a reliability, it may not blow a coefficient up.
        floor = np.where(self.known_[inputs], 0.0, LEAST_RELIABILITY)
        free = factors.reliability > floor
        true = np.where(
            free, factors.wz / np.where(free, factors.wx, 1.0), factors.noisy / LEAST_RELIABILITY
        )
        true = np.where(lost, 0.0, true)
        self.coef_noisy_ = self._in_units(analysis.coefficients, inputs)
        self.coef_true_ = self._in_units(true, inputs)
        self.intercept_noisy_ = self._intercept(self.coef_noisy_)
        self.intercept_true_ = self._intercept(self.coef_true_)
        self.noise_variance_ = factors.py * float(self._scale[-1]) ** 2
        self.basis_ = self._basis(unit, inputs)
        self.independent_ = independent(unit.keeping(~lost), true[~lost], factors.px[~lost])
        self._sigma(unit)
        self._set(self.coef_noisy_ if self.queries == "noisy" else self.coef_true_)

    def _irrelevant(self, analysis: Analysis, unit: Statistics) -> np.ndarray:
        """Inputs that lost their reliability and explain no more than noise does, (d,) bool."""
        b = analysis.coefficients
        alone = np.sqrt(unit.residual(b) / unit.count / np.diag(unit.gram))
        lost = analysis.factors.reliability < LEAST_RELIABILITY
        return lost & (np.abs(b) < _EXPLAINS * alone)

    def _basis(self, unit: Statistics, inputs: np.ndarray) -> BaseParameters | None:
        names = tuple(self.input_names()[m] for m in inputs)
        values, vectors = np.linalg.eigh(unit.gram)
        root = np.sqrt(np.clip(values, 0.0, None))[:, None] * vectors.T
        return base_parameters(root, names, _DEPENDENT) if len(names) else None

    def _sigma(self, unit: Statistics) -> None:
        """Set the standard deviations: those of least squares, which no shrinking makes smaller."""
        d, N = len(self._scale) - 1, unit.count
        self.sigma_noisy_, self.sigma_true_ = np.full(d, np.nan), np.full(d, np.nan)
        varied = np.flatnonzero(~self.constant_)
        if self.basis_ is None or len(varied) >= N:
            return
        kept = list(self.basis_.independent)
        G, c = unit.gram[np.ix_(kept, kept)], unit.cross[kept]
        variance = max(unit.power - c @ np.linalg.solve(G, c), 0.0) / (N - len(kept))
        # What is a combination of others has no value of its own, nor have those its parts.
        alone = [not np.any(self.basis_.K[i]) for i in range(len(kept))]
        own = varied[kept][alone]
        sigma = np.sqrt(variance * np.diag(np.linalg.inv(G)))[alone]
        self.sigma_noisy_[own] = sigma * self._scale[-1] / self._scale[own]
        if not self.independent_:
            return
        # The reliability is 1 - noise / variance of the input, and that variance is estimated.
        rho = np.where(self.known_, self.reliability_, np.nan)[own]
        of_rho = self.coef_true_[own] * (1 - rho) / rho * np.sqrt(2 / N)
        self.sigma_true_[own] = np.hypot(self.sigma_noisy_[own] / rho, of_rho)


class BayesianFactorRegression(JointFactorRegression):
    """Bayesian joint factor analysis: as its parent, and inputs that do not matter are pruned.

    One relevance for both weights of an input, with a Gamma prior, takes inputs out that explain
    little. It also moves the reliability of the rest: where `input_noise` is not given, b_true is
    what start and prior say, and `start_sensitivity` shows how much.

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

    def __init__(
        self,
        input_noise: ArrayLike | None = None,
        reliability: float = 0.8,
        queries: Literal["noisy", "noiseless"] = "noisy",
        max_iter: int = 20_000,
        tol: float = 1e-4,
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

    def _keep(self, analysis: Analysis, unit: Statistics, inputs: np.ndarray) -> None:
        super()._keep(analysis, unit, inputs)
        self.relevance_ = np.full(len(self._scale) - 1, np.inf)
        self.relevance_[inputs] = analysis.factors.relevance
