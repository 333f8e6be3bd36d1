"""Linear least squares on the triangular factors, ordinary or weighted per joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np
from scipy.linalg import solve_triangular

from dynident.errors import FitError
from dynident.fitting.estimate import DataSource, Estimate, unidentified
from dynident.fitting.fixed_point import FixedPoint, not_converged
from dynident.fitting.sampling import rows
from dynident.model import Model
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors, factorise
from dynident.recording import Dataset, default_filter, rows_in_words, uniform
from dynident.robot import BaseParameters, base_parameters
from dynident.threads import single_threaded

_ROUNDS = 30  # of columns that depend on the model's own values, until they settle
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class LeastSquares:
    """Least squares for models that are linear in their parameters.

    Attributes
    ----------
    weighting : "joint" divides each joint's rows by the standard deviation of its residual in the
        ordinary fit (weighted least squares of the identification literature); "none" is ordinary
        least squares.
    """

    weighting: Literal["joint", "none"] = "joint"
    name: ClassVar[str] = "least squares"

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are what they are.

        Raises
        ------
        FitError
            If there are fewer equations than parameters, or the torque is zero throughout.
        """
        if not dataset.recordings:
            raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
        factors = factorise(rows(model, dataset))
        solution = solve_factors(model, factors, self.weighting)
        if model.needs_values:
            model, factors, solution = self._iterate(model, dataset, solution.values)
        return estimate_of(self.name, self.weighting, model, dataset, factors, solution)

    def _iterate(
        self, model: Model, dataset: Dataset, values: np.ndarray
    ) -> tuple[Model, TriangularFactors, LinearSolution]:
        """Fit with columns at the values fitted before, until both agree."""
        fixed_point = FixedPoint()
        for _ in range(_ROUNDS):
            model = model.at(values)
            factors = factorise(rows(model, dataset, values))
            solution = solve_factors(model, factors, self.weighting)
            change = np.linalg.norm(solution.values - values) / np.linalg.norm(values)
            if change <= _TOLERANCE:
                break
            values = fixed_point.following(model, values, solution.values)
        else:
            solution = replace(solution, notes=(*solution.notes, not_converged(float(change))))
        return model.at(solution.values), factors, solution


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearSolution:
    """Weighted least squares on factors; see `Estimate` for the attributes."""

    values: np.ndarray
    covariance: np.ndarray
    basis: BaseParameters
    torque_std: np.ndarray
    condition_number: float
    notes: tuple[str, ...] = field(default=())


def solve_factors(
    model: Model, factors: TriangularFactors, weighting: Literal["joint", "none"] = "joint"
) -> LinearSolution:
    """Solve for the parameters that the data identify; the rest stays as given.

    Parameters
    ----------
    model : whose given values hold where the data say nothing.
    factors : of each joint's rows.
    weighting : "joint" divides the rows of each joint by its residual, "none" does not.

    Returns
    -------
    With its covariance, and the residual of each joint, N m or N.

    Raises
    ------
    FitError
        If there are fewer equations than parameters, or the torque is zero throughout.
    """
    require_rows(factors)
    ordinary = _solve(model, factors, np.ones(len(factors.counts)))
    std = residual_std(factors, ordinary.values, ordinary.basis.rank)
    if weighting == "none" or len(std) == 1:
        return replace(ordinary, torque_std=std)
    weighted = _solve(model, factors, 1.0 / std)
    std = residual_std(factors, weighted.values, weighted.basis.rank)
    return replace(weighted, torque_std=std)


def require_rows(factors: TriangularFactors) -> None:
    """Raise FitError if there are fewer equations than parameters, or the torque is zero."""
    if factors.rows <= factors.size:
        what = f"{factors.rows} equations for {factors.size} parameters"
        raise FitError(what, remedy="record longer, or raise rate_hz in [filter]")
    if not np.any(factors.torque_norms > 0):
        raise FitError("the torque is zero throughout", remedy="is it the right column?")


@dataclass(frozen=True, eq=False)
class TriangularSolution:
    """Least squares on some columns of a factor.

    Attributes
    ----------
    values : (r,) of these columns.
    triangle : (r, r) their factor.
    inverse : (r, r) of it.
    variance : of the residual.
    """

    values: np.ndarray
    triangle: np.ndarray
    inverse: np.ndarray
    variance: float


def solve_columns(R: np.ndarray, kept: Sequence[int], rows: int) -> TriangularSolution:
    """Solve for independent columns of a factor; its last one is the torque.

    Parameters
    ----------
    R : (m, m) as of `TriangularFactors.pooled`.
    kept : numbers of the columns.
    rows : behind the factor, which the variance is per degree of freedom of.

    Returns
    -------
    Values of these columns, with what their covariance is made of
    """
    # The kept columns of a triangle are no triangle: factorise once more.
    Q, triangle = np.linalg.qr(R[:, kept])
    values = solve_triangular(triangle, Q.T @ R[:, -1])
    residual = R[:, -1] - R[:, kept] @ values
    variance = float(residual @ residual) / (rows - len(kept))
    return TriangularSolution(
        values, triangle, solve_triangular(triangle, np.eye(len(kept))), variance
    )


def _solve(model: Model, factors: TriangularFactors, weights: np.ndarray) -> LinearSolution:
    p = model.size
    R = factors.pooled(weights)
    basis = base_parameters(R[:p, :p], model.names, RANK_TOLERANCE)
    kept = list(basis.independent)
    found = solve_columns(R, kept, factors.rows)
    covariance = np.zeros((p, p))
    covariance[np.ix_(kept, kept)] = found.variance * found.inverse @ found.inverse.T
    values = basis.lift(found.values, model.given_values())
    return LinearSolution(
        values=values,
        covariance=covariance,
        basis=basis,
        torque_std=np.zeros(len(factors.counts)),
        condition_number=float(np.linalg.cond(found.triangle)),
        notes=unidentified(basis),
    )


def residual_std(factors: TriangularFactors, values: np.ndarray, rank: int) -> np.ndarray:
    """Standard deviation of each joint's residual, its share of the parameters accounted for.

    Parameters
    ----------
    factors : joint by joint.
    values : (p,) whose residual it is.
    rank : number of combinations that were fitted.

    Returns
    -------
    (n,) in N m or N
    """
    share = rank / len(factors.counts)
    std = factors.residual_norms(values) / np.sqrt(np.maximum(factors.counts - share, 1.0))
    least = 1e-12 * np.max(factors.torque_norms / np.sqrt(factors.counts))
    return np.maximum(std, least)


def estimate_of(
    name: str,
    weighting: str,
    model: Model,
    dataset: Dataset,
    factors: TriangularFactors,
    solution: LinearSolution,
) -> Estimate:
    """Assemble an `Estimate` from a solution.

    Parameters
    ----------
    name : of the method, for the report.
    weighting : "joint" or "none".
    model : that was fitted.
    dataset : whose recordings count.
    factors : of all rows.
    solution : of the same rows.

    Returns
    -------
    With errors as shares of the measured torque.
    """
    norms = factors.torque_norms
    residuals = factors.residual_norms(solution.values)
    words = "ordinary" if weighting == "none" else "weighted per joint"
    return Estimate(
        model=model,
        values=solution.values,
        covariance=solution.covariance,
        basis=solution.basis,
        torque_std=solution.torque_std,
        joint_errors=residuals / np.where(norms > 0, norms, np.nan),
        error=float(np.linalg.norm(residuals) / np.linalg.norm(norms)),
        condition_number=solution.condition_number,
        rows=factors.rows,
        method=f"{name}, {words}",
        status="solved",
        notes=solution.notes,
        sources=sources_of(dataset),
    )


def sources_of(dataset: Dataset) -> tuple[DataSource, ...]:
    """The files behind a dataset."""
    found = []
    for recording in dataset.recordings:
        recording = uniform(recording)
        settings = dataset.filter or default_filter(recording.rate_hz)
        file, digest = recording.provenance.file, recording.provenance.sha256
        words = f"{settings.description}; {rows_in_words(recording, settings)}"
        found.append(DataSource(recording.name or file, digest, words))
    return tuple(found)
