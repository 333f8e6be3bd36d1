"""Recursions in time as triangular band matrices."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np


def solve_band(band: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve A x = right for a lower triangular A of few diagonals, exactly and in LAPACK.

    Parameters
    ----------
    band : (d, T) its diagonals: band[i - j, j] = A[i, j].
    right : (T,)
    """
    return _solver()(band, right[:, None], uplo="L")[0][:, 0]


@cache
def _solver() -> Any:
    from scipy.linalg import get_lapack_funcs  # takes long to load

    return get_lapack_funcs(("tbtrs",))[0]
