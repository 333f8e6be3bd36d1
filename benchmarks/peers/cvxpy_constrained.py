"""Consistent least squares as one writes it in cvxpy, solved by Clarabel."""

from __future__ import annotations

from typing import Any

import cvxpy as cp  # pyright: ignore[reportMissingImports]
import numpy as np
from answering import answer

PLACES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Of the six moments of inertia."""


def pseudo_inertia(unit: np.ndarray) -> np.ndarray:
    """Of ten parameters (m, m c, I about the origin), (4, 4)."""
    moments = np.zeros((3, 3))
    for value, (i, j) in zip(unit[4:], PLACES, strict=True):
        moments[i, j] = moments[j, i] = value
    J = np.zeros((4, 4))
    J[:3, :3] = 0.5 * np.trace(moments) * np.eye(3) - moments
    J[:3, 3] = J[3, :3] = unit[1:4]
    J[3, 3] = unit[0]
    return J


def solve(work: Any, _: dict[str, str]) -> np.ndarray:
    A, b, scale = work["A"], work["b"], work["scale"]
    z = cp.Variable(len(scale))
    basis = [pseudo_inertia(unit) for unit in np.eye(10)]
    constraints = []
    for k in range(int(work["bodies"])):
        # In units of its mass and of one moment: the cone's rows are then of one size.
        S = np.diag([scale[10 * k + 4] ** -0.5] * 3 + [scale[10 * k] ** -0.5])
        J = sum(z[10 * k + i] * (scale[10 * k + i] * S @ basis[i] @ S) for i in range(10))
        constraints.append(J >> 0)
    if work["nonnegative"].size:
        constraints.append(z[work["nonnegative"]] >= 0)
    problem = cp.Problem(cp.Minimize(cp.sum_squares((A * scale) @ z - b)), constraints)
    problem.solve(solver=cp.CLARABEL)
    if z.value is None:
        raise SystemExit(f"no solution: {problem.status}")
    return scale * z.value


answer(solve)
