"""Regression on second moments, in the directions that are independent and carry signal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import get_lapack_funcs, qr

from dynident.errors import FitError
from dynident.moments.factors import RANK_TOLERANCE
from dynident.moments.second_moments import SecondMoments

EXACT = RANK_TOLERANCE**2
"""Directions below this share of the largest (of columns scaled to norm 1) are dependent; in terms
of squares, in which half of the digits are gone."""
_SOUND = 100.0 * EXACT
"""Estimated reciprocal condition of squares above which no direction is dependent by `EXACT`."""
_DEPENDENT = 1e-13
"""Squared part of a column of norm 1, beside others, below which it surely depends on them."""

_potrf, _pstrf, _potrs, _pocon = get_lapack_funcs(("potrf", "pstrf", "potrs", "pocon"))


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

    Where columns are independent, or depend on others beyond doubt, Cholesky factors are enough to
    see it, and to solve; so they are to see that no direction is noise.

    Parameters
    ----------
    moments, least_reliability : as for `regress`.

    Raises
    ------
    FitError
        If a moment is not finite.
    """
    scale, signal = np.sqrt(moments.gram.diagonal()), moments.signal
    # The minimum and the sum of numbers one of which is none are none either.
    if not (scale.min(initial=1.0) > 0 and math.isfinite(scale.sum() + signal.sum())):
        return regress(moments, least_reliability).values
    units = scale[:, None] * scale
    total, free = moments.gram / units, signal[:-1, :-1] / units
    pivoted, order, rank, _ = _pstrf(total, tol=_DEPENDENT)
    some, others = order[:rank] - 1, order[rank:] - 1
    among = some[:, None], some
    whole, factor = total[among], pivoted[:rank, :rank]
    own = factor if _is_sound(factor, whole) else None
    if own is not None and moments.noise_free is not None:
        signal_in = free[among]
        reliable = _factor(signal_in - least_reliability * whole) is not None
        own = _factor(signal_in) if reliable else None
    if own is None:
        return regress(moments, least_reliability).values
    found = np.zeros(len(scale))
    found[some] = _potrs(own, signal[some, -1] / scale[some])[0]
    if len(others):
        # What they have in common is shared among them, so that the values are the smallest.
        same = np.zeros((len(scale), len(others)))
        same[some] = -_potrs(factor, total[np.ix_(some, others)])[0]
        same[others, range(len(others))] = 1.0
        found -= same @ np.linalg.solve(same.T @ same, same.T @ found)
    return found / scale


def _factor(products: np.ndarray) -> np.ndarray | None:
    """The upper Cholesky factor; None where the products are not positive definite."""
    factor, failed = _potrf(products)
    return None if failed else factor


def _is_sound(factor: np.ndarray, products: np.ndarray) -> bool:
    """Whether columns of norm 1 are independent, by far beyond the bound of `regress`."""
    least, _ = _pocon(factor, np.abs(products).sum(axis=0).max(initial=0.0))
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
    reliability, turn = eigenvectors(white.T @ signal @ white)
    good = reliability > least_reliability
    basis = white @ turn[:, good]
    reliability = reliability[good]
    values = basis @ ((basis.T @ moment) / reliability)
    return MomentSolution(values, basis, reliability)


def eigenvectors(products: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (..., p), ascending, and eigenvectors of symmetric products, (..., p, p) both.

    Most effects have one column, of which there is nothing to work out.
    """
    if products.shape[-1] == 1:
        return products[..., 0].copy(), np.ones_like(products)
    return np.linalg.eigh(products)


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
    size, directions = eigenvectors(products / np.outer(scale, scale))
    if not np.all(np.isfinite(size)):
        raise FitError("the columns of the model are not finite")
    keep = size > EXACT * max(float(size[-1]), 1e-300)
    return directions[:, keep] / np.sqrt(size[keep]) / scale[:, None]


def orthonormal(columns: np.ndarray, tolerance: float = RANK_TOLERANCE) -> np.ndarray:
    """Return an orthonormal basis of what columns span, (N, r).

    By QR with pivoting: of regressors, whose columns depend on each other, an SVD has been seen not
    to converge.

    Parameters
    ----------
    columns : (N, k), of any size each.
    tolerance : size of a direction over that of the largest, from which it counts.
    """
    norms = np.linalg.norm(columns, axis=0)
    if not norms.any():
        return columns[:, :0]
    found: Any = qr(columns / np.where(norms > 0, norms, 1.0), mode="economic", pivoting=True)
    size = np.abs(np.diag(found[1]))
    return found[0][:, : len(size)][:, size > tolerance * size[0]]
