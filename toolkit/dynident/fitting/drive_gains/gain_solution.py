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
_MOST = 300  # evaluations of a search
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

    def gain_columns(self, found: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """Return what the torques of the joints, times a factor each, add to the rows, (n m, n).

        Parameters
        ----------
        found : (r,) linear parameters.
        factor : (n,); `kappa` for the change of the residual by log(gain).
        """
        n, m, _ = self.R.shape
        columns = np.zeros((n, m, n))
        columns[np.arange(n), :, np.arange(n)] = self.torques(found) * factor[:, None]
        return columns.reshape(n * m, n)

    def projected(self, kappa: np.ndarray, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solve for the linear parameters, and see what changes of gains show beside them.

        Parameters
        ----------
        kappa, factor : as of `linear` and `gain_columns`.

        Returns
        -------
        the residual (n m,), and its Jacobian (n m, n) in the unit of the factors
        """
        found, residual, Q, _ = self.linear(kappa)
        columns = self.gain_columns(found, factor)
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
    # At first what each joint's own columns leave, whatever the other joints say.
    share = problem.size / problem.model.robot.n
    freedom = np.sqrt(np.maximum(factors.counts - share, 1.0))
    std = np.maximum(np.abs(factors.R[:, -1, -1]), _EXACT * size) / freedom
    weighted = WeightedFactors(problem, factors, 1.0 / std)
    described = _described(problem, factors)
    kappa, cost = _search(weighted, 1.0 / described)
    other, less = _search(weighted, 1.0 / _linear_gains(weighted, described))
    if less < cost * (1 - _SETTLED):  # what rounding alone decides, the description does
        kappa, cost = other, less
    for _ in range(_ROUNDS):
        left = np.linalg.norm(weighted.linear(kappa)[1], axis=1) / weighted.weights
        before, std = std, np.maximum(left, _EXACT * size) / freedom
        if np.max(np.abs(np.log(std / before))) < _SETTLED:
            break
        weighted = WeightedFactors(problem, factors, 1.0 / std)
        kappa, cost = _search(weighted, kappa)
    if not np.isfinite(cost):
        what = "the search for the drive gains does not converge"
        raise FitError(what, remedy="give the gain of a joint or two in [drive_gains]")
    return GainSolution(
        gains=np.array(1.0 / kappa),
        values=weighted.basis.lift(weighted.linear(kappa)[0], problem.given_values()),
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


def _search(weighted: WeightedFactors, start: np.ndarray) -> tuple[np.ndarray, float]:
    """Return kappa (n,) of least squares, and the cost; infinite if the search does not converge.

    The search is in kappa over that of the start, through zero if need be: the sign of a start may
    be wrong.
    """
    free = np.flatnonzero(weighted.problem.free)
    count = max(float(np.linalg.norm(weighted.R[:, :, -1])), 1.0)  # residuals of order one

    def kappa(x: np.ndarray) -> np.ndarray:
        every = np.ones(len(start))
        every[free] = x
        return every * start

    def residual(x: np.ndarray) -> np.ndarray:
        return weighted.linear(kappa(x))[1].ravel() / count

    def jacobian(x: np.ndarray) -> np.ndarray:
        return weighted.projected(kappa(x), -start)[1][:, free] / count

    x = np.ones(len(free))
    if not len(free):
        return start, float(np.sum(residual(x) ** 2))
    search: Any = least_squares
    found = search(residual, x, jacobian, xtol=1e-10, ftol=1e-14, gtol=1e-14, max_nfev=_MOST)
    converged = found.success and np.all(np.isfinite(1.0 / found.x))
    return kappa(found.x), float(found.cost) if converged else np.inf


def _described(problem: GainProblem, factors: TriangularFactors) -> np.ndarray:
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
        # What effects have eaten up is no size.
        gains[j] = np.copysign(1.0 / max(abs(kappa), 0.1 * plain), kappa)
    return gains


def _linear_gains(weighted: WeightedFactors, near: np.ndarray) -> np.ndarray:
    """Return gains (n,) of torque = gain * current, linear in all that is unknown.

    The noise of the currents makes them too small; their signs need no description. Where no load
    and no gain is known, the vector of gains and parameters that leaves least, at the size and sign
    of other gains.

    Parameters
    ----------
    weighted : the problem.
    near : (n,) other gains, which weight the joints' torques, and are taken where one comes out 0.
    """
    problem = weighted.problem
    n, m, _ = weighted.R.shape
    free = np.flatnonzero(problem.free)
    R = weighted.R / near[:, None, None]
    currents = np.zeros((n, m, n))
    currents[np.arange(n), :, np.arange(n)] = R[:, :, -1]
    fixed = currents[:, :, ~problem.free] @ near[~problem.free]
    columns = np.concatenate([currents[:, :, free], -R[:, :, weighted.kept]], axis=2)
    columns, target = columns.reshape(n * m, -1), (R[:, :, -2] - fixed).ravel()
    scale = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    if np.any(target):
        found = np.linalg.lstsq(columns / scale, target, rcond=RANK_TOLERANCE)[0] / scale
    else:
        found = np.linalg.svd(columns / scale, full_matrices=False)[2][-1] / scale
        found = found * float(near[free] @ found[: len(free)])
        size = np.linalg.norm(found[: len(free)])
        found = found * (np.linalg.norm(near[free]) / size if size > 0 else 0.0)
    gains = np.array(near)
    gains[free] = np.where(found[: len(free)] != 0.0, found[: len(free)], near[free])
    return gains
