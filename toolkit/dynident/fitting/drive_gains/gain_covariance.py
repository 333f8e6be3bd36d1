"""The covariance of gains and linear parameters together, with the colour that errors have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr, solve_triangular

from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.fitting.drive_gains.gain_scales import GainScales
from dynident.fitting.drive_gains.gain_solution import GainSolution
from dynident.fitting.sampling import Sampled
from dynident.fitting.uncertainty.row_errors import RowErrors
from dynident.fitting.uncertainty.scattered_errors import SolvedRows, scattered_errors
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors


@dataclass(frozen=True, eq=False, kw_only=True)
class GainCovariance:
    """Covariance of (logarithms of the gains, linear parameters).

    Attributes
    ----------
    matrix : (n + size, n + size); an open scale has no variance: gains are relative to the
        geometric mean of their group, and parameters to the same. Rows of what is given, or
        not identified on its own, are zero.
    errors : of the rows, in the recorded unit.
    lacking : as of `ScatteredErrors`.
    """

    matrix: np.ndarray
    errors: RowErrors
    lacking: bool = False


def gain_covariance(
    problem: GainProblem, factors: TriangularFactors, solution: GainSolution, scales: GainScales
) -> GainCovariance:
    """Measure the errors of the rows in one more pass, and carry them to gains and parameters.

    Parameters
    ----------
    problem, factors : as of `solve_gains`.
    solution, scales : what came out.

    Returns
    -------
    The covariance, by the first derivatives at the solution.
    """
    n, kept = len(solution.gains), list(solution.basis.independent)
    columns = [*_seen_gains(problem, scales), *(n + k for k in kept)]
    triangle = _triangle(factors, solution, columns)
    found = scattered_errors(
        problem.samples,
        lambda sampled: _derivatives(problem, solution, sampled, columns),
        SolvedRows(
            weights=solution.weights,
            inverse=solve_triangular(triangle, np.eye(len(columns))),
            squares=np.asarray(factors.torque_norms) ** 2,
        ),
    )
    matrix = np.zeros((n + problem.size, n + problem.size))
    matrix[np.ix_(columns, columns)] = found.covariance
    gauge = _gauge(problem, factors, solution, scales)
    return GainCovariance(
        matrix=gauge @ matrix @ gauge.T, errors=found.errors, lacking=found.lacking
    )


def _derivatives(
    problem: GainProblem, solution: GainSolution, sampled: Sampled, columns: list[int]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield what the predicted currents change by (T, n, r), and what they miss (T, n)."""
    kappa, n = 1.0 / solution.gains, len(solution.gains)
    for block, current in problem.rows_of(sampled, solution.values):
        torque = block @ np.append(solution.values, 1.0)
        every = np.zeros((*torque.shape, n + problem.size))
        every[:, np.arange(n), np.arange(n)] = -kappa * torque
        every[:, :, n:] = kappa[:, None] * block[:, :, :-1]
        yield every[:, :, columns], current - kappa * torque


def _whole_jacobian(factors: TriangularFactors, solution: GainSolution) -> np.ndarray:
    """Weighted derivatives by all gains and parameters on the factors, (n m, n + size)."""
    kappa = solution.weights / solution.gains
    R = factors.R * kappa[:, None, None]
    n, m, _ = R.shape
    every = np.zeros((n, m, n + len(solution.values)))
    every[np.arange(n), :, np.arange(n)] = -(R[:, :, :-1] @ np.append(solution.values, 1.0))
    every[:, :, n:] = R[:, :, :-2]
    return every.reshape(n * m, -1)


def _triangle(factors, solution: GainSolution, columns: list[int]) -> np.ndarray:
    return np.asarray(np.linalg.qr(_whole_jacobian(factors, solution)[:, columns], mode="r"))


def _seen_gains(problem: GainProblem, scales: GainScales) -> list[int]:
    """Unknown gains, less as many as have open scales: these are held."""
    free = [int(j) for j in np.flatnonzero(problem.free)]
    if not len(scales.unseen):
        return free
    factors: Any = qr(scales.unseen[:, free], mode="r", pivoting=True)
    held = {free[p] for p in factors[1][: len(scales.unseen)]}
    return [j for j in free if j not in held]


def _gauge(problem, factors, solution: GainSolution, scales: GainScales) -> np.ndarray:
    """Map of changes at some gains held to changes at the mean of each group held."""
    n = len(solution.gains)
    size = n + problem.size
    unit = np.eye(size)
    if not len(scales.unseen):
        return unit
    kept = [n + k for k in solution.basis.independent]
    whole = _whole_jacobian(factors, solution)
    follow = np.linalg.lstsq(whole[:, kept], -whole[:, :n] @ scales.unseen.T, rcond=RANK_TOLERANCE)[
        0
    ]
    directions = np.zeros((size, len(scales.unseen)))
    directions[:n] = scales.unseen.T
    directions[kept] = follow
    if scales.fixed_by_groups:
        means = np.zeros((len(scales.groups), size))
        for row, group in zip(means, scales.groups, strict=True):
            row[list(group)] = 1.0 / len(group)
    else:
        means = np.zeros((len(scales.unseen), size))
        means[:, :n] = scales.unseen
    return unit - directions @ np.linalg.solve(means @ directions, means)
