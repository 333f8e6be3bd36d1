"""Consistent least squares of figaroh (PICOS and CVXOPT), with its own prior."""

from __future__ import annotations

from typing import Any

import numpy as np
from answering import answer
from figaroh.identification.physical_fit import (  # pyright: ignore[reportMissingImports]
    PhysicalPolicy,
    build_problem,
    solve_direct_effort_fit,
)


def solve(work: Any, _: dict[str, str]) -> np.ndarray:
    problem = build_problem(
        work["Y"],
        work["tau"],
        [str(name) for name in work["names"]],
        [str(name) for name in work["joints"]],
        prior=work["prior"],
        policy=PhysicalPolicy(prior_weight=1e-6),
    )
    found = solve_direct_effort_fit(problem, solver="cvxopt")
    if found.theta is None:
        raise SystemExit(f"no solution: {found.solver_status}")
    return found.theta


answer(solve)
