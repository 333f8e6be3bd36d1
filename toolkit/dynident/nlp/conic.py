"""The problem as a conic program, through Drake's MathematicalProgram and Clarabel.

It is convex: what the solver finds is the optimum, and its multipliers bound the objective of
any other program for the same problem from below.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident.inertia import pseudo_inertia
from dynident.nlp.duality import Multipliers
from dynident.nlp.polish import polished
from dynident.nlp.problem import Problem, pseudo_basis
from dynident.nlp.status import Status

if TYPE_CHECKING:
    from pydrake.solvers import MathematicalProgram

# Below the first Clarabel stops short ("almost solved"); the bound is computed from what it hands
# on. Where it gets no further, which depends on the processor, the second, its own, may do.
_TOLERANCES = (1e-9, 1e-8)
_STALLED = ("InsufficientProgress", "NumericalError")
_WORDS = {"Solved": "solved", "AlmostSolved": "inaccurate", "MaxIterations": "iteration limit"}


@dataclass(frozen=True, eq=False)
class ConicSolution:
    """What the conic solver found.

    Attributes
    ----------
    x : (s,) standard parameters; NaN where it found none.
    """

    x: np.ndarray
    status: Status
    multipliers: Multipliers | None


@dataclass(frozen=True, eq=False, kw_only=True)
class ConicProgram:
    """A problem as Drake holds it.

    Attributes
    ----------
    program : pydrake.solvers.MathematicalProgram; print it, or add to it.
    z : (s,) its decision variables: (x - origin) in units of the parameters' size.
    origin : (s,) the answer without constraints, so that costs are small numbers.
    problem : what it poses, reduced to few rows.
    """

    program: MathematicalProgram
    z: np.ndarray
    origin: np.ndarray
    problem: Problem
    _bodies: Sequence[Any]
    _lower: Any
    _upper: Any
    _equal: Any
    _cones: Sequence[Any]

    def solve(self) -> ConicSolution:
        """Solve with Clarabel."""
        start = time.perf_counter()
        for tolerance in _TOLERANCES:
            result = self._solved(tolerance)
            details: Any = result.get_solver_details()
            if details.status not in _STALLED:
                break
        seconds = time.perf_counter() - start
        iterations = details.iterations
        word = next((w for key, w in _WORDS.items() if details.status == key), None)
        if word is None:
            infeasible = "PrimalInfeasible" in details.status
            unbounded = "DualInfeasible" in details.status
            word = "infeasible" if infeasible else "unbounded" if unbounded else "failed"
        status = Status("Clarabel", word, details.status, iterations=iterations, seconds=seconds)
        if word not in ("solved", "inaccurate"):
            return ConicSolution(np.full(self.problem.space.size, np.nan), status, None)
        x = self.origin + self.problem.space.scale * result.GetSolution(self.z)
        return ConicSolution(x, status, self._multipliers(result, x))

    def _solved(self, tolerance: float) -> Any:
        """What Drake returns of Clarabel at a tolerance."""
        from pydrake.solvers import ClarabelSolver, SolverOptions

        options = SolverOptions()
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            options.SetOption(ClarabelSolver.id(), name, tolerance)
        return ClarabelSolver().Solve(self.program, None, options)

    def _multipliers(self, result: Any, x: np.ndarray) -> Multipliers:
        # The cost is the norm where no entropy is in it: multipliers of half its square are
        # larger by the norm.
        problem = self.problem
        factor = 1.0
        if problem.entropy is None:
            factor = float(np.linalg.norm(problem.A @ x - problem.b))
        else:
            factor = _unit(problem.entropy.weight)
        size = problem.matrices.shape[1]
        bodies = np.zeros((len(self._bodies), size, size))
        rows, columns = np.tril_indices(size)
        # Drake hands on the lower triangle, column by column.
        order = np.lexsort((rows, columns))
        for k, binding in enumerate(self._bodies):
            dual = result.GetDualSolution(binding)
            bodies[k, rows[order], columns[order]] = dual
            bodies[k, columns[order], rows[order]] = dual
        linear = np.zeros(len(problem.linear.A))
        for chosen, binding in (self._lower, self._upper, self._equal):
            if binding is not None:
                linear[chosen] += result.GetDualSolution(binding)
        cones = tuple(factor * np.ravel(result.GetDualSolution(c)) for c in self._cones)
        return Multipliers(factor * bodies, factor * linear, cones)


def pose_conic(problem: Problem) -> ConicProgram:
    """Pose a problem as a conic program.

    Raises
    ------
    FitError
        If the metric leaves directions free.
    """
    from pydrake.solvers import MathematicalProgram

    problem = problem.reduced()
    problem.require_held()
    scale = problem.space.scale
    # The bindings' types know no shapes.
    program: Any = MathematicalProgram()
    z = program.NewContinuousVariables(problem.space.size, "z")
    origin = problem.origin
    _add_objective(program, z, problem, origin)
    bodies = []
    offsets = problem.body_matrices(problem.inset - origin)
    for k, basis in enumerate(problem.scaled_matrices if problem.matrices.size else ()):
        part = slice(10 * k, 10 * k + 10)
        sized = basis * scale[part][:, None, None]
        constraint = program.AddLinearMatrixInequalityConstraint([-offsets[k], *sized], z[part])
        bodies.append(constraint)
    linear = problem.linear
    A = linear.A * scale
    equal = linear.lower == linear.upper
    lower = np.flatnonzero(np.isfinite(linear.lower) & ~equal)
    upper = np.flatnonzero(np.isfinite(linear.upper) & ~equal)
    equal = np.flatnonzero(equal)

    def rows(chosen: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, Any]:
        if not len(chosen):
            return chosen, None
        return chosen, program.AddLinearConstraint(A[chosen], low[chosen], high[chosen], z)

    free, at = np.full(len(A), np.inf), linear.A @ origin
    cones = [
        program.AddLorentzConeConstraint(rows_, value, z)
        for rows_, value in zip(problem.cone_rows, problem.cone_values(origin), strict=True)
    ]
    return ConicProgram(
        program=program,
        z=z,
        origin=origin,
        problem=problem,
        _bodies=bodies,
        _lower=rows(lower, linear.lower - at, free),
        _upper=rows(upper, -free, linear.upper - at),
        _equal=rows(equal, linear.lower - at, linear.upper - at),
        _cones=cones,
    )


def _add_objective(program: Any, z: np.ndarray, problem: Problem, origin: np.ndarray) -> None:
    A = np.asfortranarray(problem.A * problem.space.scale)
    rest = problem.A @ origin - problem.b
    if problem.entropy is None:
        # The norm, not its square, and never the normal equations: 1e-5 more accurate.
        program.AddL2NormCost(A, rest, z)
        return
    if len(A):
        root_unit = _unit(problem.entropy.weight) ** 0.5
        _add_half_square(program, z, A / root_unit, rest / root_unit)
    weight, basis = problem.entropy.weight, pseudo_basis()
    weight = weight / _unit(weight)
    for k, centre in enumerate(problem.entropy.centres):
        part = slice(10 * k, 10 * k + 10)
        root = np.linalg.inv(np.linalg.cholesky(pseudo_inertia(centre)))
        sized = basis * problem.space.scale[part][:, None, None]
        white = root @ sized @ root.T
        program.AddLinearCost(weight * np.einsum("kii->k", white), z[part])
        with np.errstate(invalid="ignore"):  # arithmetic of symbols leaves the flag behind
            ratio = np.tensordot(z[part], white, axes=1)
            ratio = ratio + root @ pseudo_inertia(origin[part]) @ root.T
            ratio = 0.5 * (ratio + ratio.T)
        cost, t, _ = program.AddMaximizeLogDeterminantCost(ratio)
        cost.evaluator().UpdateCoefficients(-weight * np.ones(len(t)))


def _unit(weight: float) -> float:
    """What an objective with an entropy of this weight is measured in: no cost far above one.

    Of costs of a million Clarabel makes an answer or none, as the last digits fall.
    """
    return max(weight, 1.0)


def _add_half_square(program: Any, z: np.ndarray, A: np.ndarray, rest: np.ndarray) -> None:
    """Add the cost 1/2 |A z + rest|^2 beside others: its norm alone would not do."""
    # t >= |A z - b|^2 / size^2 as (t, 1, (A z - b) / size) in the rotated cone.
    size = max(float(np.linalg.norm(rest)), 1.0)
    t = program.NewContinuousVariables(1, "t")
    stack = np.zeros((len(A) + 2, len(z) + 1))
    stack[0, -1] = 1.0
    stack[2:, :-1] = A / size
    offset = np.concatenate([[0.0, 1.0], rest / size])
    program.AddRotatedLorentzConeConstraint(stack, offset, np.concatenate([z, t]))
    program.AddLinearCost([0.5 * size**2], t)


def solve_conic(problem: Problem) -> ConicSolution:
    """Pose and solve a problem as a conic program, and add the digits that a solver leaves.

    Raises
    ------
    FitError
        If the metric leaves directions free.
    """
    posed = pose_conic(problem)
    found = posed.solve()
    if found.multipliers is None:
        return found
    x, multipliers = polished(posed.problem, found.x, found.multipliers)
    return replace(found, x=x, multipliers=multipliers)
