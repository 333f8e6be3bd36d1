"""Triangular factors of instruments, regressor and torque side by side, solved.

Everything that an instrumental variable estimate needs (the estimate, the ranks, both residuals)
is in the R of a QR factorisation of [V, W, y], so that neither matrix is ever kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from dynident.errors import FitError
from dynident.fitting.linear_solution import require_rows, residual_std
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors, factorise
from dynident.recording import Dataset
from dynident.robot import BaseParameters, base_parameters


def factorise_instruments(
    model: Model, measured: Dataset, instruments: Dataset, values: np.ndarray | None = None
) -> TriangularFactors:
    """Factorise the rows of measured recordings beside those of their instruments.

    Parameters
    ----------
    model : whose columns both are.
    measured : T samples in each recording.
    instruments : the same recordings with other positions, on the same time stamps.
    values : (p,) at which columns that depend on the predicted torque are taken.

    Returns
    -------
    Factors of [V, W, y], joint by joint
    """
    return factorise(_rows(model, measured, instruments, values), model.size)


def _rows(
    model: Model, measured: Dataset, instruments: Dataset, values: np.ndarray | None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    for one, other in zip(measured.recordings, instruments.recordings, strict=True):
        own, instrument = sample(one, measured.filter), sample(other, instruments.filter)
        torque, start = own.counted(own.tau), 0
        for V, W in zip(instrument.columns(model, values), own.columns(model, values), strict=True):
            stop = start + len(W)
            yield np.concatenate([V, W], axis=2), torque[start:stop]
            start = stop


@dataclass(frozen=True, eq=False, kw_only=True)
class InstrumentalSolution:
    """What the factors give.

    Attributes
    ----------
    values : (p,) what the data do not tell stays as it was given.
    basis : combinations that the instruments identify.
    gain : (r, r) inverse of V' O^-1 W on the independent columns; O holds each joint's variance.
    crossed : (r, r) V' O^-1 V on them.
    weights : (n,) 1 / standard deviation of each joint's residual.
    condition_number : of V' O^-1 W with columns of unit norm.
    correlation : smallest canonical correlation of instruments and regressor.
    """

    values: np.ndarray
    basis: BaseParameters
    gain: np.ndarray
    crossed: np.ndarray
    weights: np.ndarray
    condition_number: float
    correlation: float

    @property
    def rank(self) -> int:
        """Number of combinations identified."""
        return self.basis.rank


def solve_instruments(
    factors: TriangularFactors, names: tuple[str, ...], given: np.ndarray, weighting: str
) -> InstrumentalSolution:
    """Solve V' O^-1 W x = V' O^-1 y through two QR factorisations.

    With V = Qv Rv and W = Qw Rw it is Qv' W x = Qv' y, in which no condition number is squared
    (Janot et al. 2010, equation 34).

    Parameters
    ----------
    factors : of [V, W, y].
    names : of the p parameters.
    given : (p,) values of what the data do not tell.
    weighting : "joint": O holds the variance of each joint's residual in the ordinary solution;
        "none": O = E.

    Returns
    -------
    The estimate, with what its covariance is made of

    Raises
    ------
    FitError
        If there are too few rows, the torque is zero, or the instruments do not reach every
        direction of the regressor that they excite.
    """
    require_rows(factors)
    ordinary = _solve(factors, names, given, np.ones(len(factors.counts)))
    if weighting == "none" or len(factors.counts) == 1:
        return ordinary
    std = residual_std(factors, ordinary.values, ordinary.rank)
    return _solve(factors, names, given, 1.0 / std)


def _solve(
    factors: TriangularFactors, names: tuple[str, ...], given: np.ndarray, weights: np.ndarray
) -> InstrumentalSolution:
    p = factors.size
    R = factors.pooled(weights)
    # Noise gives the measured regressor full rank whatever the motion: the instruments decide.
    basis = base_parameters(R[:p, :p], names, RANK_TOLERANCE)
    kept = list(basis.independent)
    Q, Rv = np.linalg.qr(R[:p, kept])
    Rw = np.linalg.qr(R[: 2 * p, [p + i for i in kept]])[1]
    across = Q.T @ R[:p, [p + i for i in kept]]
    _require_rank(across, Rw, names, kept)
    values = np.linalg.solve(across, Q.T @ R[:p, 2 * p])
    inverse = np.linalg.inv(across)
    return InstrumentalSolution(
        values=basis.lift(values, given),
        basis=basis,
        gain=inverse @ solve_triangular(Rv.T, np.eye(len(kept)), lower=True),
        crossed=Rv.T @ Rv,
        weights=weights,
        condition_number=_condition(Rv.T @ across),
        correlation=_least_correlation(across, Rw),
    )


def _condition(matrix: np.ndarray) -> float:
    """Condition number with rows and columns of unit norm, so that units do not decide."""
    matrix = matrix / np.linalg.norm(matrix, axis=1)[:, None]
    return float(np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0)))


def _least_correlation(across: np.ndarray, Rw: np.ndarray) -> float:
    """Smallest singular value of Qv' Qw."""
    correlation = solve_triangular(Rw.T, across.T, lower=True).T
    return float(np.linalg.svd(correlation, compute_uv=False)[-1])


def _require_rank(
    across: np.ndarray, Rw: np.ndarray, names: tuple[str, ...], kept: list[int]
) -> None:
    """Refuse instruments and a regressor of different rank: rank V = rank W = rank V'W."""
    for matrix, what in ((Rw, "the measured regressor"), (across, "V' W")):
        norms = np.linalg.norm(matrix, axis=0)
        scaled = matrix / np.where(norms > 0, norms, 1.0)
        singular = np.linalg.svd(scaled, compute_uv=False)
        rank = int(np.count_nonzero(singular > RANK_TOLERANCE * singular[0]))
        if rank < len(kept) or not np.all(norms > 0):
            weakest = np.linalg.svd(scaled)[2][-1]
            blamed = names[kept[int(np.argmax(np.abs(weakest)))]]
            raise FitError(
                f"the rank of {what} is {rank}, that of the instruments {len(kept)}",
                f"instruments, at {blamed}",
                "record a motion that excites it, or choose other instruments",
            )
