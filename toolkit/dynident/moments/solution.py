"""Regression on second moments, in the directions that are independent and carry signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import get_lapack_funcs

from dynident.errors import FitError
from dynident.moments.second_moments import SecondMoments

EXACT = 1e-9
"""Directions below this share of the largest (of columns scaled to norm 1) are dependent; in terms
of squares, in which half of the digits are gone."""
_SOUND = 100.0 * EXACT
"""Estimated reciprocal condition of squares above which no direction is dependent by `EXACT`."""
_potrf, _potrs, _pocon = get_lapack_funcs(("potrf", "potrs", "pocon"))


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


def regression_values(moments: SecondMoments, least_reliability: float) -> np.ndarray:
    """Values of `regress` without its directions, (p,), in less time.

    Where no direction is to be left out they solve one system of equations, of which a Cholesky
    factor is enough; whether any is, such factors tell as well.

    Parameters
    ----------
    moments, least_reliability : as for `regress`.

    Raises
    ------
    FitError
        If a moment is not finite.
    """
    total, signal = moments.gram, moments.signal
    scale = np.sqrt(np.diag(total))
    if len(scale) and np.all(np.isfinite(signal)) and np.all(scale > 0):
        units = np.outer(scale, scale)
        total, known = total / units, signal[:-1, :-1] / units
        free = moments.noise_free is not None
        if _sound(total) and (not free or _factor(known - least_reliability * total) is not None):
            factor = _factor(known)
            if factor is not None:
                found, _ = _potrs(factor, signal[:-1, -1] / scale)
                return found / scale
    return regress(moments, least_reliability).values


def _factor(products: np.ndarray) -> np.ndarray | None:
    """The upper Cholesky factor; None where the products are not positive definite."""
    factor, failed = _potrf(products)
    return None if failed else factor


def _sound(products: np.ndarray) -> bool:
    """Whether columns of norm 1 are independent, to a bound well above that of `regress`."""
    factor = _factor(products)
    if factor is None:
        return False
    least, _ = _pocon(factor, np.abs(products).sum(axis=0).max())
    return bool(least > _SOUND)


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
