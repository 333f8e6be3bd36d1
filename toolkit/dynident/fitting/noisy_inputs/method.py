"""A regression as a method of `di.fit`: the rows of all joints, each in units of its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from scipy import stats

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import LinearSolution, estimate_of, residual_std
from dynident.fitting.noisy_inputs.compressed import Compressed, OutputNoise, output_noise, sandwich
from dynident.fitting.noisy_inputs.encoder_noise import encoder_noise
from dynident.fitting.noisy_inputs.measured import InputNoise, input_noise
from dynident.fitting.noisy_inputs.posed import PIECES, PosedRegression, pose
from dynident.model import Model
from dynident.recording import Dataset
from dynident.tables import Table
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from dynident.regression.corrected import CorrectedLeastSquares
    from dynident.regression.statistics_regressor import StatisticsRegressor

_SIGMA = (
    f"sigma from the scatter between {PIECES} consecutive pieces of the data, for each parameter "
    f"by itself (the covariance has no more than {PIECES - 1} directions); the doubt of the input "
    "noise itself, and what the model lacks, are not in it."
)
_FOLDS = 5  # of the pieces, between which penalties are validated


@dataclass(frozen=True, eq=False)
class Regression:
    """One of the regressions that input noise is fought with, or compared in.

    Every row of the regression is one joint at one instant, in units of that joint's residual in
    least squares; there is no constant. Inputs are the model's parameters' columns.

    Parameters
    ----------
    estimator : "truncated", "ridge", "lasso", "pls", "stepwise", "total", "corrected", "factors",
        "bayes"; or an estimator of `fit.regression` that is set up otherwise. What is taken as
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
        """Fit a model whose shape parameters are what they are.

        Columns that depend on the model's own values are taken where least squares settles.

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
        first = posed.first
        solution = LinearSolution(
            posed.basis.lift(found.values, posed.model.given_values()),
            covariance,
            posed.basis,
            first.torque_std,
            first.condition_number,
            (*first.notes, *found.notes),
        )
        solution = replace(solution, torque_std=residual_std(posed.factors, solution))
        estimate = estimate_of(found.words, "joint", posed.model, dataset, posed.factors, solution)
        return replace(
            estimate, status=found.status, details=found.details, sigma_words=found.sigma
        )

    @single_threaded
    def regressor(self, model: Model, dataset: Dataset) -> StatisticsRegressor:
        """Return the fitted estimator itself, its inputs named as the parameters are.

        It knows more than an estimate holds: `start_sensitivity` and `reliability_profile` take
        it, and say what the data tell of the noise in the inputs. Its standard deviations are from
        the scatter between pieces of the data, as those of the estimate.

        Raises
        ------
        FitError
            As `fit`; or if the regression is one of scikit-learn's.
        """
        regressor = self._own()
        if regressor is None:
            what = f"{self.estimator} is scikit-learn's, fitted to compressed rows"
            raise FitError(
                what, remedy="choose bayes, factors, corrected, truncated, stepwise or total"
            )
        posed = pose(model, dataset)
        return _fitted(regressor, posed, self._psi(posed, dataset))

    def _own(self) -> StatisticsRegressor | None:
        """Return this room's estimator of that name; None if it is scikit-learn's."""
        from dynident.fitting.noisy_inputs.named import NAMES, own

        if not isinstance(self.estimator, str):
            return self.estimator
        if self.estimator not in NAMES:
            what = f"no regression '{self.estimator}'"
            raise FitError(what, remedy=f"choose {', '.join(NAMES)}")
        return own(self.estimator)

    def _found(self, posed: PosedRegression, dataset: Dataset) -> _Found:
        from dynident.fitting.noisy_inputs.named import validated

        regressor = self._own()
        if regressor is not None:
            psi = self._psi(posed, dataset)
            return _told(_fitted(regressor, posed, psi), posed.compressed, psi)
        assert isinstance(self.estimator, str)
        if not (isinstance(self.noise, str) and self.noise == "none"):
            what = f"{self.estimator} has no place for the noise of its inputs"
            raise FitError(what, remedy="leave it out, or choose corrected, factors or bayes")
        compressed = posed.compressed
        scale = np.sqrt(np.mean(compressed.X**2, axis=0))
        folds = compressed.piece * _FOLDS // (compressed.piece.max() + 1)
        unit = replace(compressed, X=compressed.X / scale, piece=folds)
        chosen = validated(self.estimator, unit)
        notes = (
            f"{self.estimator}, {chosen.choice}, chosen between {_FOLDS} consecutive pieces of "
            "the data. No intervals: they would have to carry the bias of the penalty.",
        )
        words = f"{self.estimator} regression"
        return _Found(chosen.coefficients / scale, None, words, "solved", notes, ())

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


@dataclass(frozen=True, eq=False)
class _Found:
    """What a regression found of the parameters that the data identify."""

    values: np.ndarray
    covariance: np.ndarray | None
    words: str
    status: str
    notes: tuple[str, ...]
    details: tuple[Table, ...]

    @property
    def sigma(self) -> str:
        """What its standard deviations hold, in words."""
        return _SIGMA if self.covariance is not None else ""


def _fitted(
    regressor: StatisticsRegressor, posed: PosedRegression, psi: np.ndarray | None
) -> StatisticsRegressor:
    """Fit one of this room's estimators to the statistics."""
    from dynident.regression.corrected import CorrectedLeastSquares
    from dynident.regression.joint_factors import JointFactorRegression
    from dynident.regression.statistics_regressor import StatisticsRegressor

    if not isinstance(regressor, StatisticsRegressor):
        what = f"a {type(regressor).__name__} is no regression from sufficient statistics"
        raise FitError(what, remedy="name one, or give an estimator of dynident.fitting.regression")
    if np.any(getattr(regressor, "input_noise", None)):
        what = "the estimator's own input_noise is in units that only its rows have"
        raise FitError(what, remedy="give it as noise = of Regression")
    regressor = regressor.another(fit_intercept=False)
    takes_noise = isinstance(regressor, CorrectedLeastSquares | JointFactorRegression)
    if psi is not None and not takes_noise:
        what = f"{regressor.words} has no place for the noise of its inputs"
        raise FitError(what, remedy="leave it out, or choose corrected, factors or bayes")
    if psi is None and isinstance(regressor, CorrectedLeastSquares):
        remedy = 'state noise = "repeats" or "encoders"'
        raise FitError("corrected least squares needs the noise of the inputs", remedy=remedy)
    if psi is not None:
        regressor.set_params(input_noise=psi)
    names = [posed.model.names[i] for i in posed.kept]
    found = regressor.named(names).fit_statistics(posed.compressed.statistics)
    if psi is not None:
        _cluster(found, posed.compressed, psi)
    return found


def _cluster(regressor: StatisticsRegressor, compressed: Compressed, psi: np.ndarray) -> None:
    """Take standard deviations from the scatter between pieces: rows are not independent."""
    from dynident.regression.corrected import CorrectedLeastSquares
    from dynident.regression.joint_factors import JointFactorRegression

    if isinstance(regressor, CorrectedLeastSquares):
        regressor.covariance_ = sandwich(compressed, regressor.coef_, psi)
        regressor.sigma_ = np.sqrt(np.diag(regressor.covariance_))
    elif isinstance(regressor, JointFactorRegression) and regressor.corrected_ is not None:
        corrected = regressor.corrected_
        _cluster(corrected, compressed, psi)
        regressor.sigma_true_ = np.hypot(corrected.sigma_, regressor.coef_true_ - corrected.coef_)


def _told(regressor: StatisticsRegressor, compressed: Compressed, psi: np.ndarray | None) -> _Found:
    """Take from a fitted estimator what an estimate holds."""
    from dynident.regression.corrected import CorrectedLeastSquares
    from dynident.regression.joint_factors import JointFactorRegression
    from dynident.regression.summary import summary

    words = regressor.words
    if isinstance(regressor, CorrectedLeastSquares):
        assert psi is not None
        notes = _worth(regressor, output_noise(compressed, regressor.coef_, psi))
        return _Found(regressor.coef_, regressor.covariance_, words, "solved", notes, ())
    if isinstance(regressor, JointFactorRegression):
        status, table, true = regressor.ending_, summary(regressor), regressor.coef_true_
        if psi is None or regressor.corrected_ is None:
            return _Found(true, None, words, status, (), table)
        away = true - regressor.corrected_.coef_
        covariance = regressor.corrected_.covariance_ + np.outer(away, away)
        return _Found(true, covariance, words, status, (), table)
    alone = "No intervals: they would have to carry what the noise of the inputs does."
    return _Found(regressor.coef_, None, words, "solved", (alone,), ())


def _worth(regressor: CorrectedLeastSquares, noise: OutputNoise) -> tuple[str, ...]:
    """What corrected least squares rests on, in words."""
    from dynident.regression.corrected import LEAST_SHARE

    notes = [
        "What is left of X'X when the input noise is taken off: "
        f"{100 * regressor.signal_share_:.3g} % in the worst direction, condition number "
        f"{regressor.condition_number_:.3g}. Right if that noise is independent of the motion; "
        "in a closed loop the robot moves with a part of it, which sigma does not hold.",
    ]
    doubt = regressor.signal_share_doubt_
    if regressor.signal_share_ < LEAST_SHARE * doubt:
        notes.append(
            f"That share is known to {100 * doubt:.2g} % only: intervals along that direction are "
            "too narrow."
        )
    t = float(stats.t.ppf(0.95, PIECES - 1))
    if noise.variance < -t * noise.sigma:
        notes.insert(
            0,
            "The input noise is overstated: it would leave the torque a variance of "
            f"{noise.variance:.2g} +- {noise.sigma:.1g} of what least squares leaves.",
        )
    return tuple(notes)
