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
from scipy.linalg import get_lapack_funcs

from dynident.moments.second_moments import SecondMoments

RANK_TOLERANCE = 3e-5
"""Share of the largest diagonal of R (unit columns) below which a direction is not shown.

The same number for structures, for fits and for the diagnosis, whose products of columns hold no
more than its square. What is seen by less of itself than this, no measured torque tells: it is
below what the linearity of a torque sensor does by a factor of 10 or more. Angles of a description
that are off by less than this, as pi / 2 written 1.5708 (by 4e-6), show nothing either; written
1.571 (by 2e-4) they do, with sigma to match.
"""

_ROWS = 1024  # factorised at a time: few enough to stay in the cache
_PANEL = 8  # columns of a step of the factorisation; 4 to 16 take the same time
(_fold_in,) = get_lapack_funcs(("tpqrt",))


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

    Rows that are zero throughout say nothing, and are not counted.

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
    folded: list[_Fold] = []
    counts = np.zeros(0, dtype=int)
    size = 0
    for columns, torque in blocks:
        rows, n, p = columns.shape
        if not folded:
            folded, size, counts = [_Fold() for _ in range(n)], p + 1, np.zeros(n, dtype=int)
        for j, one in enumerate(folded):
            one.add(columns[:, j], torque[:, j])
            counts[j] += rows - _empty(columns[:, j], torque[:, j])
        del columns  # whose memory may be used for the next block
    if not folded:
        raise ValueError("no rows")
    return TriangularFactors(np.stack([one.triangle(size) for one in folded]), counts, instruments)


def _empty(columns: np.ndarray, torque: np.ndarray) -> int:
    """How many rows of columns (T, p) and torque (T,) are zero throughout."""
    nothing = np.flatnonzero(torque == 0.0)
    return int(np.count_nonzero(~columns[nothing].any(axis=1))) if len(nothing) else 0


class _Fold:
    """A triangular factor to which rows are added, of the columns that are not zero throughout.

    A joint bears the links beyond it alone: most of its columns are zero.
    """

    def __init__(self) -> None:
        self._used = np.zeros(0, dtype=bool)
        self._R = np.zeros((0, 0), order="F")
        self._rows = np.zeros((0, 0), order="F")

    def add(self, columns: np.ndarray, torque: np.ndarray) -> None:
        """Add rows (T, p) and their torque (T,)."""
        self._use(columns)
        names = np.flatnonzero(self._used)
        width = len(names)
        for start in range(0, len(torque), _ROWS):
            part = slice(start, start + _ROWS)
            count = len(torque[part])
            if self._rows.shape != (count, width + 1):
                self._rows = np.empty((count, width + 1), order="F")
            buffer = self._rows
            # Column by column: of a block each lies in one piece.
            for k, name in enumerate(names):
                buffer[:, k] = columns[part, name]
            buffer[:, width] = torque[part]
            panel = min(_PANEL, width + 1)
            self._R = _fold_in(0, panel, self._R, buffer, overwrite_a=1, overwrite_b=1)[0]

    def triangle(self, size: int) -> np.ndarray:
        """The factor of all columns, (size, size)."""
        kept = np.append(np.flatnonzero(self._used), size - 1)
        R = np.zeros((size, size))
        R[np.ix_(kept, kept)] = np.triu(self._R)
        return R

    def _use(self, columns: np.ndarray) -> None:
        """Make room for columns that are not zero for the first time."""
        if not len(self._used):
            self._used = np.zeros(columns.shape[1], dtype=bool)
            self._R = np.zeros((1, 1), order="F")
        more = self._used.copy()
        for name in np.flatnonzero(~more):
            column = columns[:, name]
            more[name] = len(column) and (column[0] != 0.0 or column.any())
        if np.array_equal(more, self._used):
            return
        old = np.append(np.flatnonzero(self._used), len(more))
        new = np.append(np.flatnonzero(more), len(more))
        wider, place = np.zeros((len(new), len(new)), order="F"), np.searchsorted(new, old)
        wider[np.ix_(place, place)] = np.triu(self._R)
        self._used, self._R = more, wider


def combine(parts: Sequence[TriangularFactors]) -> TriangularFactors:
    """Return the factors of all parts' rows together, group by group."""
    if len(parts) == 1:
        return parts[0]
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
