"""Rows within a window, and rows in which a joint moves.

Each mask is a boolean array, True for what is kept.
"""

from __future__ import annotations

import numpy as np

from dynident.errors import RecordingError


def within(
    t: np.ndarray, t0: float | None = None, t1: float | None = None, where: str | None = None
) -> np.ndarray:
    """Rows with t0 <= t < t1, so that windows that touch share no row.

    For a window of a study apply it to the decimated rows, after the whole was filtered.

    Parameters
    ----------
    t : (T,) s, increasing.
    t0, t1 : s, on the clock of `t`; None leaves that side open.
    where : file, for messages.

    Returns
    -------
    (T,) bool.

    Raises
    ------
    RecordingError
        If the window is empty, or holds none of the rows.
    """
    # A stamp that rounding has put just before a limit belongs after it.
    slack = 1e-3 * (t[-1] - t[0]) / (len(t) - 1) if len(t) > 1 else 0.0
    low = -np.inf if t0 is None else float(t0)
    high = np.inf if t1 is None else float(t1)
    window = f"the window [{low:g}, {high:g}] s"
    if not low < high:
        raise RecordingError(f"{window} is empty", where, "give its start before its end")
    kept = (t >= low - slack) & (t < high - slack)
    if not kept.any():
        span = f"time runs from {t[0]:g} to {t[-1]:g} s" if len(t) else "nothing is recorded"
        raise RecordingError(f"{window} holds no samples", where, span)
    return kept


def moving(v: np.ndarray, threshold: float | np.ndarray) -> np.ndarray:
    """Samples that are faster than a threshold, where the sign of the speed is certain.

    Parameters
    ----------
    v : (T, n) rad/s or m/s.
    threshold : one for all joints, or (n,), in the units of v.

    Returns
    -------
    (T, n) bool; `.all(1)` for the rows in which every joint moves.
    """
    return np.abs(v) > threshold
