"""Whether joint factor analysis may take the inputs as independent: the data can refute it."""

from __future__ import annotations

import numpy as np
from scipy import stats

from dynident.errors import FitError
from dynident.fit.regression.corrected import CorrectedLeastSquares
from dynident.fit.regression.statistics import Statistics

_LEVEL = 0.05


def independent(unit: Statistics, coefficients: np.ndarray, noise: np.ndarray) -> bool:
    """Return whether coefficients agree with corrected least squares, which allows correlation.

    With independent inputs both are consistent, else only the latter is: a specification test
    (Hausman, "Specification Tests in Econometrics", 1978), Bonferroni-corrected at 5 %.

    Parameters
    ----------
    unit : statistics of the inputs, standardised.
    coefficients : (d,) b_true of joint factor analysis.
    noise : (d,) variances of the inputs' noise.
    """
    try:
        corrected = CorrectedLeastSquares(noise, fit_intercept=False).fit_statistics(unit)
    except FitError:
        return False
    apart = np.abs(corrected.coef_ - coefficients)
    limit = stats.norm.isf(_LEVEL / (2 * max(len(apart), 1)))
    return bool(np.all(apart <= limit * corrected.sigma_))
