"""Products of rows with later rows: what the covariance of an estimate needs of correlated errors.

In: blocks of columns and residuals, stretch by stretch of rows at a constant rate. Out: for each
joint and lag, sums of products of columns, and of residuals.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

RowBlock = tuple[bool, np.ndarray, np.ndarray, np.ndarray]
"""Whether a new stretch begins; columns (T, n, p); residual (T, n); mask of what counts (T, n)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedProducts:
    """Sums over pairs of rows that lie some lags apart.

    Attributes
    ----------
    columns : (n, K + 1, p, p) sums of x(t) x(t + k)' of each joint, k = 0 ... K.
    residual : (n, K + 1) sums of e(t) e(t + k).
    pairs : (n, K + 1) number of such pairs at each joint, of rows that both count.
    """

    columns: np.ndarray
    residual: np.ndarray
    pairs: np.ndarray

    @property
    def lags(self) -> int:
        """The longest lag, K."""
        return self.pairs.shape[1] - 1


def lagged_products(blocks: Iterable[RowBlock], lags: int) -> LaggedProducts:
    """Sum products over rows and those that follow them in the same stretch.

    Parameters
    ----------
    blocks : consecutive rows; those of other stretches are never paired.
    lags : K, the longest lag in rows.

    Returns
    -------
    The sums over all stretches.

    Raises
    ------
    ValueError
        If there is no block.
    """
    found: LaggedProducts | None = None
    before = np.zeros((0, 0, 0))
    for begins, columns, residual, counts in blocks:
        # Joint by joint, the residual beside the columns: one matrix product each. What does not
        # count stays as rows of zeros, so that lags remain lags.
        beside = np.stack([residual, np.ones_like(residual)], axis=2)
        here = np.concatenate([columns, beside], axis=2) * counts[:, :, None]
        here = here.transpose(1, 0, 2)
        n, _, m = here.shape
        if found is None:
            found = LaggedProducts(
                columns=np.zeros((n, lags + 1, m - 2, m - 2)),
                residual=np.zeros((n, lags + 1)),
                pairs=np.zeros((n, lags + 1)),
            )
        if begins:
            before = here[:, :0]
        rows, old = np.concatenate([before, here], axis=1), before.shape[1]
        for k in range(lags + 1):
            # Pairs that end in this block; those before it are counted already.
            late = rows[:, max(old, k) :]
            early = rows[:, max(old, k) - k : rows.shape[1] - k]
            if not late.shape[1]:
                continue
            found.columns[:, k] += early[:, :, :-2].transpose(0, 2, 1) @ late[:, :, :-2]
            found.residual[:, k] += np.einsum("jt,jt->j", early[:, :, -2], late[:, :, -2])
            found.pairs[:, k] += np.einsum("jt,jt->j", early[:, :, -1], late[:, :, -1])
        before = rows[:, max(0, rows.shape[1] - lags) :]
    if found is None:
        raise ValueError("no rows")
    return found
