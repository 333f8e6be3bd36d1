"""What data tell of the reliability of their inputs, and what start and prior decide instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.errors import FitError
from dynident.fit.regression.joint_factors import JointFactorRegression
from dynident.fit.regression.noise import variances_of
from dynident.tables import Table, number

TOLD = 1.92
"""Nats of log-likelihood between two values of one parameter that tell them apart at 95 %."""

_RELIABILITIES = (0.5, 0.8, 0.95)


@dataclass(frozen=True, eq=False)
class StartSensitivity:
    """Estimates from several starts of the reliability.

    Attributes
    ----------
    reliabilities : (k,) where the iterations started.
    coef_true : (k, d) b_noise over the reliability, as it came of each: not pruned, not held.
    bounds : (k,) lower bound reached, nats.
    converged : (k,) bool.
    """

    reliabilities: np.ndarray
    coef_true: np.ndarray
    bounds: np.ndarray
    converged: np.ndarray

    @property
    def spread(self) -> float:
        """Largest distance of two starts' b_true over the largest norm of one."""
        apart = self.coef_true[:, None] - self.coef_true[None]
        size = np.linalg.norm(self.coef_true, axis=1).max()
        return float(np.linalg.norm(apart, axis=2).max() / size) if size > 0 else 0.0

    def table(self) -> Table:
        """Return the starts, the bounds that they reach, and the size of their b_true."""
        rows = tuple(
            (number(rho, 3), number(bound, 9), number(float(np.linalg.norm(b)), 5), word)
            for rho, bound, b, word in zip(
                self.reliabilities,
                self.bounds,
                self.coef_true,
                np.where(self.converged, "converged", "not converged"),
                strict=True,
            )
        )
        words = f"Between starts b_true differs by up to {100 * self.spread:.2g} %."
        columns = ("start of the reliability", "bound, nats", "norm of b_true", "")
        return Table("Sensitivity of b_true to the start", columns, rows, (words,))


@dataclass(frozen=True, eq=False)
class ReliabilityProfile:
    """Log-likelihood along the reliability: flat where the data do not tell it.

    Attributes
    ----------
    reliabilities : (k,) of all inputs whose noise is not given, held.
    likelihoods : (k,) log-likelihood, maximised over all else, nats.
    bounds : (k,) the estimator's own bound there: what its prior adds is in it.
    """

    reliabilities: np.ndarray
    likelihoods: np.ndarray
    bounds: np.ndarray

    @property
    def flat(self) -> bool:
        """Whether the data leave all these reliabilities open, at 95 %."""
        return float(np.ptp(self.likelihoods)) < TOLD

    def table(self) -> Table:
        """Return the profile, with what follows from it."""
        rows = tuple(
            (number(rho, 3), number(likelihood, 9), number(bound, 9))
            for rho, likelihood, bound in zip(
                self.reliabilities, self.likelihoods, self.bounds, strict=True
            )
        )
        change = float(np.ptp(self.likelihoods))
        least, most = self.reliabilities.min(), self.reliabilities.max()
        words = f"Between reliabilities {least:g} and {most:g} the likelihood changes by "
        words += f"{change:.2g} nats: "
        words += (
            "the data do not tell the reliability, and b_true = b_noise / reliability is what "
            "start and prior say. Give the input noise."
            if self.flat
            else "the data speak against some of them."
        )
        columns = ("reliability", "log-likelihood, nats", "bound, nats")
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
    each = [
        regression.another(reliability=rho).fit_statistics(regression.statistics_)
        for rho in reliabilities
    ]
    return StartSensitivity(
        np.array(reliabilities, dtype=float),
        np.array([_unfolded(one) for one in each]),
        np.array([one.bounds_[-1] for one in each]),
        np.array([one.converged_ for one in each]),
    )


def _unfolded(regression: JointFactorRegression) -> np.ndarray:
    rho = regression.reliability_
    return np.divide(regression.coef_noisy_, rho, out=np.zeros_like(rho), where=rho > 0)


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
    if np.all(regression.known_ | regression.constant_):
        mend = "there is nothing to profile: leave one to be found"
        raise FitError("the noise of every input is given", mend=mend)
    statistics = regression.statistics_
    used = statistics if regression.fit_intercept else statistics.about_origin()
    variance = used.scale[:-1] ** 2
    given = variances_of(regression.input_noise, statistics.inputs)
    likelihoods, bounds = [], []
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
    return ReliabilityProfile(
        np.array(reliabilities, dtype=float), np.array(likelihoods), np.array(bounds)
    )
