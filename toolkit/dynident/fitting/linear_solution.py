"""Linear least squares on triangular factors: what solves, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.linalg import solve_triangular

from dynident.errors import FitError
from dynident.fitting.estimate import nearly_hidden, unidentified
from dynident.model import Model
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors
from dynident.robot import BaseParameters, base_parameters


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearSolution:
    """Weighted least squares on factors; see `Estimate` for other attributes.

    Attributes
    ----------
    covariance : (p, p) with errors taken as independent from row to row.
    weights : (n,) of each joint's rows.
    inverse : (r, r) of the triangular factor of the independent weighted columns.
    """

    values: np.ndarray
    covariance: np.ndarray
    basis: BaseParameters
    torque_std: np.ndarray
    condition_number: float
    weights: np.ndarray
    inverse: np.ndarray
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
    ordinary = solve_weighted(model, factors, np.ones(len(factors.counts)))
    std = residual_std(factors, ordinary.values, ordinary.basis.rank)
    if weighting == "none" or len(std) == 1:
        return replace(ordinary, torque_std=std)
    weighted = solve_weighted(model, factors, 1.0 / std)
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


def solve_weighted(model: Model, factors: TriangularFactors, weights: np.ndarray) -> LinearSolution:
    """Solve for the parameters with given weights.

    Parameters
    ----------
    model, factors : as of `solve_factors`.
    weights : (n,) of the joints' rows.

    Returns
    -------
    The solution, the standard deviations of its residual left at zero.
    """
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
        weights=weights,
        inverse=found.inverse,
        notes=(*unidentified(basis), *nearly_hidden(model.base)),
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
    least = 1e-12 * np.max(factors.torque_norms / np.sqrt(np.maximum(factors.counts, 1)))
    return np.maximum(std, least)
