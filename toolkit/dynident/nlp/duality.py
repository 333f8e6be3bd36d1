"""A bound of a problem's objective that any multipliers prove.

The problem is convex, so multipliers in the dual cones bound its objective from below, whoever
found them; the bound is computed in plain arithmetic and does not trust a solver's word.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from dynident.inertia import distance_rows
from dynident.nlp.problem import Problem

_FALLS = 1e-13  # of the largest: curvature (its root) that is rounding


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Lagrange multipliers of a problem's constraints, in parameters in units of their size.

    Attributes
    ----------
    bodies : (n, d, d) symmetric matrices, positive semidefinite at an optimum.
    linear : (k,) positive at a lower bound that holds x up, negative at an upper one.
    cones : one vector per second-order cone, in that cone at an optimum.
    """

    bodies: np.ndarray
    linear: np.ndarray
    cones: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound of a problem's objective.

    Attributes
    ----------
    value : no point of the set has a smaller objective.
    stationarity : norm of the Lagrangian's gradient over those of the objective's parts,
        parameters in units of their size.
    dual_feasibility : smallest eigenvalue or sign of the multipliers over the largest, before
        they were put into their cones: 0 or a little below.
    """

    value: float
    stationarity: float
    dual_feasibility: float


def lower_bound(problem: Problem, x: np.ndarray, multipliers: Multipliers) -> Bound:
    """Return the bound that multipliers prove, developed at a point near the optimum.

    The Lagrangian is at least its value at x less what its gradient there can still bring: half
    the squared Newton decrement for the quadratic, and for the entropy (self-concordant) what
    Nesterov's bound says (Nesterov, "Lectures on convex optimization", theorem 5.1.12).

    The set is that of bodies at least the inset inside, as programs see it.

    Parameters
    ----------
    problem : convex.
    x : (s,) the point, in SI units of the standard parameters.
    multipliers : of any origin; put into the dual cones first.
    """
    if not np.isfinite(problem.objective(x)):
        return Bound(-np.inf, np.inf, 0.0)
    scale = problem.space.scale
    bodies, floor_bodies = _semidefinite(multipliers.bodies)
    cones, floor_cones = _in_cones(multipliers.cones)
    linear, floor_linear = _signed(problem, multipliers.linear)
    gradient = scale * problem.gradient(x)
    rest = gradient - scale * _pull(problem, bodies, linear, cones)
    # What the constraints' slack takes from the objective at x.
    slack = 0.0
    if bodies.size:
        slack += float(np.sum(bodies * problem.body_matrices(x - problem.inset)))
    slack += sum(float(c @ v) for c, v in zip(cones, problem.cone_values(x), strict=True))
    value = problem.linear.A @ x
    at = np.where(linear > 0, problem.linear.lower, problem.linear.upper)
    slack += float(np.sum(linear[linear != 0] * (value - at)[linear != 0]))
    bound = problem.objective(x) - slack - _gain(problem, x, rest)
    entropy = scale * problem.entropy_gradient(x)
    parts = np.linalg.norm(gradient - entropy) + np.linalg.norm(entropy)
    size = max(float(parts), np.finfo(float).tiny)
    floor = min(floor_bodies, floor_cones, floor_linear)
    return Bound(float(bound), float(np.linalg.norm(rest) / size), floor)


def unconstrained_bound(problem: Problem, x: np.ndarray) -> Bound:
    """The bound that a minimiser x (s,) without constraints is: none with constraints is lower."""
    scale = problem.space.scale
    parts = scale * (problem.A.T @ (problem.A @ x)), scale * (problem.A.T @ problem.b)
    size = float(np.linalg.norm(parts[0]) + np.linalg.norm(parts[1])) or 1.0
    rest = float(np.linalg.norm(parts[0] - parts[1]))
    return Bound(problem.objective(x), rest / size, float("nan"))


def _pull(
    problem: Problem, bodies: np.ndarray, linear: np.ndarray, cones: list[np.ndarray]
) -> np.ndarray:
    """Gradient of the constraints' terms in the Lagrangian, (s,)."""
    pull = problem.linear.A.T @ linear
    if bodies.size:
        inertial = np.einsum("nkij,nij->nk", problem.scaled_matrices, bodies)
        pull[: problem.space.rigid] += inertial.ravel()
    for row, one in zip(problem.cone_rows, cones, strict=True):
        pull += row.T @ one / problem.space.scale
    return pull


def _gain(problem: Problem, x: np.ndarray, rest: np.ndarray) -> float:
    """What the Lagrangian can still fall below its value at x."""
    scale = problem.space.scale
    rows = problem.A * scale
    weight = 1.0
    if problem.entropy is not None:
        weight = problem.entropy.weight
        blocks = np.zeros((problem.space.rigid, problem.space.size))
        for k in range(len(problem.space.bodies)):
            part = slice(10 * k, 10 * k + 10)
            blocks[part, part] = distance_rows(x[part]) * scale[part]
        rows = np.vstack([rows / np.sqrt(weight), blocks])
    # |rest| in the inverse Hessian rows' rows.
    R = np.asarray(np.linalg.qr(rows, mode="r"))
    diagonal = np.abs(np.diag(R))
    if len(R) < rows.shape[1] or diagonal.min() <= _FALLS * diagonal.max():
        return float("inf")  # a direction that nothing holds: there it falls for ever
    decrement = float(np.linalg.norm(solve_triangular(R.T, rest / weight, lower=True)))
    if problem.entropy is None:
        return 0.5 * decrement**2
    if decrement >= 1.0:
        return float("inf")
    return weight * (-decrement - np.log1p(-decrement))


def _semidefinite(matrices: np.ndarray) -> tuple[np.ndarray, float]:
    """Nearest positive semidefinite matrices, and how far the given ones were from it."""
    if not matrices.size:
        return matrices, 0.0
    values, vectors = np.linalg.eigh(matrices)
    floor = min(0.0, float(values.min() / max(np.abs(values).max(), np.finfo(float).tiny)))
    return np.einsum("nik,nk,njk->nij", vectors, np.clip(values, 0.0, None), vectors), floor


def _in_cones(vectors: tuple[np.ndarray, ...]) -> tuple[list[np.ndarray], float]:
    """Vectors of the second-order cone near the given ones, and how far those were from it."""
    found, floor = [], 0.0
    for vector in vectors:
        norm = float(np.linalg.norm(vector[1:]))
        if norm > vector[0]:
            floor = min(floor, float((vector[0] - norm) / (norm or 1.0)))
        found.append(np.concatenate([[max(vector[0], norm)], vector[1:]]))
    return found, floor


def _signed(problem: Problem, linear: np.ndarray) -> tuple[np.ndarray, float]:
    """Multipliers of the signs that bounds allow, and how far the given ones were from it."""
    lower, upper = problem.linear.lower, problem.linear.upper
    low, high = np.where(np.isfinite(upper), -np.inf, 0.0), np.where(np.isfinite(lower), np.inf, 0)
    signed = np.clip(linear, low, high)
    size = max(float(np.abs(linear).max(initial=0.0)), np.finfo(float).tiny)
    return signed, min(0.0, -float(np.abs(signed - linear).max(initial=0.0)) / size)
