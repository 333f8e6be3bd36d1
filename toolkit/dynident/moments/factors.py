"""Sufficient statistics of a linear fit: one triangular factor per joint.

Blocks of rows are folded into the R of a QR factorisation of [columns, torque], joint by joint, so
that neither the regressor nor the torque is ever kept, no squared condition number enters, and the
joints can be weighted afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_ROWS = 512  # factorised at a time: few enough to stay in the cache


@dataclass(frozen=True)
class TriangularFactors:
    """R factors of the rows seen so far.

    Attributes
    ----------
    R : (n, p + 1, p + 1), upper triangular; the last column belongs to the torque.
    counts : (n,) rows per joint.
    """

    R: np.ndarray
    counts: np.ndarray

    @property
    def rows(self) -> int:
        """Rows of all joints."""
        return int(self.counts.sum())

    @property
    def torque_norms(self) -> np.ndarray:
        """Norm of the torque, per joint, (n,)."""
        return np.linalg.norm(self.R[:, :, -1], axis=1)

    def residual_norms(self, values: np.ndarray) -> np.ndarray:
        """Norm of torque - columns @ values, per joint, (n,)."""
        return np.linalg.norm(self.R @ np.append(-values, 1.0), axis=1)

    def pooled(self, weights: np.ndarray) -> np.ndarray:
        """R factor of all joints' rows, each multiplied by its joint's weight, (p + 1, p + 1)."""
        stacked = (self.R * np.asarray(weights)[:, None, None]).reshape(-1, self.R.shape[2])
        return _triangle(stacked)


def factorise(blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> TriangularFactors:
    """Fold blocks of rows into their factors.

    Parameters
    ----------
    blocks : iterable of (columns (T, n, p), torque (T, n))
        In any number and of any length.
    """
    R: np.ndarray | None = None
    counts = np.zeros(0, dtype=int)
    for columns, torque in blocks:
        rows, n, p = columns.shape
        if R is None:
            R, counts = np.zeros((n, p + 1, p + 1)), np.zeros(n, dtype=int)
        for start in range(0, rows, _ROWS):
            part = slice(start, start + _ROWS)
            for j in range(n):
                block = np.column_stack([columns[part, j], torque[part, j]])
                R[j] = _triangle(np.vstack([R[j], block]))
        counts += rows
    if R is None:
        raise ValueError("no rows")
    return TriangularFactors(R, counts)


def _triangle(rows: np.ndarray) -> np.ndarray:
    size = rows.shape[1]
    if len(rows) < size:
        rows = np.vstack([rows, np.zeros((size - len(rows), size))])
    return np.asarray(np.linalg.qr(rows, mode="r"))
