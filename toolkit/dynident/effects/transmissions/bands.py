"""Recursions in time as triangular band matrices."""

from __future__ import annotations

import numpy as np


def solve_band(band: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve A x = right for a lower triangular A of few diagonals, exactly and in LAPACK.

    Parameters
    ----------
    band : (d, T) its diagonals: band[i - j, j] = A[i, j].
    right : (T,)
    """
    from scipy.linalg import get_lapack_funcs

    (solve,) = get_lapack_funcs(("tbtrs",), (band, right))
    return solve(band, right[:, None], uplo="L")[0][:, 0]
