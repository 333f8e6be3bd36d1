"""The regressions by name: this room's own, and scikit-learn's with their penalty validated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.cross_decomposition import PLSRegression
from sklearn.linear_model import LassoCV, RidgeCV
from sklearn.model_selection import GridSearchCV, PredefinedSplit

from dynident.errors import FitError
from dynident.fitting.noisy_inputs.compressed import Compressed
from dynident.regression.corrected import CorrectedLeastSquares
from dynident.regression.joint_factors import BayesianFactorRegression, JointFactorRegression
from dynident.regression.statistics_regressor import StatisticsRegressor
from dynident.regression.stepwise import StepwiseRegression
from dynident.regression.total import TotalLeastSquares
from dynident.regression.truncated import TruncatedLeastSquares

_PENALTIES = np.logspace(-10, 2, 49)  # of ridge regression, relative to the inputs' own squares
_COMPONENTS = 40  # of partial least squares, at most


@dataclass(frozen=True, eq=False)
class Validated:
    """What cross-validation chose.

    Attributes
    ----------
    coefficients : (p,) for standardised inputs, in the output's unit.
    choice : in words.
    """

    coefficients: np.ndarray
    choice: str


def own(name: str) -> StatisticsRegressor | None:
    """Return this room's estimator of a name, for a regression without a constant, or None."""
    made: dict[str, Callable[[], StatisticsRegressor]] = {
        "truncated": lambda: TruncatedLeastSquares(fit_intercept=False),
        "total": lambda: TotalLeastSquares(fit_intercept=False),
        "stepwise": lambda: StepwiseRegression(fit_intercept=False),
        "corrected": lambda: CorrectedLeastSquares(fit_intercept=False),
        "factors": lambda: JointFactorRegression(queries="noiseless", fit_intercept=False),
        "bayes": lambda: BayesianFactorRegression(queries="noiseless", fit_intercept=False),
    }
    return made[name]() if name in made else None


def validated(name: str, rows: Compressed) -> Validated:
    """Fit one of scikit-learn's regressions, its penalty chosen between the pieces of the data.

    Parameters
    ----------
    name : "ridge", "lasso" or "pls".
    rows : with standardised inputs, of at least two pieces.

    Raises
    ------
    FitError
        If there is no such regression.
    """
    X, y, split = rows.X, rows.y, PredefinedSplit(rows.piece)
    found: Any
    if name == "ridge":
        # The inputs have variance one: their squares sum up to the number of rows.
        found = RidgeCV(
            _PENALTIES * len(X),
            fit_intercept=False,
            cv=split,
            scoring="neg_mean_squared_error",
        ).fit(X, y)
        penalty = found.alpha_ / len(X)
        border = ", the end of what was tried" if penalty in (_PENALTIES[0], _PENALTIES[-1]) else ""
        return Validated(found.coef_, f"penalty {penalty:.3g} of the squares{border}")
    if name == "lasso":
        found = LassoCV(eps=1e-5, fit_intercept=False, cv=split, max_iter=100_000, tol=1e-6)
        found.fit(X, y)
        left = int(np.sum(found.coef_ != 0))
        return Validated(found.coef_, f"penalty {found.alpha_:.3g}, {left} inputs left")
    if name == "pls":
        components = {"n_components": np.arange(1, min(X.shape[1], _COMPONENTS) + 1)}
        search = GridSearchCV(
            PLSRegression(scale=False), components, cv=split, scoring="neg_mean_squared_error"
        ).fit(X, y)
        count = search.best_params_["n_components"]
        border = ", the most that were tried" if count == _COMPONENTS else ""
        return Validated(np.ravel(search.best_estimator_.coef_), f"{count} components{border}")
    remedy = f"choose {', '.join(NAMES)}"
    raise FitError(f"no regression '{name}'", remedy=remedy)


NAMES = (
    "truncated",
    "ridge",
    "lasso",
    "pls",
    "stepwise",
    "total",
    "corrected",
    "factors",
    "bayes",
)
"""Regressions that `Regression` knows by name."""
