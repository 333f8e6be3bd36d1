"""Links that nothing couples, solved one by one: the worst would swamp the digits of the rest."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest

import numpy as np

from dynident.fitting.consistent.programs import CertifiedPoint, Solver, solve, trivial
from dynident.nlp import Bound, Problem, Status, certify


def solve_apart(problem: Problem, solver: Solver, x_hat: np.ndarray) -> CertifiedPoint:
    """Project a point x_hat (s,) under a metric of each link of its own, and certify the whole.

    Parameters
    ----------
    problem : with quadratic rows that hold parameters of one link each, or one of an effect; no
        constraint sets.
    solver : see `Solver`.
    x_hat : (s,) where the rows are zero.

    Returns
    -------
    The answer for all links together, its bound the sum of theirs.

    Raises
    ------
    FitError
        As `consistent.solve`.
    """
    space, parts = problem.space, []
    x = np.array(x_hat)
    x[space.rigid :] = np.clip(
        x[space.rigid :], space.lower[space.rigid :], space.upper[space.rigid :]
    )
    effects = 0.5 * float(np.sum((problem.A @ x - problem.b) ** 2))
    for k in range(len(space.bodies)):
        part = slice(10 * k, 10 * k + 10)
        answer = _solve_one(_alone(problem, k), solver, x_hat[part])
        x[part] = answer.x
        parts.append(answer.certificate)
    bounds = [0.0 if np.isnan(one.bound) else one.bound for one in parts]
    bound = Bound(
        effects + sum(bounds),
        max(_number(one.stationarity) for one in parts),
        min(_number(one.dual_feasibility) for one in parts),
    )
    worst = max(parts, key=lambda one: (not one.status.ok, one.status.iterations))
    # What all links' first, second ... starts reach together; links with fewer reached their best.
    tried = [one.starts or (one.objective,) for one in parts]
    together = zip_longest(*tried)
    starts = tuple(
        effects + sum(min(own) if one is None else one for one, own in zip(row, tried, strict=True))
        for row in together
    )
    starts = starts if any(one.starts for one in parts) else ()
    return CertifiedPoint(
        x, certify(problem, x, worst.status, f"{worst.program}, link by link", bound, starts)
    )


def _alone(problem: Problem, k: int) -> Problem:
    """The problem of body k."""
    space, part = problem.space, slice(10 * k, 10 * k + 10)
    own = replace(
        space,
        names=space.names[part],
        units=space.units[part],
        bodies=space.bodies[k : k + 1],
        references=space.references[k : k + 1],
        lower=space.lower[part],
        upper=space.upper[part],
        combination=space.combination[:, part],
        given=space.given[part],
        scale=space.scale[part],
    )
    rows = np.any(problem.A[:, part] != 0, axis=1)
    return replace(problem, space=own, A=problem.A[rows, part], b=problem.b[rows])


def _solve_one(problem: Problem, solver: Solver, x_hat: np.ndarray) -> CertifiedPoint:
    if problem.feasible(x_hat):
        return trivial(problem, x_hat)
    edge = problem.retracted(x_hat)
    if problem.body_violation(x_hat) == 0 and problem.feasible(edge):
        # On the edge already (an inertia without mass): as far inside as rounding demands.
        status = Status("none", "solved", "on the edge already")
        return CertifiedPoint(edge, certify(problem, edge, status, "a step off the edge", None))
    return solve(problem, solver, x_hat)


def _number(value: float) -> float:
    return 0.0 if np.isnan(value) else value
