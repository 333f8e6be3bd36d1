"""What the estimators of this room share: statistics in, coefficients and predictions out."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real
from typing import Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted, validate_data

from dynident.errors import FitError, warn
from dynident.moments import SecondMoments

_checked: Any = validate_data  # whose signature names strings only


class StatisticsRegressor(RegressorMixin, BaseEstimator):
    """Linear regression that needs count, means and scatter of the data, and no row twice.

    `partial_fit` adds rows to those seen before; `fit_statistics` takes the sum of statistics that
    were made elsewhere, recording by recording or on other machines. A subclass solves the
    standardised problem (`_solve`): inputs and output of mean zero and variance one, no constants.

    Attributes
    ----------
    words : what the estimator is called.
    coef_ : (d,) of `predict`.
    intercept_ : of `predict`.
    constant_ : (d,) bool, inputs without variation; their coefficients are zero.
    statistics_ : of all rows seen.
    """

    words: ClassVar[str]

    def __init__(self, *, fit_intercept: bool = True) -> None:
        self.fit_intercept = fit_intercept

    def another(self, **changed: Any) -> Self:
        """Return an estimator set up alike but for what is changed, not fitted."""
        return cast(Self, clone(cast(Any, self))).set_params(**changed)

    def named(self, names: Sequence[str]) -> Self:
        """Give the inputs names, which statistics do not carry."""
        self.feature_names_in_: np.ndarray = np.array(names, dtype=object)
        return self

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to rows X (N, d) and y (N,).

        Raises
        ------
        ValueError
            If the rows are fewer than two, not finite, or not numbers.
        FitError
            As the estimator says of its own.
        """
        statistics = self._statistics_of(X, y, reset=True)
        if statistics.count < 2:
            raise ValueError("n_samples = 1 says nothing of a slope: give at least two rows")
        return self.fit_statistics(statistics)

    def partial_fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Add rows X (N, d) and y (N,) to those seen before, and fit to all; raises as `fit`.

        While the rows are too few, no more than inputs, a warning says what is missing, and the
        estimator is not fitted. Each block is a fit: add `SecondMoments` up where only the last one
        is wanted.
        """
        first = not hasattr(self, "statistics_")
        here = self._statistics_of(X, y, reset=first)
        seen = here if first else self.statistics_ + here
        try:
            return self.fit_statistics(seen)
        except FitError as error:
            if hasattr(self, "coef_") or seen.count > seen.inputs + 1:
                raise
            warn(f"not fitted yet: {error}")
        self.statistics_ = seen
        return self

    def fit_statistics(self, statistics: SecondMoments) -> Self:
        """Fit to the sufficient statistics of the data.

        Raises
        ------
        FitError
            If they are of fewer than two rows, not finite, or as the estimator says of its own;
            an earlier fit then stands.
        """
        if statistics.count < 2:
            what = f"n_samples = {statistics.count} says nothing of a slope"
            raise FitError(what, remedy="give at least two rows")
        if not np.all(np.isfinite(statistics.total)) or not np.all(np.isfinite(statistics.centre)):
            raise FitError("the statistics are not finite", remedy="clean or scale the data first")
        before = dict(vars(self))
        try:
            self._fit(statistics)
        except BaseException:
            vars(self).clear()
            vars(self).update(before)
            raise
        return self

    def _fit(self, statistics: SecondMoments) -> None:
        used = statistics if self.fit_intercept else statistics.about_origin()
        scale = used.scale
        self.constant_ = scale[:-1] == 0
        inputs = np.flatnonzero(~self.constant_)
        varied = used.keeping(inputs)
        kept = np.append(scale[:-1][inputs], scale[-1] or 1.0)
        scatter = varied.scaled(1.0 / kept).total
        if scale[-1] == 0:
            scatter[-1], scatter[:, -1] = 0.0, 0.0  # of a constant output only rounding is left
        unit = SecondMoments(scatter, varied.count)
        self._scale, self._mean, self._seen = scale, used.centre, statistics
        self.n_features_in_ = statistics.inputs
        if len(getattr(self, "feature_names_in_", ())) not in (0, statistics.inputs):
            delattr(self, "feature_names_in_")
        self._solve(unit, inputs)
        self.statistics_ = statistics

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the output of rows X (N, d), (N,)."""
        check_is_fitted(self)
        rows = _checked(self, X, reset=False, dtype=np.float64)
        return rows @ self.coef_ + self.intercept_

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        """Set the attributes from standardised statistics of the inputs that vary, by number."""
        raise NotImplementedError

    def _freedom(self, unit: SecondMoments, used: int) -> int:
        """Degrees of freedom that some coefficients and the constant leave."""
        return unit.count - used - int(self.fit_intercept)

    def _set(self, coefficients: np.ndarray) -> None:
        """Set what `predict` uses: coefficients (d,) in the data's units."""
        self.coef_ = coefficients
        self.intercept_ = self._intercept(coefficients)

    def _intercept(self, coefficients: np.ndarray) -> float:
        return float(self._mean[-1] - self._mean[:-1] @ coefficients)

    def _in_units(self, standardised: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Coefficients (d,) in the data's units, of standardised ones of some inputs."""
        found = np.zeros(len(self._mean) - 1)
        found[inputs] = standardised * self._scale[-1] / self._scale[inputs]
        return found

    def _statistics_of(self, X: ArrayLike, y: ArrayLike, *, reset: bool) -> SecondMoments:
        rows, output = _checked(
            self, X, y, reset=reset, dtype=np.float64, y_numeric=True, ensure_min_samples=1
        )
        return SecondMoments.of(rows, output)

    def _require(self, setting: str, least: float, most: float) -> None:
        """Raise FitError unless a setting is a number, at least and at most so large."""
        value = getattr(self, setting)
        if not isinstance(value, Real) or not least <= float(value) <= most:
            remedy = f"choose a number from {least:g} to {most:g}"
            raise FitError(f"{setting} = {value!r}", remedy=remedy)

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "coef_")

    def input_names(self) -> list[str]:
        """Return the names of the inputs: those of the data frame, or x0, x1 and so on."""
        given: Any = getattr(self, "feature_names_in_", None)
        count = self.n_features_in_
        return [f"x{m}" for m in range(count)] if given is None else [str(name) for name in given]
