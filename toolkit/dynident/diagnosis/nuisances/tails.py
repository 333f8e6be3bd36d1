"""How probable large values are in noise whose tails are heavier than a normal variable's."""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student

QUARTER = 0.6745
"""Median of the absolute value of a standard normal variable."""

_TAILS = (0.95, 0.99, 0.997)  # quantiles at which tails are measured
_LEAST_IN_TAIL = 5  # values beyond a quantile that show it
_DEGREES = np.array([3.0, 4, 5, 6, 8, 10, 14, 20, 30, 60, 200])  # of freedom: how heavy tails are


def degrees_of_freedom(z: np.ndarray) -> float:
    """Degrees of freedom of Student's distribution with tails like these, at their heaviest."""
    middle = max(float(np.median(z)), 1e-300)
    quarter = student.ppf(0.75, _DEGREES)
    return min(
        float(np.interp(-value / middle, -student.ppf(0.5 + q / 2, _DEGREES) / quarter, _DEGREES))
        for q, value in zip(_TAILS, np.quantile(z, _TAILS), strict=True)
        if (1 - q) * len(z) >= _LEAST_IN_TAIL or q == _TAILS[0]
    )


def chance_of(z: float, degrees: float, width: float) -> float:
    """Probability of a value as large as z at one place.

    A bump of many rows is a mean of so many samples, whose excess kurtosis falls with their number;
    half of them count, because noise comes in flocks.
    """
    more = max(degrees - 4.0, 0.5) * max(1.0, width / 2)
    wide = max(degrees, 4.0 + more) if width > 2 else degrees
    return 2 * float(student.sf(z * student.ppf(0.75, wide) / QUARTER, wide))
