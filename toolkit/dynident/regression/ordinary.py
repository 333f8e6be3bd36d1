"""Ordinary least squares: by truncated singular values, or of the inputs that are identified.

In: standardised statistics. Out: coefficients, where directions that the data do not excite stay at
zero; or coefficients with their standard deviations, of those inputs alone that are no
combinations of others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.moments import SecondMoments
from dynident.regression.statistics_regressor import StatisticsRegressor
from dynident.robot import BaseParameters, base_parameters

_ROUNDING = 10.0 * np.finfo(float).eps
_DEPENDENT = 1e-7  # share of an input that the others leave, below which it is their combination


def squared_tolerance(unit: SecondMoments, rcond: float) -> float:
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

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        self._require("rcond", 0.0, 0.5)
        values, vectors = np.linalg.eigh(unit.gram)
        kept = values > squared_tolerance(unit, self.rcond) * values.max(initial=0.0)
        self.rank_ = int(kept.sum())
        along = vectors[:, kept]
        self._set(self._in_units(along @ ((along.T @ unit.cross) / values[kept]), inputs))


@dataclass(frozen=True, eq=False)
class Ordinary:
    """Ordinary least squares of inputs that have a coefficient of their own.

    Attributes
    ----------
    inputs : (k,) their numbers.
    values, sigma : (k,) standardised coefficients, and their standard deviations.
    """

    inputs: np.ndarray
    values: np.ndarray
    sigma: np.ndarray


def identified(unit: SecondMoments, names: tuple[str, ...]) -> BaseParameters | None:
    """Return which inputs are combinations of the others; None without inputs.

    Parameters
    ----------
    unit : standardised statistics of d inputs that vary.
    names : (d,) of the inputs.
    """
    if not names:
        return None
    values, vectors = np.linalg.eigh(unit.gram)
    root = np.sqrt(np.clip(values, 0.0, None))[:, None] * vectors.T
    # Eigenvalues have the rounding of the largest, which its square root makes visible.
    hidden = np.sqrt(squared_tolerance(unit, 0.0) * values.max(initial=0.0) / unit.count)
    return base_parameters(root, names, max(_DEPENDENT, hidden))


def ordinary(unit: SecondMoments, basis: BaseParameters, freedom: int) -> Ordinary:
    """Return ordinary least squares of the identified inputs.

    What is a combination of other inputs has no value of its own, nor have those its parts.

    Parameters
    ----------
    unit : standardised statistics.
    basis : see `identified`.
    freedom : degrees of freedom of the residual, positive.
    """
    kept = list(basis.independent)
    G, c = unit.gram[np.ix_(kept, kept)], unit.cross[kept]
    found = np.linalg.solve(G, c)
    variance = max(unit.power - c @ found, 0.0) / freedom
    alone = [not np.any(basis.K[i]) for i in range(len(kept))]
    sigma = np.sqrt(variance * np.diag(np.linalg.inv(G)))
    return Ordinary(np.array(kept)[alone], found[alone], sigma[alone])
