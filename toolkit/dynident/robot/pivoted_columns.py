"""The pivoted QR that tells which columns of a regressor are kept as base parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from dynident.robot.tree import Array

ROUNDING = 1e-9
"""A diagonal entry this small (of the largest) is rounding in double precision, not geometry."""
# A column this much smaller than the largest is rounding around zero, not a measurement.
_ZERO = 1e-13
# How much the first of two equal columns is preferred as a pivot.
_FAVOUR = 1e-6


@dataclass(frozen=True, eq=False, kw_only=True)
class PivotedColumns:
    """The pivoted QR of the columns of a regressor that show anything.

    Attributes
    ----------
    scale : (p,) norm of each column, zero where it shows nothing.
    near : (p,) whether a column counts as zero although more than rounding shows it.
    shown : numbers of the other columns.
    norms : by which they are divided.
    R, pivots, diagonal : of the QR; the diagonal as magnitudes.
    rank : number of the columns that are kept.
    """

    scale: Array
    near: NDArray[np.bool_]
    shown: NDArray[np.int_]
    norms: Array
    R: Array
    pivots: NDArray[np.int_]
    diagonal: Array
    rank: int

    @classmethod
    def of(cls, X: Array, tolerance: float, borne: ArrayLike) -> PivotedColumns:
        """Normalise and factorise the columns of a regressor.

        Parameters
        ----------
        X : (m, p)
        tolerance : of the largest diagonal entry, below which a column depends on others.
        borne : (p,) norm of a column where the axis bears its parameter in full; 0 where unknown.

        Returns
        -------
        The factors, of columns of about unit norm.
        """
        scale = np.linalg.norm(X, axis=0)
        scale[scale <= _ZERO * np.max(scale, initial=0.0)] = 0.0
        full_norm = np.maximum(scale, borne)
        hidden = (scale > 0.0) & (scale <= tolerance * full_norm)
        near = hidden & (scale > ROUNDING * full_norm)
        scale[hidden] = 0.0
        shown = np.flatnonzero(scale)
        # Columns that say the same tie; the first in order wins, not the last bit of their norms.
        favour = 1.0 - _FAVOUR * np.arange(len(shown)) / max(len(shown), 1)
        norms = full_norm[shown] / favour
        R, pivots = _pivoted_r(X[:, shown] / norms)
        diagonal = np.abs(np.diag(R))
        rank = int(np.count_nonzero(diagonal > tolerance * np.max(diagonal, initial=0.0)))
        return cls(
            scale=scale,
            near=near,
            shown=shown,
            norms=norms,
            R=R,
            pivots=pivots,
            diagonal=diagonal,
            rank=rank,
        )

    @property
    def independent(self) -> NDArray[np.int_]:
        """Numbers of the columns that are kept, ascending."""
        return np.sort(self.shown[self.pivots[: self.rank]])


def _pivoted_r(X: Array) -> tuple[Array, NDArray[np.int_]]:
    """Return the R of the pivoted QR of X, without zero rows, and the pivots."""
    if 0 in X.shape:
        return np.zeros((0, X.shape[1])), np.arange(X.shape[1])
    factors: Any = qr(X, mode="r", pivoting=True)
    R, pivots = factors
    return R[: min(R.shape)], pivots
