"""Second moments by their square root: the triangular factors of rows, group by group.

Blocks of rows are folded into the R of a QR factorisation of [instruments, regressor, torque], so
that neither the regressor nor the torque is ever kept and no condition number is squared. A group
is a joint, so that joints can be weighted afterwards, or a consecutive piece of the data, between
which estimates scatter.

What is solved by least squares or instrumental variables is solved on these. `SecondMoments` holds
the same sums as products: half the digits, but at the cost of one matrix product, and free of noise
where replicates distinguish it. A product of different replicates is indefinite and has no factor,
and a factorisation of every block costs several times the product that the regressions need: that
is why the two are two.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dynident.moments.second_moments import SecondMoments

RANK_TOLERANCE = 1e-8
"""Share of the largest diagonal of R (unit columns) below which data do not excite a direction."""

_ROWS = 512  # factorised at a time: few enough to stay in the cache


@dataclass(frozen=True, eq=False)
class TriangularFactors:
    """R factors of the rows seen so far, one for each group of rows.

    Attributes
    ----------
    R : (n, r, m), upper triangular as made, r = m; of m columns the last belongs to the torque.
    counts : (n,) rows of each group.
    instruments : number of the leading columns that are instruments: as many as the regressor
        has, or none.
    """

    R: np.ndarray
    counts: np.ndarray
    instruments: int = 0

    @property
    def rows(self) -> int:
        """Rows of all groups."""
        return int(self.counts.sum())

    @property
    def size(self) -> int:
        """Number of columns of the regressor, p."""
        return self.R.shape[2] - 1 - self.instruments

    @property
    def torque_norms(self) -> np.ndarray:
        """Norm of the torque, per group, (n,)."""
        return np.linalg.norm(self.R[:, :, -1], axis=1)

    def residual_norms(self, values: np.ndarray) -> np.ndarray:
        """Norm of torque - regressor @ values, per group, (n,)."""
        return self._left(np.concatenate([np.zeros(self.instruments), values]))

    def simulated_norms(self, values: np.ndarray) -> np.ndarray:
        """Norm of torque - instruments @ values, per group, (n,)."""
        return self._left(np.concatenate([values, np.zeros(self.size)]))

    def relative(self, norms: np.ndarray) -> float:
        """A residual over all groups, relative to the torque."""
        return float(np.linalg.norm(norms) / np.linalg.norm(self.torque_norms))

    def pooled(self, weights: np.ndarray) -> np.ndarray:
        """R factor of all groups' rows, each multiplied by its group's weight, (m, m)."""
        stacked = (self.R * np.asarray(weights)[:, None, None]).reshape(-1, self.R.shape[2])
        return _triangle(stacked)

    def keeping(self, columns: Sequence[int]) -> TriangularFactors:
        """Return the factors of some columns of the regressor and the torque."""
        kept = np.append(self.instruments + np.asarray(columns, dtype=int), self.R.shape[2] - 1)
        return TriangularFactors(self.R[:, :, kept], self.counts)

    def _left(self, values: np.ndarray) -> np.ndarray:
        return np.linalg.norm(self.R @ np.append(-values, 1.0), axis=1)


def factorise(
    blocks: Iterable[tuple[np.ndarray, np.ndarray]], instruments: int = 0
) -> TriangularFactors:
    """Fold blocks of rows into their factors, joint by joint.

    Parameters
    ----------
    blocks : iterable of (columns (T, n, p), torque (T, n))
        In any number and of any length.
    instruments : number of the leading columns that are instruments.

    Raises
    ------
    ValueError
        If there is no block.
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
    return TriangularFactors(R, counts, instruments)


def combine(parts: Sequence[TriangularFactors]) -> TriangularFactors:
    """Return the factors of all parts' rows together, group by group."""
    R = np.stack([_triangle(np.vstack(group)) for group in zip(*(p.R for p in parts), strict=True)])
    return TriangularFactors(R, np.sum([p.counts for p in parts], axis=0), parts[0].instruments)


def in_pieces(parts: Sequence[TriangularFactors], weights: np.ndarray) -> TriangularFactors:
    """Return one factor for each of some consecutive pieces of the data.

    Parameters
    ----------
    parts : of the pieces, joint by joint.
    weights : (n,) of each joint's rows.
    """
    R = np.stack([part.pooled(weights) for part in parts])
    return TriangularFactors(R, np.array([part.rows for part in parts]), parts[0].instruments)


def products_of(factors: TriangularFactors) -> SecondMoments:
    """Return the products, about zero, of all groups' rows."""
    stacked = factors.R.reshape(-1, factors.R.shape[2])
    return SecondMoments(stacked.T @ stacked, factors.rows)


def _triangle(rows: np.ndarray) -> np.ndarray:
    size = rows.shape[1]
    if len(rows) < size:
        rows = np.vstack([rows, np.zeros((size - len(rows), size))])
    return np.asarray(np.linalg.qr(rows, mode="r"))
