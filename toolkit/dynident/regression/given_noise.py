"""Input noise as it is given: one variance, one for each input, or a covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import FitError

_ROUNDING = 1e-9  # of the largest variance, below which an eigenvalue is no proof of a mistake


def covariance_of(noise: ArrayLike, inputs: int) -> np.ndarray:
    """Return the covariance of the inputs' noise, (d, d).

    Parameters
    ----------
    noise : a variance for all inputs, (d,) variances, or (d, d).
    inputs : d.

    Raises
    ------
    FitError
        If it has another shape, or is no covariance.
    """
    given = _numbers(noise)
    if given.shape not in ((), (inputs,), (inputs, inputs)):
        what = f"input noise of shape {given.shape} for {inputs} inputs"
        raise FitError(what, remedy=f"give a variance, ({inputs},) or ({inputs}, {inputs})")
    psi = given if given.ndim == 2 else np.diag(np.broadcast_to(given, (inputs,)))
    rounding = _ROUNDING * np.abs(psi).max(initial=0.0)
    sound = bool(np.all(np.isfinite(psi))) and np.allclose(psi, psi.T, rtol=0, atol=rounding)
    if not sound or np.linalg.eigvalsh(psi).min(initial=0.0) < -rounding:
        what = "the input noise is no covariance"
        raise FitError(what, remedy="give variances that are not negative, symmetric where (d, d)")
    return (psi + psi.T) / 2


def variances_of(noise: ArrayLike | None, inputs: int) -> np.ndarray:
    """Return the variance of each input's noise, (d,), NaN where it is not known.

    Parameters
    ----------
    noise : None where none is known; else as of `covariance_of`, with NaN among variances for
        single inputs whose noise is not known.
    inputs : d.

    Raises
    ------
    FitError
        As `covariance_of`.
    """
    if noise is None:
        return np.full(inputs, np.nan)
    given = _numbers(noise)
    if given.shape == (inputs,):
        unknown = np.isnan(given)
        known = covariance_of(np.where(unknown, 0.0, given), inputs)
        return np.where(unknown, np.nan, np.diag(known))
    return np.diag(covariance_of(given, inputs)).copy()


def _numbers(noise: ArrayLike) -> np.ndarray:
    try:
        return np.asarray(noise, dtype=float)
    except (TypeError, ValueError):
        what = f"input noise {noise!r} is no number, and no array of numbers"
        raise FitError(what, remedy="give variances, or a covariance") from None
