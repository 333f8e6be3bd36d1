"""A regression as a method of `di.fit`: the rows of all joints, each in units of its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from dynident.errors import FitError
from dynident.fit.encoder_noise import encoder_noise
from dynident.fit.estimate import Estimate
from dynident.fit.factors import Factors, factorise
from dynident.fit.input_noise import InputNoise, input_noise
from dynident.fit.least_squares import (
    LeastSquares,
    Solution,
    estimate_of,
    residual_std,
    solve_factors,
)
from dynident.fit.regression.compressed import Compressed, compress, sandwich
from dynident.fit.sampling import rows, sample
from dynident.model import Model
from dynident.recording import Dataset
from dynident.tables import Table
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from dynident.fit.regression.base import StatisticsRegressor
    from dynident.fit.regression.corrected import CorrectedLeastSquares

PIECES = 20
"""Consecutive pieces of the data, between which estimates scatter."""
_FOLDS = 5  # of these pieces, between which penalties are validated


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
        settled = LeastSquares().fit(model, dataset)
        model, basis = settled.model, settled.basis
        values = settled.values if model.needs_values else None
        pieces = _pieces(model, dataset, values)
        factors = _whole(pieces)
        first = solve_factors(model, factors)
        kept = list(basis.independent)
        compressed = compress(pieces, 1.0 / first.torque_std)
        compressed = replace(compressed, X=compressed.X[:, kept])
        found = self._regressed(model, dataset, values, compressed, kept)
        lifted = basis.lift(found.values, model.given_values())
        covariance = np.zeros((model.size, model.size))
        if found.covariance is not None:
            covariance[np.ix_(kept, kept)] = found.covariance
        solution = Solution(
            lifted,
            covariance,
            basis,
            first.torque_std,
            first.condition_number,
            (*first.notes, *found.notes),
        )
        solution = replace(solution, torque_std=residual_std(factors, solution))
        estimate = estimate_of(found.words, "joint", model, dataset, factors, solution)
        return replace(estimate, status=found.status, details=found.details)

    def _regressed(
        self,
        model: Model,
        dataset: Dataset,
        values: np.ndarray | None,
        compressed: Compressed,
        kept: list[int],
    ) -> _Found:
        from dynident.fit.regression.named import NAMES, own, validated

        regressor = own(self.estimator) if isinstance(self.estimator, str) else self.estimator
        if regressor is not None:
            noise = self._noise(model, dataset, values)
            psi = None if noise is None else noise.per_row(model.names)[np.ix_(kept, kept)]
            return _fitted(regressor, compressed, psi, tuple(model.names[i] for i in kept))
        if self.estimator not in NAMES:
            what = f"no regression '{self.estimator}'"
            raise FitError(what, mend=f"choose {', '.join(NAMES)}")
        assert isinstance(self.estimator, str)
        if not (isinstance(self.noise, str) and self.noise == "none"):
            what = f"{self.estimator} has no place for the noise of its inputs"
            raise FitError(what, mend="leave it out, or choose corrected, factors or bayes")
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
            raise FitError(what, mend="choose none, repeats or encoders, or give an InputNoise")
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


def _fitted(
    regressor: StatisticsRegressor,
    compressed: Compressed,
    psi: np.ndarray | None,
    names: tuple[str, ...],
) -> _Found:
    """Fit one of this room's estimators to the statistics."""
    from dynident.fit.regression.base import StatisticsRegressor
    from dynident.fit.regression.corrected import CorrectedLeastSquares
    from dynident.fit.regression.joint_factors import JointFactorRegression
    from dynident.fit.regression.summary import summary

    if not isinstance(regressor, StatisticsRegressor):
        what = f"a {type(regressor).__name__} is no regression from sufficient statistics"
        raise FitError(what, mend="name one, or give an estimator of dynident.fit.regression")
    if np.any(getattr(regressor, "input_noise", None)):
        what = "the estimator's own input_noise is in units that only its rows have"
        raise FitError(what, mend="give it as noise = of Regression")
    regressor, words = regressor.another(fit_intercept=False), regressor.words
    takes_noise = isinstance(regressor, CorrectedLeastSquares | JointFactorRegression)
    if psi is not None and not takes_noise:
        what = f"{words} has no place for the noise of its inputs"
        raise FitError(what, mend="leave it out, or choose corrected, factors or bayes")
    if psi is None and isinstance(regressor, CorrectedLeastSquares):
        mend = 'state noise = "repeats" or "encoders"'
        raise FitError("corrected least squares needs the noise of the inputs", mend=mend)
    if psi is not None:
        regressor.set_params(input_noise=psi)
    regressor.named(names).fit_statistics(compressed.statistics)
    if isinstance(regressor, CorrectedLeastSquares):
        assert psi is not None
        covariance = sandwich(compressed, regressor.coef_, psi)
        return _Found(regressor.coef_, covariance, words, "solved", _worth(regressor), ())
    if isinstance(regressor, JointFactorRegression):
        status, table, true = regressor.ending_, summary(regressor), regressor.coef_true_
        if psi is None or regressor.corrected_ is None:
            return _Found(true, None, words, status, (), table)
        covariance = sandwich(compressed, regressor.corrected_.coef_, psi)
        away = true - regressor.corrected_.coef_
        return _Found(true, covariance + np.outer(away, away), words, status, (), table)
    return _Found(regressor.coef_, None, words, "solved", ("No intervals.",), ())


def _worth(regressor: CorrectedLeastSquares) -> tuple[str, ...]:
    """What corrected least squares rests on, in words."""
    notes = (
        "What is left of X'X when the input noise is taken off: "
        f"{100 * regressor.signal_share_:.3g} % in the worst direction, condition number "
        f"{regressor.condition_number_:.3g}. Right if that noise is independent of the motion; "
        "in a closed loop the robot moves with a part of it.",
        f"sigma from the scatter between {PIECES} consecutive pieces of the data; the doubt of the "
        "input noise itself is not in it.",
    )
    if regressor.noise_variance_ < 0:
        overstated = "The input noise is overstated: it would leave the torque less than none."
        notes = (overstated, *notes)
    return notes


def _pieces(model: Model, dataset: Dataset, values: np.ndarray | None) -> list[Factors]:
    """Factors of consecutive pieces of the data, equally long to a row."""
    total = sum(len(sample(one, dataset.filter).t) for one in dataset.recordings)
    borders = np.round(np.arange(1, PIECES + 1) * total / PIECES).astype(int)
    pieces: list[list[Factors]] = [[] for _ in borders]
    first = 0
    for columns, torque in rows(model, dataset, values):
        last = first + len(torque)
        cuts = np.unique(np.clip(np.append(borders, [first, last]), first, last))
        for start, stop in pairwise(cuts):
            part = slice(start - first, stop - first)
            piece = int(np.searchsorted(borders, start, side="right"))
            pieces[piece].append(factorise([(columns[part], torque[part])]))
        first = last
    return [_whole(parts) for parts in pieces if parts]


def _whole(parts: list[Factors]) -> Factors:
    """Factors of all the parts together."""
    R = np.stack(
        [
            np.linalg.qr(np.vstack([part.R[j] for part in parts]), mode="r")
            for j in range(len(parts[0].counts))
        ]
    )
    return Factors(R, np.sum([part.counts for part in parts], axis=0))
