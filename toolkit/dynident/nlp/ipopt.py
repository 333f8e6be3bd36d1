"""The solution of a nonlinear program by Ipopt, from one or several starts."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import ProgramError
from dynident.nlp.compiled import Compiled, array_of, ipopt_solver
from dynident.nlp.solution import Attempt, ProgramSolution
from dynident.nlp.status import Status
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from dynident.nlp.program import Program

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


@contextmanager
def _interruptible() -> Iterator[None]:
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


@single_threaded
@_interruptible()
def solve(
    program: Program,
    starts: Sequence[Mapping[str, ArrayLike]] | None,
    tolerance: float,
    max_iterations: int,
) -> ProgramSolution:
    """Solve a program from each of its starts; see `Program.solve`."""
    if not 0 < tolerance < 1:
        raise ProgramError(f"tolerance = {tolerance:g}", program.title, "choose it within 0 and 1")
    compiled = program.compiled
    points = [program.point(start) for start in ([{}] if starts is None else starts)]
    if not points:
        raise ProgramError("there is no start", program.title, "give one, or None")
    undefined = [compiled.undefined(point) for point in points]
    # All starts under one scaling, or the tolerance would mean another thing for each.
    first = next((i for i, name in enumerate(undefined) if name is None), 0)
    scales = compiled.scales(points[first])
    solver = ipopt_solver(compiled.nlp, compiled.hessian, tolerance, max_iterations)
    attempts = tuple(
        _attempt(compiled, solver, scales, tolerance, point) if name is None else _none(point, name)
        for point, name in zip(points, undefined, strict=True)
    )
    best = min(attempts, key=_rank)
    parts = array_of(compiled.terms(compiled.flat(best.values)))
    names = (term.name for term in program.terms)
    return ProgramSolution(
        program, best, attempts, dict(zip(names, map(float, parts), strict=True))
    )


def _none(point: dict[str, np.ndarray], name: str) -> Attempt:
    """A start from which there is no way."""
    status = Status("Ipopt", "failed", f"{name} is not finite at the start", 0, 0.0)
    return Attempt(point, point, status, np.nan, np.nan, np.nan, np.nan, {})


def _attempt(
    compiled: Compiled,
    solver: Any,
    scales: np.ndarray,
    tolerance: float,
    point: dict[str, np.ndarray],
) -> Attempt:
    found = _run(compiled, solver, scales, point, point)
    # A start far away has gradients so large that its scale makes the tolerance loose: once more.
    scale = compiled.objective_scale(compiled.flat(found.values))
    if found.status.ok and found.stationarity > tolerance and scale < 0.1 * scales[0]:
        again = _run(compiled, solver, np.append(scale, scales[1:]), point, found.values)
        if again.status.ok and again.stationarity < found.stationarity:
            before, after = found.status, again.status
            together = replace(
                after,
                iterations=before.iterations + after.iterations,
                seconds=before.seconds + after.seconds,
            )
            return replace(again, status=together)
    return found


def _run(
    compiled: Compiled,
    solver: Any,
    scales: np.ndarray,
    start: dict[str, np.ndarray],
    at: dict[str, np.ndarray],
) -> Attempt:
    size, began = scales[1:], time.perf_counter()
    with _interruptible():
        result = solver(
            x0=compiled.flat(at),
            p=scales,
            lbx=compiled.lower,
            ubx=compiled.upper,
            lbg=compiled.constraint_lower / size,
            ubg=compiled.constraint_upper / size,
        )
    seconds = time.perf_counter() - began
    stats = solver.stats()
    message, values = str(stats["return_status"]), compiled.split(array_of(result["x"]))
    z = compiled.flat(values)
    objective, gradient = compiled.objective_gradient(z)
    rows, jacobian = compiled.constraint_jacobian(z)
    # CasADi adds multipliers times constraints to the objective; here the objective grows by them.
    of_rows = 0.0 - scales[0] * array_of(result["lam_g"]) / size
    remaining = gradient - jacobian.T @ of_rows
    fixed = compiled.lower == compiled.upper
    of_bounds = np.where(fixed, remaining, 0.0 - scales[0] * array_of(result["lam_x"]))
    relative = compiled.objective_scale(z)
    gaps = np.concatenate(
        [
            _gaps(of_bounds, z, compiled.lower, compiled.upper),
            _gaps(of_rows, rows, compiled.constraint_lower, compiled.constraint_upper),
        ]
    )
    broken = np.maximum(compiled.constraint_lower - rows, rows - compiled.constraint_upper) / size
    violation = _largest(broken)
    stationarity = _largest(np.abs(remaining - of_bounds)) / relative
    complementarity = _largest(gaps) / relative
    word = _word(message, violation, stationarity, complementarity)
    return Attempt(
        start,
        values,
        Status("Ipopt", word, message.replace("_", " "), int(stats["iter_count"]), seconds),
        objective,
        violation,
        stationarity,
        complementarity,
        compiled.by_name(of_bounds / compiled.scale, of_rows),
    )


def _word(message: str, violation: float, stationarity: float, complementarity: float) -> str:
    """How it ended: Ipopt's word, checked against what was computed here at its last point."""
    word, near = _WORDS.get(message, "failed"), max(violation, stationarity, complementarity)
    if message in _STALLED and near <= _NEAR:
        return "inaccurate"
    if word == "solved" and near > _NEAR:
        return "inaccurate" if stationarity <= _FAR else "failed"
    return word


def _gaps(
    multipliers: np.ndarray, at: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Products of multipliers and the distance from the bound that they belong to."""
    distance = np.where(multipliers > 0, at - lower, upper - at)
    # A free entry has a multiplier of rounding only, and no distance.
    return np.abs(multipliers) * np.where(np.isfinite(distance), np.abs(distance), 0.0)


def _rank(attempt: Attempt) -> tuple[bool, bool, float]:
    """Solutions first, then what comes near the constraints, then the lowest objective."""
    objective = attempt.objective if np.isfinite(attempt.objective) else np.inf
    return (not attempt.status.ok, not attempt.violation <= _NEAR, objective)


def _largest(values: np.ndarray) -> float:
    return float(np.max(values, initial=0.0))
