"""A regression as a method of `di.fit`: the rows of all joints, each in units of its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import estimate_of
from dynident.fitting.linear_solution import residual_std
from dynident.fitting.noisy_inputs.encoder_noise import encoder_noise
from dynident.fitting.noisy_inputs.measured import InputNoise, input_noise
from dynident.fitting.noisy_inputs.posed import PIECES, PosedRegression, pose
from dynident.fitting.reversals.standing_joints import without_stops
from dynident.model import Model
from dynident.recording import Dataset
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from dynident.fitting.noisy_inputs.regressors import RegressionResult
    from dynident.regression.statistics_regressor import StatisticsRegressor

_SIGMA = (
    f"sigma from the scatter between {PIECES} consecutive pieces of the data, for each parameter "
    f"by itself (the covariance has no more than {PIECES - 1} directions); the doubt of the input "
    "noise itself, and what the model lacks, are not in it."
)


@dataclass(frozen=True, eq=False)
class Regression:
    """One of the regressions that input noise is fought with, or compared in.

    Every row of the regression is one joint at one instant, in units of that joint's residual in
    least squares; there is no constant. Inputs are the model's parameters' columns.

    Parameters
    ----------
    estimator : "truncated", "ridge", "lasso", "pls", "stepwise", "total", "corrected", "factors",
        "bayes"; or an estimator of `dynident.regression` that is set up otherwise. What is taken as
        the parameters is b_true.
    noise : of the inputs: "none" is known; "repeats" measures it on recordings that repeat;
        "encoders" carries the stated noise of the encoders through the filters; or an
        `InputNoise`. Corrected least squares needs one.
    """

    estimator: str | StatisticsRegressor = "bayes"
    noise: Literal["none", "repeats", "encoders"] | InputNoise = "none"
    name: ClassVar[str] = "regression"

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are fixed.

        Columns that depend on the model's own values are taken where least squares converges.

        Raises
        ------
        FitError
            If there is no such regression, it needs an input noise that is not given, or the data
            cannot carry the model.
        """
        posed = pose(model, dataset)
        found = self._found(posed, dataset)
        covariance = np.zeros((posed.model.size, posed.model.size))
        if found.covariance is not None:
            covariance[np.ix_(posed.kept, posed.kept)] = found.covariance
        solution = replace(
            posed.first,
            values=posed.basis.lift(found.values, posed.model.given_values()),
            covariance=covariance,
            basis=posed.basis,
            notes=(*posed.first.notes, *found.notes),
        )
        solution = replace(
            solution, torque_std=residual_std(posed.factors, solution.values, solution.basis.rank)
        )
        estimate = estimate_of(found.words, "joint", posed.model, dataset, posed.factors, solution)
        return replace(
            estimate,
            status=found.status,
            details=found.details,
            sigma_words="" if found.covariance is None else _SIGMA,
        )

    @single_threaded
    def regressor(self, model: Model, dataset: Dataset) -> StatisticsRegressor:
        """Return the fitted estimator itself, its inputs named as the parameters are.

        It knows more than an estimate holds: `start_sensitivity` and `reliability_profile` take
        it, and say what the data show of the noise in the inputs. Its standard deviations are from
        the scatter between pieces of the data, as those of the estimate.

        Raises
        ------
        FitError
            As `fit`; or if the regression is one of scikit-learn's.
        """
        from dynident.fitting.noisy_inputs.regressors import fitted, named

        regressor = named(self.estimator)
        if regressor is None:
            what = f"{self.estimator} is scikit-learn's, fitted to rows"
            raise FitError(
                what, remedy="choose bayes, factors, corrected, truncated, stepwise or total"
            )
        dataset = without_stops(model, dataset)
        posed = pose(model, dataset)
        return fitted(regressor, posed, self._psi(posed, dataset))

    def _found(self, posed: PosedRegression, dataset: Dataset) -> RegressionResult:
        from dynident.fitting.noisy_inputs.regressors import found_by, found_by_validation, named

        regressor = named(self.estimator)
        if regressor is not None:
            return found_by(regressor, posed, self._psi(posed, dataset))
        assert isinstance(self.estimator, str)
        if not (isinstance(self.noise, str) and self.noise == "none"):
            what = f"{self.estimator} has no place for the noise of its inputs"
            raise FitError(what, remedy="leave it out, or choose corrected, factors or bayes")
        return found_by_validation(self.estimator, posed)

    def _psi(self, posed: PosedRegression, dataset: Dataset) -> np.ndarray | None:
        """Covariance of the inputs' noise in a row; None where it is not known."""
        noise = self._noise(posed.model, dataset, posed.values)
        if noise is None:
            return None
        return noise.per_row(posed.model.names)[np.ix_(posed.kept, posed.kept)]

    def _noise(
        self, model: Model, dataset: Dataset, values: np.ndarray | None
    ) -> InputNoise | None:
        if isinstance(self.noise, InputNoise):
            return self.noise
        if self.noise == "repeats":
            return input_noise(model, dataset, values)
        if self.noise == "encoders":
            return encoder_noise(model, dataset, values)
        if self.noise != "none":
            what = f"noise = {self.noise!r} of the inputs"
            raise FitError(what, remedy="choose none, repeats or encoders, or give an InputNoise")
        return None
