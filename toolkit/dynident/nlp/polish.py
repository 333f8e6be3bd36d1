"""The last digits of a conic optimum: Newton's method on the constraints that are active.

An interior-point method ends when the objective is right to some digits, and then has half as many
of the parameters. Which constraints are active is certain by then; on these, Newton's method
converges quadratically (the second-order term of a matrix on the boundary is that of its Schur
complement: Shapiro and Fan, "On eigenvalue optimization", SIAM J. Optim. 1995).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import solve_triangular

from dynident.inertia import distance_rows
from dynident.nlp.duality import Bound, Multipliers, lower_bound
from dynident.nlp.problem import Problem

_STEPS = 6
_IN_VAIN = 2  # steps without gain, after which Newton's method is not where it converges
_ENOUGH = 1e-9  # stationarity, relative: parameters are then right to twice as many digits
_ROUNDING = 1e-9  # what a step may break a constraint by, and of the objective what is no loss
_DEPENDENT = 1e-4  # of the largest: constraints nearer than this to dependent are
_APEX = 1e-6  # of a cone's size: nearer to its tip there is no tangent


@dataclass(frozen=True, eq=False)
class _Pattern:
    """Which constraints are active.

    Attributes
    ----------
    flat : of each body, in how many directions its matrix is zero.
    held, at : indices of the linear constraints that hold with equality, and their bounds.
    cones : indices of the second-order cones on whose boundary the solution is.
    """

    flat: tuple[int, ...]
    held: np.ndarray
    at: np.ndarray
    cones: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Tangent:
    """Active constraints near a point, in parameters in units of their size z (s,).

    Attributes
    ----------
    C, c : gradients (k, s) and values (k,), zero at the optimum.
    curvature : (l, s) rows: their square is the constraints' part of the Lagrangian's Hessian.
    planes : of each body, the directions (d, r) in which its matrix is zero.
    normals : of each cone of the pattern, its inward normal.
    """

    C: np.ndarray
    c: np.ndarray
    curvature: np.ndarray
    planes: tuple[np.ndarray, ...]
    normals: tuple[np.ndarray, ...]


def polished(
    problem: Problem, x: np.ndarray, multipliers: Multipliers
) -> tuple[np.ndarray, Multipliers]:
    """Return an optimum with more digits, or as it is where Newton's method brings none.

    Parameters
    ----------
    problem : that was solved.
    x : (s,) what a conic solver found.
    multipliers : its own.

    Returns
    -------
    (s,) the optimum, and its multipliers.
    """
    pattern = _pattern(problem, x, multipliers)
    best = current = x, multipliers
    bound, excess = _proof(problem, *current)
    excess = max(excess, _ROUNDING * problem.objective(x))
    in_vain = 0
    for _ in range(_STEPS):
        try:
            current = _step(problem, *current, pattern)
        except np.linalg.LinAlgError:  # no tangent: the step led out of the entropy, or to a tip
            break
        found, more = _proof(problem, *current)
        if (
            found.stationarity < bound.stationarity
            and found.dual_feasibility >= -_ROUNDING
            and _violation(problem, current[0]) <= _ROUNDING
            and more <= excess
        ):
            best, bound, in_vain = current, found, 0
        else:
            in_vain += 1
        if bound.stationarity < _ENOUGH or in_vain == _IN_VAIN or not np.isfinite(found.value):
            break
    return best


def _proof(problem: Problem, x: np.ndarray, multipliers: Multipliers) -> tuple[Bound, float]:
    """The bound that multipliers prove, and how far the objective is from it."""
    x = problem.retracted(x)
    bound = lower_bound(problem, x, multipliers)
    return bound, abs(problem.objective(x) - bound.value)


def _violation(problem: Problem, x: np.ndarray) -> float:
    return max(problem.violation(x), problem.body_violation(x - problem.inset))


def _pattern(problem: Problem, x: np.ndarray, multipliers: Multipliers) -> _Pattern:
    """Find active constraints by their multipliers, which are then larger than what is left.

    Multipliers are in units of the objective, what is left in units of the parameters' size.
    """
    unit = problem.objective(x) or 1.0
    flat = []
    if multipliers.bodies.size:
        matrices = problem.body_matrices(x - problem.inset)
        for matrix, dual in zip(matrices, multipliers.bodies, strict=True):
            # The two commute at the optimum, and of each pair of eigenvalues one is zero.
            flat.append(int(np.sum(np.linalg.eigvalsh(matrix - dual / unit) < 0)))
    linear = problem.linear
    below, above = linear.A @ x - linear.lower, linear.upper - linear.A @ x
    active = np.abs(multipliers.linear) / unit > np.minimum(below, above)
    held = np.flatnonzero((linear.lower == linear.upper) | active)
    at = np.where(below <= above, linear.lower, linear.upper)[held]
    cones = []
    for k, (dual, value) in enumerate(zip(multipliers.cones, problem.cone_values(x), strict=True)):
        if dual[0] / unit > value[0] - np.linalg.norm(value[1:]):
            cones.append(k)
    return _Pattern(tuple(flat), held, at, tuple(cones))


def _step(
    problem: Problem, x: np.ndarray, before: Multipliers, pattern: _Pattern
) -> tuple[np.ndarray, Multipliers]:
    """One step: the quadratic model of the Lagrangian on the active constraints' tangent."""
    scale = problem.space.scale
    tangent = _tangent(problem, x, before, pattern)
    rows, rest = [problem.A * scale], [problem.b - problem.A @ x]
    if problem.entropy is not None:
        root, gradient = np.sqrt(problem.entropy.weight), problem.entropy_gradient(x)
        for k in range(len(problem.space.bodies)):
            part = slice(10 * k, 10 * k + 10)
            square = root * distance_rows(x[part])
            rows.append(np.zeros((10, len(x))))
            rows[-1][:, part] = square * scale[part]
            rest.append(-np.linalg.solve(square.T, gradient[part]))
    H = np.vstack([*rows, tangent.curvature])
    r = np.concatenate([*rest, np.zeros(len(tangent.curvature))])
    left, values, right = np.linalg.svd(tangent.C)
    rank = int(np.sum(values > _DEPENDENT * values.max(initial=0.0)))
    inverse = right[:rank].T / values[:rank] @ left[:, :rank].T
    start, free = -inverse @ tangent.c, right[rank:].T
    Q, R = np.linalg.qr(H @ free)
    d = start + free @ solve_triangular(R, Q.T @ (r - H @ start))
    # The gradient after the step is a combination of the constraints' gradients.
    factors = inverse.T @ (H.T @ (H @ d - r))
    return x + scale * d, _unpacked(before, factors, tangent, pattern)


def _tangent(
    problem: Problem, x: np.ndarray, multipliers: Multipliers, pattern: _Pattern
) -> _Tangent:
    scale, linear = problem.space.scale, problem.linear
    C, c = [linear.A[pattern.held] * scale], [(linear.A @ x)[pattern.held] - pattern.at]
    curvature, planes, normals = [np.zeros((0, len(x)))], [], []
    matrices = problem.body_matrices(x - problem.inset)
    for k, r in enumerate(pattern.flat):
        values, vectors = np.linalg.eigh(matrices[k])
        plane, others = vectors[:, :r], vectors[:, r:] / np.sqrt(np.abs(values[r:]))
        planes.append(plane)
        if not r:
            continue
        part = slice(10 * k, 10 * k + 10)
        basis = problem.scaled_matrices[k] * scale[part][:, None, None]
        i, j = _upper(r)
        C.append(np.zeros((len(i), len(x))))
        C[-1][:, part] = np.einsum("ai,pab,bj->ijp", plane, basis, plane)[i, j]
        c.append((plane.T @ matrices[k] @ plane)[i, j])
        strength, axes = np.linalg.eigh(plane.T @ multipliers.bodies[k] @ plane)
        half = plane @ axes * np.sqrt(2 * np.clip(strength, 0.0, None))
        bend = np.einsum("au,pab,bv->uvp", others, basis, half).reshape(-1, 10)
        curvature.append(np.zeros((len(bend), len(x))))
        curvature[-1][:, part] = bend
    for k in pattern.cones:
        rows = problem.cone_rows[k]
        value = rows @ (x / scale)
        norm = float(np.linalg.norm(value[1:]))
        if norm < _APEX:
            raise np.linalg.LinAlgError("the tip of a cone")
        normals.append(np.append(1.0, -value[1:] / norm))
        C.append((normals[-1] @ rows)[None])
        c.append(np.array([value[0] - norm]))
        across = rows[1:] - np.outer(normals[-1][1:], normals[-1][1:] @ rows[1:])
        strength = max(float(multipliers.cones[k][0]), 0.0)
        curvature.append(np.sqrt(strength / norm) * across)
    return _Tangent(
        np.vstack(C), np.concatenate(c), np.vstack(curvature), tuple(planes), tuple(normals)
    )


@cache
def _upper(r: int) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.triu_indices(r)
    return i, j


def _unpacked(
    before: Multipliers, factors: np.ndarray, tangent: _Tangent, pattern: _Pattern
) -> Multipliers:
    """Multipliers of all constraints from those of the active ones."""
    linear = np.zeros_like(before.linear)
    linear[pattern.held] = factors[: len(pattern.held)]
    at = len(pattern.held)
    bodies = np.zeros_like(before.bodies)
    for k, (plane, r) in enumerate(zip(tangent.planes, pattern.flat, strict=True)):
        i, j = _upper(r)
        # An entry beside the diagonal stands for two.
        dual = np.zeros((r, r))
        dual[i, j] = factors[at : at + len(i)] / 2
        bodies[k] = plane @ (dual + dual.T) @ plane.T
        at += len(i)
    cones = [np.zeros_like(one) for one in before.cones]
    for k, normal in zip(pattern.cones, tangent.normals, strict=True):
        cones[k] = factors[at] * normal
        at += 1
    return Multipliers(bodies, linear, tuple(cones))
