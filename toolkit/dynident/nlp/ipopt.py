"""The solution of a scaled program by Ipopt, from one or several starts.

`casadi.nlpsol` solves. `casadi.Opti` above it was tried and makes this no shorter: it knows neither
names nor units, counts bounds of variables among the constraints, changes in place, and raises
where a start fails. Ours is what neither has: scales that follow from the program, an end that is
checked in plain arithmetic at the point that Ipopt hands on, and a Ctrl-C that arrives.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from dynident.nlp.scaled import ScaledProgram
from dynident.nlp.status import Status

_WORDS = {
    "Solve_Succeeded": "solved",
    "Feasible_Point_Found": "solved",
    "Infeasible_Problem_Detected": "infeasible",
    "Diverging_Iterates": "unbounded",
    "Maximum_Iterations_Exceeded": "iteration limit",
}
_STALLED = {
    "Solved_To_Acceptable_Level",
    "Search_Direction_Becomes_Too_Small",
    "Restoration_Failed",
    "Error_In_Step_Computation",
}
_NEAR = 1e-6  # relative stationarity, violation and complementarity of a solution
_FAR = 1e-2  # relative stationarity where the objective merely became flat, on its way to infinity


@dataclass(frozen=True, eq=False, kw_only=True)
class Attempt:
    """Where one start ended.

    Attributes
    ----------
    start : (k,) all variables where it began, in their units.
    status : how the solver ended.
    x : (k,) all variables in their units; the last iterate where it failed.
    terms : (t,) of the objective.
    objective : their sum; NaN where the start has none.
    violation : of the worst constraint or bound, in units of its scale; 0 where all hold.
    stationarity : largest entry of the Lagrangian's gradient, in units of the variables' scales and
        relative to the objective's largest gradient or curvature there: about the step, in scales,
        that is still missing.
    complementarity : largest product of a multiplier and its distance from the bound, relative
        likewise.
    of_bounds, of_rows : (k,), (m,) multipliers of the variables' bounds and of the constraints:
        what the objective grows by per unit that a bound grows.
    """

    start: np.ndarray
    status: Status
    x: np.ndarray
    terms: np.ndarray
    objective: float
    violation: float
    stationarity: float
    complementarity: float
    of_bounds: np.ndarray
    of_rows: np.ndarray

    @property
    def rank(self) -> tuple[bool, bool, float]:
        """Solutions first, then what comes near the constraints, then the lowest objective."""
        objective = self.objective if np.isfinite(self.objective) else np.inf
        return not self.status.ok, not self.violation <= _NEAR, objective


def solve_scaled(
    program: ScaledProgram, starts: Sequence[np.ndarray], tolerance: float, max_iterations: int
) -> tuple[Attempt, ...]:
    """Solve a program from each start. One that fails raises nothing.

    Parameters
    ----------
    program : to solve.
    starts : of all variables, (k,) in their units and within their bounds.
    tolerance : Ipopt's, on the scaled program.
    max_iterations : of each start.

    Returns
    -------
    Where each start ended, in the order of the starts.
    """
    points = [program.at(start / program.scale) for start in starts]
    undefined = [program.undefined(point) for point in points]
    # All starts under one scaling, or the tolerance would mean another thing for each.
    scales = program.scales(points[undefined.index("") if "" in undefined else 0])
    solver = _ipopt(program, tolerance, max_iterations)
    return tuple(
        _nowhere(program, start, point.terms, name)
        if name
        else _attempt(program, solver, scales, tolerance, start)
        for start, point, name in zip(starts, points, undefined, strict=True)
    )


def _nowhere(program: ScaledProgram, start: np.ndarray, terms: np.ndarray, name: str) -> Attempt:
    """A start from which there is no way."""
    return Attempt(
        start=start,
        status=Status("Ipopt", "failed", f"{name} is not finite at the start"),
        x=start,
        terms=terms,
        objective=np.nan,
        violation=np.nan,
        stationarity=np.nan,
        complementarity=np.nan,
        of_bounds=np.full(len(start), np.nan),
        of_rows=np.full(len(program.row_lower), np.nan),
    )


def _attempt(
    program: ScaledProgram, solver: Any, scales: np.ndarray, tolerance: float, start: np.ndarray
) -> Attempt:
    found = _run(program, solver, scales, start)
    # A start far away has gradients so large that its scale makes the tolerance loose: once more.
    scale = program.at(found.x / program.scale).scale
    if found.status.ok and found.stationarity > tolerance and scale < 0.1 * scales[0]:
        again = _run(program, solver, np.append(scale, scales[1:]), found.x)
        if again.status.ok and again.stationarity < found.stationarity:
            return replace(again, start=start, status=again.status.after(found.status))
    return found


def _run(program: ScaledProgram, solver: Any, scales: np.ndarray, start: np.ndarray) -> Attempt:
    lower, upper, size = program.row_lower, program.row_upper, scales[1:]
    began = time.perf_counter()
    with interruptible():
        result = solver(
            x0=start / program.scale,
            p=scales,
            lbx=program.lower,
            ubx=program.upper,
            lbg=lower / size,
            ubg=upper / size,
        )
    seconds, stats = time.perf_counter() - began, solver.stats()
    z, of_bounds, of_rows = (result[name].full().ravel() for name in ("x", "lam_x", "lam_g"))
    z = np.clip(z, program.lower, program.upper)
    here = program.at(z)
    # CasADi adds multipliers times constraints to the objective; here the objective grows by them.
    of_rows = 0.0 - scales[0] * of_rows / size
    remaining = here.gradient - here.jacobian.T @ of_rows
    fixed = program.lower == program.upper
    of_bounds = np.where(fixed, remaining, 0.0 - scales[0] * of_bounds)
    products = np.concatenate(
        [
            _products(of_bounds, z, program.lower, program.upper),
            _products(of_rows, here.rows, lower, upper),
        ]
    )
    violation = _largest(np.maximum(lower - here.rows, here.rows - upper) / size)
    stationarity = _largest(np.abs(remaining - of_bounds)) / here.scale
    complementarity = _largest(products) / here.scale
    message = str(stats["return_status"])
    status = Status(
        "Ipopt",
        _word(message, stationarity, max(violation, stationarity, complementarity)),
        message.replace("_", " "),
        iterations=int(stats["iter_count"]),
        seconds=seconds,
    )
    return Attempt(
        start=start,
        status=status,
        x=z * program.scale,
        terms=here.terms,
        objective=float(np.sum(here.terms)),
        violation=violation,
        stationarity=stationarity,
        complementarity=complementarity,
        of_bounds=of_bounds / program.scale,
        of_rows=of_rows,
    )


def _word(message: str, stationarity: float, worst: float) -> str:
    """How it ended: Ipopt's word, checked against what was computed here at its last point."""
    word = _WORDS.get(message, "failed")
    if message in _STALLED and worst <= _NEAR:
        return "inaccurate"
    if word == "solved" and worst > _NEAR:
        return "inaccurate" if stationarity <= _FAR else "failed"
    return word


def _products(
    multipliers: np.ndarray, at: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Products of multipliers and the distance from the bound that they belong to."""
    distance = np.where(multipliers > 0, at - lower, upper - at)
    # A free entry has a multiplier of rounding only, and no distance.
    return np.abs(multipliers) * np.where(np.isfinite(distance), np.abs(distance), 0.0)


def _largest(values: np.ndarray) -> float:
    return float(np.max(values, initial=0.0))


def _ipopt(program: ScaledProgram, tolerance: float, max_iterations: int) -> Any:
    """Ipopt, silent, with exact Hessian."""
    options = {
        "print_time": False,
        "show_eval_warnings": False,  # a step into nowhere is shortened, nothing to report
        "calc_lam_p": False,
        "hess_lag": program.hessian,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": tolerance,
            "max_iter": max_iterations,
            "nlp_scaling_method": "none",
            "bound_relax_factor": min(1e-8, tolerance),
            "honor_original_bounds": "yes",
        },
    }
    return ca.nlpsol("solver", "ipopt", program.nlp, options)


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise what Ctrl-C raises once the work has ended: CasADi ends a call, and swallows the rest.

    That holds for its solvers and for a plain evaluation, which then returns None.
    """
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    caught: list[BaseException] = []

    def note(number: int, frame: Any) -> None:
        try:
            handler(number, frame)
        except BaseException as exception:
            caught.append(exception)
            raise

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if caught:
            raise caught[0]
