"""The regressions at work: fitted to pieces of the data, and what an estimate takes from them.

In: a regression as it was posed, an estimator or its name, and the covariance of the inputs' noise.
Out: a `RegressionResult`. It loads scikit-learn, and is imported when a regression is fitted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special
from sklearn.cross_decomposition import PLSRegression
from sklearn.linear_model import LassoCV, RidgeCV
from sklearn.model_selection import GridSearchCV, PredefinedSplit

from dynident.errors import FitError
from dynident.fitting.noisy_inputs.between_pieces import OutputNoise, output_noise, sandwich
from dynident.fitting.noisy_inputs.posed import PIECES, PosedRegression
from dynident.moments.factors import TriangularFactors, products_of
from dynident.regression.bayesian_factors import BayesianFactorRegression
from dynident.regression.corrected import LEAST_SHARE, CorrectedLeastSquares
from dynident.regression.factor_tables import factor_tables
from dynident.regression.joint_factors import JointFactorRegression
from dynident.regression.names import REGRESSIONS
from dynident.regression.ordinary import TruncatedLeastSquares
from dynident.regression.statistics_regressor import StatisticsRegressor
from dynident.regression.stepwise import StepwiseRegression
from dynident.regression.total import TotalLeastSquares
from dynident.tables import Table

_FOLDS = 5  # of the pieces, between which penalties are validated
_PENALTIES = np.logspace(-10, 2, 49)  # of ridge regression, relative to the inputs' own squares
_COMPONENTS = 40  # of partial least squares, at most
_TAKES_NOISE = CorrectedLeastSquares | JointFactorRegression
_NO_PLACE = "leave it out, or choose corrected, factors or bayes"

_OWN: dict[str, Callable[[], StatisticsRegressor]] = {
    "truncated": TruncatedLeastSquares,
    "total": TotalLeastSquares,
    "stepwise": StepwiseRegression,
    "corrected": CorrectedLeastSquares,
    "factors": lambda: JointFactorRegression(queries="noiseless"),
    "bayes": lambda: BayesianFactorRegression(queries="noiseless"),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class RegressionResult:
    """What a regression found of the parameters that the data identify.

    Attributes
    ----------
    values : (r,)
    covariance : (r, r); None where the regression has none to give.
    words : what it is called.
    status : how it ended.
    notes, details : caveats, and tables of what else it has to say.
    """

    values: np.ndarray
    covariance: np.ndarray | None = None
    words: str
    status: str = "solved"
    notes: tuple[str, ...] = ()
    details: tuple[Table, ...] = ()


def named(estimator: str | StatisticsRegressor) -> StatisticsRegressor | None:
    """Return an estimator of `dynident.regression` by its name; None for scikit-learn's.

    Raises
    ------
    FitError
        If there is no such regression.
    """
    if not isinstance(estimator, str):
        return estimator
    if estimator not in REGRESSIONS:
        what = f"no regression '{estimator}'"
        raise FitError(what, remedy=f"choose {', '.join(REGRESSIONS)}")
    return _OWN[estimator]() if estimator in _OWN else None


def fitted(
    regressor: StatisticsRegressor, posed: PosedRegression, psi: np.ndarray | None
) -> StatisticsRegressor:
    """Fit an estimator of `dynident.regression` to the statistics of a regression.

    Parameters
    ----------
    regressor : set up, not fitted.
    posed : the regression.
    psi : (r, r) covariance of the inputs' noise in a row; None where it is not known.

    Returns
    -------
    Another estimator with its settings, fitted.

    Raises
    ------
    FitError
        If it is no such estimator, has no place for the noise, or cannot do without.
    """
    if not isinstance(regressor, StatisticsRegressor):
        what = f"a {type(regressor).__name__} is no regression from sufficient statistics"
        raise FitError(what, remedy="name one, or give an estimator of dynident.regression")
    if np.any(getattr(regressor, "input_noise", None)):
        what = "the estimator's own input_noise is in units that only its rows have"
        raise FitError(what, remedy="give it as noise = of Regression")
    regressor = regressor.another(fit_intercept=False)
    if psi is not None and not isinstance(regressor, _TAKES_NOISE):
        raise FitError(
            f"{regressor.words} has no place for the noise of its inputs", None, _NO_PLACE
        )
    if psi is None and isinstance(regressor, CorrectedLeastSquares):
        remedy = 'state noise = "repeats" or "encoders"'
        raise FitError("corrected least squares needs the noise of the inputs", remedy=remedy)
    if psi is not None:
        regressor.set_params(input_noise=psi)
    names = [posed.model.names[i] for i in posed.kept]
    found = regressor.named(names).fit_statistics(products_of(posed.pieces))
    if psi is not None:
        _cluster(found, posed.pieces, psi)
    return found


def _cluster(regressor: StatisticsRegressor, pieces: TriangularFactors, psi: np.ndarray) -> None:
    """Take standard deviations from the scatter between pieces: rows are not independent."""
    if isinstance(regressor, CorrectedLeastSquares):
        regressor.covariance_ = sandwich(pieces, regressor.coef_, psi)
        regressor.sigma_ = np.sqrt(np.diag(regressor.covariance_))
    elif isinstance(regressor, JointFactorRegression) and regressor.corrected_ is not None:
        corrected = regressor.corrected_
        _cluster(corrected, pieces, psi)
        regressor.sigma_true_ = np.hypot(corrected.sigma_, regressor.coef_true_ - corrected.coef_)


def found_by(
    regressor: StatisticsRegressor, posed: PosedRegression, psi: np.ndarray | None
) -> RegressionResult:
    """Fit an estimator as `fitted` does.

    Parameters
    ----------
    regressor, posed, psi : as of `fitted`.

    Returns
    -------
    What an estimate holds of it; without a covariance where `psi` is not known.
    """
    regressor = fitted(regressor, posed, psi)
    words = regressor.words
    if isinstance(regressor, CorrectedLeastSquares):
        assert psi is not None
        notes = _worth(regressor, output_noise(posed.pieces, regressor.coef_, psi))
        return RegressionResult(
            values=regressor.coef_, covariance=regressor.covariance_, words=words, notes=notes
        )
    if isinstance(regressor, JointFactorRegression):
        true, covariance = regressor.coef_true_, None
        if psi is not None and regressor.corrected_ is not None:
            away = true - regressor.corrected_.coef_
            covariance = regressor.corrected_.covariance_ + np.outer(away, away)
        return RegressionResult(
            values=true,
            covariance=covariance,
            words=words,
            status=regressor.ending_,
            details=factor_tables(regressor),
        )
    alone = "No intervals: they would have to carry what the noise of the inputs does."
    return RegressionResult(values=regressor.coef_, words=words, notes=(alone,))


def _worth(regressor: CorrectedLeastSquares, noise: OutputNoise) -> tuple[str, ...]:
    """What corrected least squares rests on, in words."""
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
    t = float(special.stdtrit(PIECES - 1, 0.95))
    if noise.variance < -t * noise.sigma:
        notes.insert(
            0,
            "The input noise is overstated: it would leave the torque a variance of "
            f"{noise.variance:.2g} +- {noise.sigma:.1g} of what least squares leaves.",
        )
    return tuple(notes)


@dataclass(frozen=True, eq=False)
class FewRows:
    """Few rows for many, which every linear regression takes for them.

    A triangular factor R of [X, y] has R'R = [X, y]'[X, y]: a regularised regression sees the same
    path in it, and cross-validation between pieces the same errors.

    Attributes
    ----------
    X, y : (k, p) and (k,), with mean zero: a constant finds nothing to do.
    piece : (k,) number of the consecutive piece of data that each row stands for.
    """

    X: np.ndarray
    y: np.ndarray
    piece: np.ndarray


def few_rows(pieces: TriangularFactors) -> FewRows:
    """Return few rows for those behind the factors of equally long pieces of data."""
    count, size, _ = pieces.R.shape
    # Each row and its mirror image: the mean is zero, the squares are the same.
    mirrored = np.concatenate([pieces.R, -pieces.R], axis=1).reshape(2 * count * size, -1)
    # Penalties count per row: as many squares a row as the data have.
    mirrored *= np.sqrt(count * size / pieces.rows)
    piece = np.repeat(np.arange(count), 2 * size)
    return FewRows(mirrored[:, :-1], mirrored[:, -1], piece)


def found_by_validation(name: str, posed: PosedRegression) -> RegressionResult:
    """Fit one of scikit-learn's regressions, its penalty chosen between pieces of the data."""
    rows = few_rows(posed.pieces)
    scale = np.sqrt(np.mean(rows.X**2, axis=0))
    folds = rows.piece * _FOLDS // (rows.piece.max() + 1)
    chosen = _validated(name, replace(rows, X=rows.X / scale, piece=folds))
    note = (
        f"{name}, {chosen.choice}, chosen between {_FOLDS} consecutive pieces of "
        "the data. No intervals: they would have to carry the bias of the penalty."
    )
    return RegressionResult(
        values=chosen.coefficients / scale, words=f"{name} regression", notes=(note,)
    )


@dataclass(frozen=True, eq=False)
class _Validated:
    """What cross-validation chose: coefficients (p,) for standardised inputs, and it in words."""

    coefficients: np.ndarray
    choice: str


def _validated(name: str, rows: FewRows) -> _Validated:
    """Return the penalty with the least error between the pieces of standardised rows."""
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
        return _Validated(found.coef_, f"penalty {penalty:.3g} of the squares{border}")
    if name == "lasso":
        found = LassoCV(eps=1e-5, fit_intercept=False, cv=split, max_iter=100_000, tol=1e-6)
        found.fit(X, y)
        left = int(np.sum(found.coef_ != 0))
        return _Validated(found.coef_, f"penalty {found.alpha_:.3g}, {left} inputs left")
    components = {"n_components": np.arange(1, min(X.shape[1], _COMPONENTS) + 1)}
    search = GridSearchCV(
        PLSRegression(scale=False), components, cv=split, scoring="neg_mean_squared_error"
    ).fit(X, y)
    count = search.best_params_["n_components"]
    border = ", the most that were tried" if count == _COMPONENTS else ""
    return _Validated(np.ravel(search.best_estimator_.coef_), f"{count} components{border}")
