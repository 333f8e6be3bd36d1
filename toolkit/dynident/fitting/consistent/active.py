"""Covariance of an estimate that lies on the boundary of what is possible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from dynident.inertia import distance_rows
from dynident.nlp import Problem

_ACTIVE = 1e-5  # of a body's or parameter's size: nearer to the boundary than this is on it


@dataclass(frozen=True, eq=False)
class ActiveSet:
    """The constraints that hold an estimate back.

    Attributes
    ----------
    bodies : names of the links on the boundary of the consistent ones.
    linear : number of linear and second-order constraints that hold with equality.
    covariance : (s, s) of the standard parameters, within the active constraints.
    """

    bodies: tuple[str, ...]
    linear: int
    covariance: np.ndarray

    @property
    def sentence(self) -> str:
        """What the covariance means, in words."""
        if not self.bodies and not self.linear:
            return "No constraint is active: sigma is that of data and prior together."
        parts = []
        if self.bodies:
            parts.append(f"{len(self.bodies)} links are on the boundary ({', '.join(self.bodies)})")
        if self.linear:
            parts.append(f"{self.linear} other constraints hold with equality")
        return (
            f"{' and '.join(parts)}: sigma is that of data and prior together, along the active "
            "constraints only and to first order. At a boundary errors are one-sided, not normal; "
            "intervals from it are indicative."
        )


def active_set(problem: Problem, x: np.ndarray) -> ActiveSet:
    """Return the active constraints at an answer x (s,), and its covariance along them.

    A flat body stays as flat as it is: with V the null space of its matrix, V' M(d) V = 0 for the
    directions d that are left. The curvature of the boundary is neglected.
    """
    space, scale = problem.space, problem.space.scale
    rows: list[np.ndarray] = []
    bodies = []
    basis = problem.scaled_matrices
    for k, matrix in enumerate(problem.body_matrices(x)):
        if not matrix.size:
            continue
        values, vectors = np.linalg.eigh(matrix)
        flat = vectors[:, values < _ACTIVE * max(values[-1], 1.0)]
        if not flat.shape[1]:
            continue
        bodies.append(space.bodies[k])
        i, j = np.triu_indices(flat.shape[1])
        along = np.einsum("ai,pab,bj->ijp", flat, basis[k], flat)[i, j]
        row = np.zeros((len(along), space.size))
        row[:, 10 * k : 10 * k + 10] = along
        rows.append(row * scale)
    linear = problem.linear
    value = linear.A @ x
    held = (value - linear.lower < _ACTIVE) | (linear.upper - value < _ACTIVE)
    rows.append(linear.A[held] * scale)
    others = int(held.sum())
    for cone in problem.cones:
        vector = cone.A @ x
        norm = np.linalg.norm(vector[1:])
        if vector[0] - norm < _ACTIVE * vector[0]:
            rows.append(((cone.A[0] - vector[1:] @ cone.A[1:] / norm) * scale)[None])
            others += 1
    information = [problem.A * scale]
    if problem.entropy is not None:
        information.append(_entropy_rows(problem, x) * scale)
    stacked = np.vstack(information)
    active = np.vstack(rows)
    free = null_space(active) if len(active) else np.eye(space.size)
    root = np.linalg.pinv(stacked @ free)
    half = scale[:, None] * (free @ root)
    return ActiveSet(tuple(bodies), others, half @ half.T)


def _entropy_rows(problem: Problem, x: np.ndarray) -> np.ndarray:
    """Root of the entropy's Hessian at x."""
    assert problem.entropy is not None
    rows = np.zeros((problem.space.rigid, problem.space.size))
    for k in range(len(problem.space.bodies)):
        part = slice(10 * k, 10 * k + 10)
        rows[part, part] = np.sqrt(problem.entropy.weight) * distance_rows(x[part])
    return rows
