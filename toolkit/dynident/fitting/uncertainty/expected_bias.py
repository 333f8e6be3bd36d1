"""What an expected bias does to standard deviations, and its words, whoever foretells it."""

from __future__ import annotations

import numpy as np

from dynident.model import Model
from dynident.tables import number

_REPORTED = 0.2
"""Standard deviations of an estimate below which an expected bias is not reported."""


def reported(bias: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Numbers of the parameters whose expected bias is worth a word.

    Parameters
    ----------
    bias : (p,)
    sigma : (p,) standard deviations without it; NaN where there are none.
    """
    return np.flatnonzero(np.abs(bias) > _REPORTED * sigma)


def listed(model: Model, bias: np.ndarray, which: np.ndarray) -> str:
    """Return some of the biases with their units, in words.

    Parameters
    ----------
    model : of p parameters.
    bias : (p,)
    which : numbers of those to be listed.
    """
    return ", ".join(
        f"{model.names[i]} {number(float(bias[i]), 2)} {model.units[i]}" for i in which
    )


def held(covariance: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Return a covariance (p, p) with a bias (p,) in it: mean squares of the expected errors.

    Intervals of 1.96 sigma then hold the truth in 95 % or more, if the bias is what it is said.
    """
    return covariance + np.outer(bias, bias)
