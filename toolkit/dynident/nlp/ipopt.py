"""Ipopt through CasADi, on a program whose variables and objective have been scaled."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dynident.nlp.blocks import Constraint, Cost, Residual, Variable
from dynident.nlp.status import Status

_WORDS = {
    "Solve_Succeeded": "solved",
    "Solved_To_Acceptable_Level": "inaccurate",
    "Feasible_Point_Found": "inaccurate",
    "Infeasible_Problem_Detected": "infeasible",
    "Diverging_Iterates": "unbounded",
    "Maximum_Iterations_Exceeded": "iteration limit",
}
_INTERRUPTED = "User_Requested_Stop"


@dataclass(frozen=True, eq=False)
class Attempt:
    """One run of the solver.

    Attributes
    ----------
    x : (k,) all variables, in SI units.
    objective : at x.
    multipliers : (m,) of the constraints.
    violation, stationarity : see `Solution`.
    """

    x: np.ndarray
    objective: float
    multipliers: np.ndarray
    violation: float
    stationarity: float
    status: Status


@dataclass(frozen=True, eq=False)
class Transcription:
    """A program as functions of one vector of unknowns.

    Attributes
    ----------
    scale : (k,) sizes of the unknowns.
    bounds : (2, k) and (2, m) lower and upper, of unknowns and of constraints, in SI units.
    """

    unknowns: Any
    objective: Any
    constraints: Any
    scale: np.ndarray
    bounds: np.ndarray
    constraint_bounds: np.ndarray
    _terms: Any

    @staticmethod
    def of(
        variables: Sequence[Variable],
        residuals: Sequence[Residual],
        costs: Sequence[Cost],
        constraints: Sequence[Constraint],
    ) -> Transcription:
        """Put a program's blocks into one vector of unknowns, one objective, one of constraints."""
        scale = np.concatenate([np.asarray(v.scale) for v in variables])
        unknowns = ca.MX.sym("z", len(scale))
        symbols = [v.symbol for v in variables]
        ends = np.cumsum([0, *(v.size for v in variables)]).tolist()
        pieces = ca.vertsplit(unknowns * scale, ends)
        terms = [0.5 * ca.sumsqr(r.expression) for r in residuals]
        terms += [c.expression for c in costs]
        rows = [ca.vec(ca.MX(c.expression)) for c in constraints]
        joined = ca.graph_substitute(
            [ca.vertcat(*terms), ca.vertcat(*rows) if rows else ca.MX(0, 1)], symbols, pieces
        )
        x = ca.vertcat(*symbols)
        none = np.zeros((2, 0))
        return Transcription(
            unknowns,
            ca.sum1(joined[0]),
            joined[1],
            scale,
            np.array([np.concatenate([getattr(v, w) for v in variables]) for w in _BOTH]),
            np.array([np.concatenate([getattr(c, w) for c in constraints]) for w in _BOTH])
            if constraints
            else none,
            ca.Function("terms", [x], [ca.vertcat(*terms)]),
        )

    def terms(self, x: np.ndarray) -> list[float]:
        """Each term of the objective at x (k,) in SI units."""
        return [float(value) for value in np.array(self._terms(x)).ravel()]


_BOTH = ("lower", "upper")


def run(form: Transcription, start: np.ndarray, tolerance: float, max_iterations: int) -> Attempt:
    """Solve from one start (k,) in SI units.

    The Hessian is exact: Ipopt gets it from CasADi. A Ctrl-C stops it and is passed on.
    """
    z = start / form.scale
    evaluate = ca.Function("objective", [form.unknowns], [form.objective])
    slope_of = ca.gradient(form.objective, form.unknowns)
    gradient = ca.Function("gradient", [form.unknowns], [slope_of])
    # Ipopt's tolerances are for objectives near one.
    size = max(1e-8, float(np.abs(np.array(gradient(z))).max(initial=0.0)))
    size = size if np.isfinite(size) else 1.0
    problem = {"x": form.unknowns, "f": form.objective / size, "g": form.constraints}
    options = {
        "print_time": False,
        "error_on_fail": False,
        "show_eval_warnings": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": tolerance,
            "max_iter": max_iterations,
            "honor_original_bounds": "yes",
        },
    }
    solver = ca.nlpsol("ipopt", "ipopt", problem, options)
    lower, upper = form.bounds / form.scale
    low, high = form.constraint_bounds
    started = time.perf_counter()
    found = solver(x0=z, lbx=lower, ubx=upper, lbg=low, ubg=high)
    seconds = time.perf_counter() - started
    stats = solver.stats()
    message = str(stats["return_status"])
    if message == _INTERRUPTED:
        raise KeyboardInterrupt
    z = np.array(found["x"]).ravel()
    value = np.array(found["g"]).ravel()
    objective = float(evaluate(z))
    status = Status(
        "Ipopt",
        _WORDS.get(message, "failed") if np.isfinite(objective) else "failed",
        message.replace("_", " "),
        int(stats["iter_count"]),
        seconds,
    )
    bounds = np.array(found["lam_x"]).ravel() * size
    multipliers = np.array(found["lam_g"]).ravel() * size
    slope = np.array(gradient(z)).ravel()
    jacobian = ca.Function("jtv", [form.unknowns], [ca.jacobian(form.constraints, form.unknowns)])
    pull = np.array(jacobian(z)).T @ multipliers if len(multipliers) else 0.0
    rest = slope + pull + bounds
    over = [0.0, *(low - value), *(value - high), *((lower - z) * form.scale)]
    return Attempt(
        z * form.scale,
        objective if np.isfinite(objective) else float("inf"),
        multipliers,
        float(np.nanmax([*over, *((z - upper) * form.scale)])),
        float(np.linalg.norm(rest) / max(np.linalg.norm(slope), 1e-300)),
        status,
    )
