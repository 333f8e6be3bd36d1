"""Regression on second moments, in the directions that are independent and carry signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.errors import FitError
from dynident.moments.second_moments import SecondMoments

EXACT = 1e-9
"""Directions below this share of the largest (of columns scaled to norm 1) are dependent; in terms
of squares, in which half of the digits are gone."""


@dataclass(frozen=True)
class MomentSolution:
    """Instrumental-variable regression on summed moments.

    Attributes
    ----------
    values : (p,) the minimum-norm solution in the directions that carry signal.
    basis : (p, r) these directions, orthonormal in the total moment.
    reliability : (r,) share of signal in each.
    """

    values: np.ndarray
    basis: np.ndarray
    reliability: np.ndarray

    @property
    def rank(self) -> int:
        """Number of directions that carry signal."""
        return self.basis.shape[1]

    def project(self, moment: np.ndarray) -> np.ndarray:
        """Coefficients of the regression on the columns, for any signal moment (p, k) with them."""
        return self.basis @ ((self.basis.T @ moment) / self.reliability[:, None])

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the values for residuals of variance one, (p, p)."""
        scaled = self.basis / self.reliability
        return scaled @ scaled.T


def regress(moments: SecondMoments, least_reliability: float) -> MomentSolution:
    """Regress the last column on the others.

    Parameters
    ----------
    moments : (p + 1, p + 1) of all rows.
    least_reliability : share of signal in the square of a direction, below which it is noise and
        left out.

    Raises
    ------
    FitError
        If a moment is not finite.
    """
    signal = moments.signal
    return solve_products(signal[:-1, :-1], moments.gram, signal[:-1, -1], least_reliability)


def solve_products(
    signal: np.ndarray, total: np.ndarray, moment: np.ndarray, least_reliability: float
) -> MomentSolution:
    """Solve signal @ values = moment where the columns carry signal.

    Parameters
    ----------
    signal, total : (p, p)
        Signal and total moments of the columns.
    moment : (p,)
        Signal moment of the columns with the torque.
    least_reliability : see `regress`.

    Returns
    -------
    The solution, with the directions that it is in.

    Raises
    ------
    FitError
        If a moment is not finite.
    """
    scale = np.sqrt(np.diag(total))
    white = orthonormal_directions(total, np.where(scale > 0, scale, 1.0))
    reliability, turn = np.linalg.eigh(white.T @ signal @ white)
    good = reliability > least_reliability
    basis = white @ turn[:, good]
    reliability = reliability[good]
    values = basis @ ((basis.T @ moment) / reliability)
    return MomentSolution(values, basis, reliability)


def orthonormal_directions(products: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Directions in which columns are independent, orthonormal in their products, (p, r).

    Parameters
    ----------
    products : (p, p) of the columns.
    scale : (p,) norms by which the columns are divided, so that units do not decide.

    Raises
    ------
    FitError
        If a product is not finite.
    """
    size, directions = np.linalg.eigh(products / np.outer(scale, scale))
    if not np.all(np.isfinite(size)):
        raise FitError("the columns of the model are not finite")
    keep = size > EXACT * max(float(size[-1]), 1e-300)
    return directions[:, keep] / np.sqrt(size[keep]) / scale[:, None]
