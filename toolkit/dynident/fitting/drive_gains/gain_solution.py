"""Gains and inertias together: a least squares problem in the gains alone.

For given gains the rest is linear and solved for (variable projection, G. H. Golub and V. Pereyra,
SIAM J. Numer. Anal. 10, 1973, with the Jacobian of L. Kaufman, BIT 15, 1975). The residual is that
of the recorded unit, where the noise is: to multiply the recorded currents by unknown gains would
shrink the gains, as any regression on noisy columns does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from dynident.errors import FitError
from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors
from dynident.robot import BaseParameters, base_parameters

_ROUNDS = 10  # of the joints' weights, until they settle
_SETTLED = 1e-6
_EXACT = 1e-9
"""Residual relative to the current below which it is rounding: no joint is weighted more."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GainSolution:
    """Gains and linear parameters of least squares.

    Attributes
    ----------
    gains : (n,) N m or N per unit.
    values : (size,) linear parameters, those that the data do not excite as described.
    basis : which of them the data identify once the gains are given.
    weights : (n,) of the rows of the joints: one over the residual.
    residual_std : (n,) in the recorded unit.
    """

    gains: np.ndarray
    values: np.ndarray
    basis: BaseParameters
    weights: np.ndarray
    residual_std: np.ndarray


class WeightedFactors:
    """The least squares problem at given weights, on the factors of the joints' rows.

    Parameters
    ----------
    problem : for what is known.
    factors : of rows [columns, known torque, current], joint by joint.
    weights : (n,) of the rows of the joints.
    """

    def __init__(
        self, problem: GainProblem, factors: TriangularFactors, weights: np.ndarray
    ) -> None:
        self.problem, self.weights = problem, weights
        self.R = factors.R * weights[:, None, None]
        size = problem.size
        pooled = TriangularFactors(self.R, factors.counts).pooled(np.ones(len(weights)))
        self.basis = base_parameters(pooled[:size, :size], problem.names, RANK_TOLERANCE)
        self.kept = list(self.basis.independent)

    def linear(self, kappa: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Solve for the linear parameters.

        Parameters
        ----------
        kappa : (n,) current per torque of each joint.

        Returns
        -------
        their values (r,), residual (n, m), orthonormal basis of the columns (n m, r), and their
        triangular factor (r, r)
        """
        n, m, _ = self.R.shape
        A = (self.R[:, :, self.kept] * kappa[:, None, None]).reshape(n * m, -1)
        b = (self.R[:, :, -1] - self.R[:, :, -2] * kappa[:, None]).ravel()
        Q, triangle = np.linalg.qr(A)
        found = np.linalg.solve(triangle, Q.T @ b)
        return found, (b - A @ found).reshape(n, m), Q, triangle

    def torques(self, found: np.ndarray) -> np.ndarray:
        """Torque of linear parameters (r,) and known loads in the rows of the factors, (n, m)."""
        return self.R[:, :, self.kept] @ found + self.R[:, :, -2]

    def gain_columns(self, kappa: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Return what a unit of log(gain) adds to the residual of the joints, (n, n m)."""
        n, m, _ = self.R.shape
        columns = np.zeros((n, n, m))
        columns[np.arange(n), np.arange(n)] = self.torques(found) * kappa[:, None]
        return columns.reshape(n, n * m)

    def projected(self, kappa: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the residual (n m,) and its Jacobian (n m, n) by log(gain), the rest solved."""
        found, residual, Q, _ = self.linear(kappa)
        columns = self.gain_columns(kappa, found).T
        return residual.ravel(), columns - Q @ (Q.T @ columns)


def solve_gains(problem: GainProblem, factors: TriangularFactors) -> GainSolution:
    """Find gains and linear parameters; where nothing fixes a scale, one near the start's.

    Parameters
    ----------
    problem : what is known.
    factors : of its rows.

    Returns
    -------
    Least squares, joints weighted by their residuals.

    Raises
    ------
    FitError
        If there are too few equations, a joint's current is zero throughout, or the search fails.
    """
    if factors.rows <= problem.size + problem.model.robot.n:
        what = f"{factors.rows} equations for {problem.size + problem.model.robot.n} parameters"
        raise FitError(what, remedy="record longer, or raise rate_hz in [filter]")
    size = factors.torque_norms
    if not np.all(size > 0):
        name = problem.model.robot.names[int(np.argmin(size))]
        raise FitError("the current is zero throughout", name, "is it the right column?")
    start = _start(problem, factors)
    # At first what each joint's own columns leave, whatever the other joints say.
    share = problem.size / problem.model.robot.n
    freedom = np.sqrt(np.maximum(factors.counts - share, 1.0))
    std = np.maximum(np.abs(factors.R[:, -1, -1]), _EXACT * size) / freedom
    logs = np.zeros(len(start))
    for _ in range(_ROUNDS):
        weighted = WeightedFactors(problem, factors, 1.0 / std)
        logs = _search(weighted, start, logs)
        kappa = np.exp(-logs) / start
        found, residual, _, _ = weighted.linear(kappa)
        left = np.linalg.norm(residual, axis=1) / weighted.weights
        before, std = std, np.maximum(left, _EXACT * size) / freedom
        if np.max(np.abs(np.log(std / before))) < _SETTLED:
            break
    return GainSolution(
        gains=start * np.exp(logs),
        values=weighted.basis.lift(found, problem.given_values()),
        basis=weighted.basis,
        weights=weighted.weights,
        residual_std=std,
    )


def at_gains(
    problem: GainProblem, factors: TriangularFactors, solution: GainSolution, gains: np.ndarray
) -> GainSolution:
    """Return the solution with other gains, the linear parameters solved for anew.

    Parameters
    ----------
    problem, factors : as of `solve_gains`.
    solution : its weights are kept.
    gains : (n,) N m or N per unit.
    """
    weighted = WeightedFactors(problem, factors, solution.weights)
    found = weighted.linear(1.0 / gains)[0]
    return GainSolution(
        gains=gains,
        values=weighted.basis.lift(found, problem.given_values()),
        basis=weighted.basis,
        weights=solution.weights,
        residual_std=solution.residual_std,
    )


def _search(weighted: WeightedFactors, start: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return logarithms of gain over start, (n,), of least squares."""
    free = np.flatnonzero(weighted.problem.free)
    if not len(free):
        return logs

    def kappa(x: np.ndarray) -> np.ndarray:
        every = np.zeros(len(start))
        every[free] = x
        return np.exp(-every) / start

    count = max(np.linalg.norm(weighted.R[:, :, -1]), 1.0)  # residuals of order one
    found: Any = least_squares(
        lambda x: weighted.projected(kappa(x))[0] / count,
        logs[free],
        jac=lambda x: weighted.projected(kappa(x))[1][:, free] / count,  # type: ignore[arg-type]
        method="trf",
        xtol=1e-10,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=200,
    )
    if not found.success or not np.all(np.isfinite(found.x)):
        raise FitError(
            f"the search for the drive gains did not converge: {found.message}",
            remedy="give the gain of a joint or two in [drive_gains]",
        )
    every = np.zeros(len(start))
    every[free] = found.x
    return every


def _start(problem: GainProblem, factors: TriangularFactors) -> np.ndarray:
    """Return gains (n,) at which the description's torque, and effects, fit the currents best."""
    model = problem.model
    rank, given = model.base.rank, problem.given_values()
    gains = np.ones(model.robot.n)
    for j, (name, R) in enumerate(zip(model.robot.names, factors.R, strict=True)):
        if name in problem.known:
            gains[j] = problem.known[name]
            continue
        described = R[:, :rank] @ given[:rank] + R[:, -2]
        if not np.any(described):
            continue
        columns = np.column_stack([described, R[:, rank : model.size]])
        scale = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        kappa = np.linalg.lstsq(columns / scale, R[:, -1], rcond=1e-8)[0][0] / scale[0]
        plain = np.linalg.norm(R[:, -1]) / scale[0]
        # The sign is the data's; a size that effects have eaten up is not.
        gains[j] = np.copysign(1.0 / max(abs(kappa), 0.1 * plain), kappa)
    return gains
