"""The steps in which an encoder counts."""

from __future__ import annotations

import numpy as np

_WHOLE = 0.05
"""Steps by which a position may miss a whole number of them."""


def resolution(q: np.ndarray) -> np.ndarray:
    """Steps on whose multiples recorded positions lie.

    Parameters
    ----------
    q : (T, n) rad or m.

    Returns
    -------
    (n,) rad or m; zero at joints whose positions lie on no lattice.
    """
    return np.array([_step(column) for column in np.asarray(q, dtype=float).T])


def _step(x: np.ndarray) -> float:
    seen = np.unique(x)
    gaps = np.diff(seen)
    gaps = gaps[gaps > 1e-9 * max(float(np.ptp(seen)), 1e-300)]
    if len(gaps) == 0:
        return 0.0
    # The smallest gap is rounded as numbers are; the mean over all gaps is not.
    steps = np.round(gaps / gaps.min())
    step = float(gaps.sum() / steps.sum())
    count = (seen - seen[0]) / step
    return step if np.all(np.abs(count - np.round(count)) < _WHOLE) else 0.0
