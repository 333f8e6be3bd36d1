"""What data show of the reliability of their inputs, and what start and prior decide instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.utils.validation import check_is_fitted

from dynident.errors import FitError
from dynident.moments import SecondMoments
from dynident.regression.given_noise import variances_of
from dynident.regression.joint_factors import RELIABILITIES, JointFactorRegression
from dynident.tables import Table, number

DISTINCT = 1.92
"""Nats of log-likelihood between two values of one parameter that tell them apart at 95 %."""

_CORRELATED = 0.2
"""Correlation from which inputs are not called independent."""
_RELIABILITIES = (0.5, 0.8, 0.95)
_WORST = 3  # inputs that are shown


@dataclass(frozen=True, eq=False, kw_only=True)
class StartSensitivity:
    """Estimates from several starts of the reliability.

    Attributes
    ----------
    names : (d,) of the inputs.
    reliabilities : (k,) where the iterations started.
    coef_true : (k, d) b_true of each, in the data's units.
    sizes : (d,) root mean square of each input about its mean.
    bounds : (k,) lower bound reached, nats.
    endings : (k,) of the iterations, in words.
    converged : (k,) bool.
    """

    names: tuple[str, ...]
    reliabilities: np.ndarray
    coef_true: np.ndarray
    sizes: np.ndarray
    bounds: np.ndarray
    endings: tuple[str, ...]
    converged: np.ndarray

    @property
    def ranges(self) -> np.ndarray:
        """Largest difference between two starts' b_true, (d,), times the size of the input."""
        return np.ptp(self.coef_true, axis=0) * self.sizes

    @property
    def spread(self) -> float:
        """Norm of these over the largest norm of one start's, each in units of the output."""
        size = np.linalg.norm(self.coef_true * self.sizes, axis=1).max()
        return float(np.linalg.norm(self.ranges) / size) if size > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON holds: b_true of each start by input, and the bounds in nats."""
        return {
            "reliabilities": self.reliabilities.tolist(),
            "b_true": dict(zip(self.names, self.coef_true.T.tolist(), strict=True)),
            "bounds": self.bounds.tolist(),
            "converged": self.converged.tolist(),
            "spread": self.spread,
        }

    def table(self) -> Table:
        """Return the starts, the bounds that they reach, and the inputs that they move most."""
        worst = np.argsort(-self.ranges)[:_WORST]
        worst = worst[self.ranges[worst] > 0]
        rows = tuple(
            (
                number(rho, 3),
                number(bound, 9),
                ended,
                *(number(b[m], 4) for m in worst),
            )
            for rho, bound, ended, b in zip(
                self.reliabilities, self.bounds, self.endings, self.coef_true, strict=True
            )
        )
        words = f"Between starts b_true differs by {100 * self.spread:.2g} % of its size"
        words += "; the inputs that differ most are shown." if len(worst) else "."
        if np.sum(self.converged) > 1 and np.ptp(self.bounds[self.converged]) > DISTINCT:
            words += (
                " Converged bounds differ by more than the data allow for: these are different "
                "optima."
            )
        columns = ("start of the reliability", "bound, nats", "", *(self.names[m] for m in worst))
        return Table("Sensitivity of b_true to the start", columns, rows, (words,))


@dataclass(frozen=True, eq=False, kw_only=True)
class ReliabilityProfile:
    """Log-likelihood along the reliability: flat where the data do not identify it.

    Attributes
    ----------
    reliabilities : (k,) of all inputs whose noise is not given, held.
    likelihoods : (k,) log-likelihood, maximised over all else, nats.
    bounds : (k,) the estimator's own bound there: what its prior adds is in it.
    converged : (k,) bool, whether the maximisation was.
    correlation : largest between two inputs, in size: the likelihood is that of independent ones.
    """

    reliabilities: np.ndarray
    likelihoods: np.ndarray
    bounds: np.ndarray
    converged: np.ndarray
    correlation: float

    @property
    def flat(self) -> bool:
        """Whether the data leave all these reliabilities open, at 95 %."""
        return float(np.ptp(self.likelihoods)) < DISTINCT

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON holds; likelihoods and bounds in nats."""
        return {
            "reliabilities": self.reliabilities.tolist(),
            "likelihoods": self.likelihoods.tolist(),
            "bounds": self.bounds.tolist(),
            "flat": self.flat,
            "converged": self.converged.tolist(),
            "correlation": self.correlation,
        }

    def table(self) -> Table:
        """Return the profile, with what follows from it."""
        rows = tuple(
            (
                number(rho, 3),
                number(likelihood, 9),
                number(bound, 9),
                "" if ended else "not converged",
            )
            for rho, likelihood, bound, ended in zip(
                self.reliabilities, self.likelihoods, self.bounds, self.converged, strict=True
            )
        )
        change = float(np.ptp(self.likelihoods))
        least, most = self.reliabilities.min(), self.reliabilities.max()
        words = f"Between reliabilities {least:g} and {most:g} the likelihood changes by "
        words += f"{change:.2g} nats: "
        words += (
            "means and covariances do not tell the reliability, and b_true = b_noise / "
            "reliability is what start and prior say. Give the input noise."
            if self.flat
            else "data with independent inputs would speak against some of them."
        )
        if not self.flat and self.correlation > _CORRELATED:
            words += (
                f" These inputs are not independent (correlations up to {self.correlation:.2g}), "
                "and what the likelihood prefers may make up for that: no evidence of the noise."
            )
        if not np.all(self.converged):
            words += " Where the iterations did not converge the likelihood is a lower bound."
        columns = ("reliability", "log-likelihood, nats", "bound, nats", "")
        return Table("What the data tell of the reliability", columns, rows, (words,))


def start_sensitivity(
    regression: JointFactorRegression, reliabilities: Sequence[float] = _RELIABILITIES
) -> StartSensitivity:
    """Fit anew from several starts of the reliability.

    Parameters
    ----------
    regression : fitted.
    reliabilities : where to start, between 0 and 1.
    """
    _checked(regression, reliabilities)
    each = [
        regression.another(reliability=rho).fit_statistics(regression.statistics_)
        for rho in reliabilities
    ]
    return StartSensitivity(
        names=tuple(regression.input_names()),
        reliabilities=np.array(reliabilities, dtype=float),
        coef_true=np.array([one.coef_true_ for one in each]),
        sizes=_used(regression).scale[:-1],
        bounds=np.array([one.bounds_[-1] for one in each]),
        endings=tuple(one.ending_ for one in each),
        converged=np.array([one.converged_ for one in each]),
    )


def _checked(regression: JointFactorRegression, reliabilities: Sequence[float]) -> None:
    check_is_fitted(regression)
    least, most = RELIABILITIES
    if not len(reliabilities) or not all(least <= rho <= most for rho in reliabilities):
        what = f"reliabilities {list(reliabilities)}"
        raise FitError(what, remedy="give at least one, each between 0 and 1")


def _used(regression: JointFactorRegression) -> SecondMoments:
    statistics = regression.statistics_
    return statistics if regression.fit_intercept else statistics.about_origin()


def reliability_profile(
    regression: JointFactorRegression, reliabilities: Sequence[float] = (0.5, 0.7, 0.9, 0.99)
) -> ReliabilityProfile:
    """Hold the reliability at several values and fit all else.

    Parameters
    ----------
    regression : fitted; inputs whose noise it was given keep it.
    reliabilities : between 0 and 1.

    Raises
    ------
    FitError
        If the noise of every input is given.
    """
    _checked(regression, reliabilities)
    if np.all(regression.known_ | regression.constant_):
        remedy = "there is nothing to profile: leave one to be found"
        raise FitError("the noise of every input is given", remedy=remedy)
    statistics = regression.statistics_
    variance = _used(regression).scale[:-1] ** 2
    given = variances_of(regression.input_noise, statistics.inputs)
    likelihoods, bounds, converged = [], [], []
    for rho in reliabilities:
        noise = np.where(regression.known_, given, (1 - rho) * variance)
        own = regression.another(input_noise=noise).fit_statistics(statistics)
        plain = JointFactorRegression(
            noise,
            max_iter=regression.max_iter,
            tol=regression.tol,
            fit_intercept=regression.fit_intercept,
        ).fit_statistics(statistics)
        bounds.append(own.bounds_[-1])
        likelihoods.append(plain.bounds_[-1])
        converged.append(plain.converged_ or plain.left_ < DISTINCT / 10)
    return ReliabilityProfile(
        reliabilities=np.array(reliabilities, dtype=float),
        likelihoods=np.array(likelihoods),
        bounds=np.array(bounds),
        converged=np.array(converged),
        correlation=_correlation(_used(regression)),
    )


def _correlation(statistics: SecondMoments) -> float:
    """Largest correlation between two inputs that vary, in size."""
    varied = statistics.keeping(statistics.scale[:-1] > 0)
    size = np.sqrt(np.diag(varied.gram))
    between = np.abs(varied.gram / size / size[:, None]) - np.eye(varied.inputs)
    return float(np.max(between, initial=0.0))
