"""Second moments of columns that are given row by row."""

from __future__ import annotations

import numpy as np

from dynident.moments.replicates import Kind, in_blocks, replicate_moments
from dynident.moments.second_moments import SecondMoments


def row_moments(
    left: np.ndarray, right: np.ndarray, edges: np.ndarray, kind: Kind
) -> SecondMoments:
    """Moments (B, a, b) of columns (P, S, a) and (P, S, b) of one recording.

    Parameters
    ----------
    left, right : columns at S instants in P replicates.
    edges : (B + 1,) first instant of each block, and S.
    kind : what the replicates are.
    """
    one, two = (in_blocks([rows.T[None] for rows in side], edges) for side in (left, right))
    return replicate_moments(one, two, np.diff(edges), kind)
