"""Solve a constrained problem, whole or link by link, and certify the answer.

In: a `Problem` and the solver that is asked for. Out: a `CertifiedPoint`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Literal

import numpy as np

from dynident.errors import FitError
from dynident.nlp import (
    Bound,
    Certificate,
    Problem,
    Status,
    certify,
    lower_bound,
    solve_conic,
    unconstrained_bound,
)

Solver = Literal["conic", "nlp"]
"""conic: Clarabel, finds the optimum; nlp: Ipopt over parameters that are consistent whatever
their values, from several starts, its answer compared with the conic bound."""


@dataclass(frozen=True, eq=False)
class CertifiedPoint:
    """An answer x (s,) to a problem, and what is proved about it."""

    x: np.ndarray
    certificate: Certificate


def require_solver(solver: str) -> None:
    """Refuse a solver that does not exist.

    Raises
    ------
    FitError
        Naming the choices.
    """
    if solver not in ("conic", "nlp"):
        raise FitError(f"no solver '{solver}'", remedy="choose conic or nlp")


def solve(problem: Problem, solver: Solver, stay: np.ndarray | None = None) -> CertifiedPoint:
    """Solve a problem and certify the answer.

    Parameters
    ----------
    problem : what is minimised, and within which sets.
    solver : see `Solver`.
    stay : (s,) parameters that a link keeps, to the bit, where another answer is no better.

    Returns
    -------
    The answer, and how near to the optimum it is proved to be.

    Raises
    ------
    FitError
        If no point satisfies the constraints, or the solver fails; or if the metric leaves
        directions free and there is no prior.
    """
    require_solver(solver)
    problem = problem.reduced()
    problem.require_held()
    free = problem.unconstrained
    if free is not None and problem.feasible(free):
        status = Status("least squares", "solved", "no constraint is active")
        bound = unconstrained_bound(problem, free)
        return CertifiedPoint(free, certify(problem, free, status, "linear least squares", bound))
    conic = solve_conic(problem)
    _require(conic.status, problem)
    assert conic.multipliers is not None
    bound = lower_bound(problem, conic.x, conic.multipliers)
    if solver == "conic":
        x = _kept(problem, problem.retracted(conic.x), stay)
        return CertifiedPoint(x, certify(problem, x, conic.status, "conic program", bound))
    from dynident.nlp.parametrised import solve_nonlinear

    found = solve_nonlinear(problem, bound.value)
    if not np.all(np.isfinite(found.x)) or not found.inside:
        _require(found.status, problem)
    x = _kept(problem, problem.retracted(found.x), stay)
    bound = replace(bound, stationarity=found.solution.stationarity)
    certificate = certify(problem, x, found.status, found.program, bound, found.objectives)
    return CertifiedPoint(x, certificate)


def _kept(problem: Problem, x: np.ndarray, stay: np.ndarray | None) -> np.ndarray:
    """X with the links of `stay` wherever that is no worse.

    Solvers leave a link that need not move by about 1e-5 of its size.
    """
    if stay is None:
        return x
    rigid = problem.space.rigid
    parts = [slice(k, k + 10) for k in range(0, rigid, 10)]
    parts += [slice(k, k + 1) for k in range(rigid, problem.space.size)]
    violation = problem.violation(x)
    for part in parts:
        candidate = np.array(x)
        candidate[part] = stay[part]
        better = problem.objective(candidate) <= problem.objective(x)
        if better and problem.violation(candidate) <= violation and problem.feasible(candidate):
            x = candidate
    return x


def trivial(problem: Problem, x: np.ndarray) -> CertifiedPoint:
    """The answer to a projection of a point x (s,) that is within already: itself."""
    status = Status("none", "solved", "already within")
    centred = replace(problem, b=problem.A @ x, entropy=None)
    return CertifiedPoint(
        x, certify(centred, x, status, "none needed: it lies within already", None)
    )


def _require(status: Status, problem: Problem) -> None:
    if status.ok:
        return
    if status.word == "infeasible":
        names = [c.name for one in problem.within.sets for c in one.on(problem.space)]
        what = "no robot satisfies all constraints at once"
        raise FitError(what, ", ".join(dict.fromkeys(names)) or None, "loosen one of them")
    raise FitError(f"no answer was found ({status})", remedy="check units; try solver='conic'")


# --- links that nothing couples: the worst would swamp the digits of the rest --------------------


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
        answer = _solve_alone(_alone(problem, k), solver, x_hat[part])
        x[part] = answer.x
        parts.append(answer.certificate)
    bounds = [0.0 if np.isnan(one.bound) else one.bound for one in parts]
    bound = Bound(
        effects + sum(bounds),
        max(_or_zero(one.stationarity) for one in parts),
        min(_or_zero(one.dual_feasibility) for one in parts),
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


def _solve_alone(problem: Problem, solver: Solver, x_hat: np.ndarray) -> CertifiedPoint:
    if problem.feasible(x_hat):
        return trivial(problem, x_hat)
    edge = problem.retracted(x_hat)
    if problem.body_violation(x_hat) == 0 and problem.feasible(edge):
        # On the edge already (an inertia without mass): as far inside as rounding demands.
        status = Status("none", "solved", "on the edge already")
        return CertifiedPoint(edge, certify(problem, edge, status, "a step off the edge", None))
    return solve(problem, solver, x_hat)


def _or_zero(value: float) -> float:
    return 0.0 if np.isnan(value) else value
