"""A nonlinear program as functions of numbers, in the solver's variables.

Variables are divided by their scales. The objective is divided by its largest gradient or curvature
in them, constraints by their largest gradient: tolerances mean the same whatever the units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident.errors import ProgramError
from dynident.nlp.blocks import Cost, Residual

if TYPE_CHECKING:
    from dynident.nlp.program import Program

_ROUNDING = 1e-4  # of the largest gradient or curvature: below 1e-10 of it nothing is significant


@dataclass(frozen=True, eq=False)
class Compiled:
    """A program in scaled variables z (k,), as functions of numbers.

    Attributes
    ----------
    program : as it was posed.
    nlp : CasADi's dictionary of expressions; its parameters p are the scales of objective and
        constraints.
    terms : of z, the terms of the objective.
    gradient, jacobian, hessian : of z and p, as Ipopt evaluates them.
    scale, lower, upper : (k,) of the variables.
    constraint_lower, constraint_upper : (m,).
    given_scale : (m,) of the constraints, NaN where none is given.
    """

    program: Program
    nlp: dict[str, Any]
    terms: Any
    gradient: Any
    jacobian: Any
    hessian: Any
    scale: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    constraint_lower: np.ndarray
    constraint_upper: np.ndarray
    given_scale: np.ndarray

    @classmethod
    def of(cls, program: Program) -> Compiled:
        """Substitute scaled variables, and differentiate."""
        import casadi as ca

        if not program.variables:
            raise ProgramError("has no variables", program.title)
        variables, constraints = program.variables, program.constraints
        scale = np.concatenate([v.scale for v in variables])
        z = ca.MX.sym("z", len(scale))
        rows = sum(c.rows for c in constraints)
        p = ca.MX.sym("p", 1 + rows)
        parts = ca.vertcat(ca.MX(0, 1), *(term.cost for term in program.terms))
        held = ca.vertcat(ca.MX(0, 1), *(c.expression for c in constraints))
        residuals = [t for t in program.terms if isinstance(t, Residual)]
        costs = sum((t.cost for t in program.terms if isinstance(t, Cost)), start=ca.MX(0))
        inner = [expression for r in residuals for expression in (r.expression, r.inner)]
        posed: Any = ca.Function(
            "posed", [v.symbol for v in variables], [parts, held, costs, *inner]
        )
        ends = np.cumsum([0, *(v.size for v in variables)]).tolist()
        pieces = ca.vertsplit(ca.DM(scale) * z, ends)
        parts, held, costs, *inner = posed.call(pieces, True, False)
        total = ca.densify(ca.sum1(parts)) / p[0]
        nlp = {"x": z, "p": p, "f": total, "g": held / p[1:] if rows else ca.MX(0, 1)}
        squares = [
            _Squares(inner[2 * i], inner[2 * i + 1], r.matrix) for i, r in enumerate(residuals)
        ]
        hessian = _hessian(nlp, squares, costs)
        solver = ipopt_solver(nlp, hessian, 1e-8, 1)  # only for the derivatives that it makes
        nothing = np.zeros(0)
        return cls(
            program,
            nlp,
            ca.Function("terms", [z], [parts]),
            solver.get_function("nlp_grad_f"),
            solver.get_function("nlp_jac_g") if rows else None,
            hessian,
            scale,
            np.concatenate([v.lower for v in variables]) / scale,
            np.concatenate([v.upper for v in variables]) / scale,
            np.concatenate([nothing, *(c.lower for c in constraints)]),
            np.concatenate([nothing, *(c.upper for c in constraints)]),
            np.concatenate(
                [
                    nothing,
                    *(
                        c.scale if c.scale is not None else np.full(c.rows, np.nan)
                        for c in constraints
                    ),
                ]
            ),
        )

    @property
    def rows(self) -> int:
        """Number of rows of constraints."""
        return len(self.constraint_lower)

    def flat(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Values of the variables in scales, (k,)."""
        return np.concatenate([values[v.name] for v in self.program.variables]) / self.scale

    def split(self, z: np.ndarray) -> dict[str, np.ndarray]:
        """Values of the variables by name, within their bounds."""
        values, x, start = {}, z * self.scale, 0
        for v in self.program.variables:
            values[v.name] = np.clip(x[start : start + v.size], v.lower, v.upper)
            start += v.size
        return values

    def by_name(self, of_bounds: np.ndarray, of_rows: np.ndarray) -> dict[str, np.ndarray]:
        """Multipliers of the variables' bounds (k,) and of the constraints (m,), by name."""
        variables, constraints = self.program.variables, self.program.constraints
        names = [item.name for item in (*variables, *constraints)]
        sizes = [*(v.size for v in variables), *(c.rows for c in constraints)]
        parts = np.split(np.concatenate([of_bounds, of_rows]), np.cumsum(sizes)[:-1])
        return dict(zip(names, parts, strict=True))

    def objective_gradient(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        """The objective and its gradient in z."""
        value, gradient = self.gradient(z, np.ones(1 + self.rows))
        return float(value), array_of(gradient)

    def constraint_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The constraints (m,) and their Jacobian (m, k) in z."""
        if not self.rows:
            return np.zeros(0), np.zeros((0, len(z)))
        value, jacobian = self.jacobian(z, np.ones(1 + self.rows))
        return array_of(value), np.array(jacobian)

    def objective_scale(self, z: np.ndarray) -> float:
        """What counts as one in the objective at z.

        That is the sum of its terms, as a step of one scale along a gradient of a millionth gains
        a millionth of them; but no more than its largest gradient or curvature, where a constant is
        in it, and not so much less that rounding would hide the gradient.
        """
        ones = np.ones(1 + self.rows)
        curvature = self.hessian(z, ones, 1.0, np.zeros(self.rows)).full().diagonal()
        found = np.abs(np.concatenate([self.objective_gradient(z)[1], curvature]))
        steepest = float(found.max(where=np.isfinite(found), initial=0.0))
        total = float(np.sum(np.abs(array_of(self.terms(z)))))
        return float(np.clip(total, _ROUNDING * steepest, steepest)) or 1.0

    def scales(self, at: Mapping[str, np.ndarray]) -> np.ndarray:
        """Scales of the objective and the constraints at a point, (1 + m,)."""
        z = self.flat(at)
        return np.append(self.objective_scale(z), self.constraint_scale(z))

    def constraint_scale(self, z: np.ndarray) -> np.ndarray:
        """Scales of the constraints: given, or their largest gradient, or their largest bound."""
        _, jacobian = self.constraint_jacobian(z)
        scale = np.max(np.abs(jacobian), axis=1, initial=0.0)
        bounds = np.abs(np.column_stack([self.constraint_lower, self.constraint_upper]))
        largest = np.max(bounds, axis=1, where=np.isfinite(bounds), initial=0.0)
        scale = np.where((scale > 0) & np.isfinite(scale), scale, largest)
        scale = np.where(scale > 0, scale, 1.0)
        return np.where(np.isnan(self.given_scale), scale, self.given_scale)

    def undefined(self, at: Mapping[str, np.ndarray]) -> str | None:
        """Name of a term or a constraint that has no finite value at a point, if there is one."""
        for item in (*self.program.terms, *self.program.constraints):
            if not np.all(np.isfinite(self.program.evaluate(item.expression, at))):
                return item.name
        return None


@dataclass(frozen=True, eq=False)
class _Squares:
    """1/2 |r|^2 with r = matrix @ inner + constant, as expressions of z."""

    rows: Any
    inner: Any
    matrix: np.ndarray | None


def _hessian(nlp: dict[str, Any], squares: list[_Squares], costs: Any) -> Any:
    """The exact Hessian of the Lagrangian, as Ipopt asks for it: its upper triangle.

    That of 1/2 |A y - b|^2 is J' A'A J, J the Jacobian of y, and the curvature of y weighted by
    A' (A y - b): A'A is a matrix of numbers, J and the curvature have few entries, and nothing is
    differentiated through A.
    """
    import casadi as ca

    z, p, rows = nlp["x"], nlp["p"], nlp["g"].shape[0]
    factor, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", rows)
    weights = [ca.MX.sym("w", s.inner.shape[0]) for s in squares]
    bent, pulls, gauss = costs, [], ca.MX(z.shape[0], z.shape[0])
    for square, weight in zip(squares, weights, strict=True):
        jacobian = ca.jacobian(square.inner, z)
        bent = bent + ca.dot(weight, square.inner)
        if square.matrix is None:
            pulls.append(square.rows)
            gauss = gauss + ca.mtimes(jacobian.T, jacobian)
        else:
            A = square.matrix
            pulls.append(ca.mtimes(ca.DM(A.T), square.rows))
            gauss = gauss + ca.mtimes(jacobian.T, ca.mtimes(ca.DM(A.T @ A), jacobian))
    lagrangian = factor / p[0] * bent + ca.dot(multipliers, nlp["g"])
    curvature: Any = ca.Function(
        "curvature", [z, p, factor, multipliers, *weights], [ca.hessian(lagrangian, z)[0]]
    )
    exact = curvature(z, p, factor, multipliers, *pulls) + factor / p[0] * gauss
    names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", [z, p, factor, multipliers], [ca.triu(exact)], *names)


def ipopt_solver(nlp: dict[str, Any], hessian: Any, tolerance: float, max_iterations: int) -> Any:
    """Ipopt, silent, with exact Hessian, on a program that is scaled already."""
    import casadi as ca

    options = {
        "print_time": False,
        "show_eval_warnings": False,  # a step into nowhere is shortened, nothing to tell
        "calc_lam_p": False,
        "hess_lag": hessian,
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
    return ca.nlpsol("solver", "ipopt", nlp, options)


def array_of(matrix: Any) -> np.ndarray:
    """A column of CasADi as (k,)."""
    return np.array(matrix.full(), float).ravel()
