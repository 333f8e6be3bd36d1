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

if TYPE_CHECKING:
    from dynident.nlp.program import Program


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
        posed: Any = ca.Function("posed", [v.symbol for v in variables], [parts, held])
        ends = np.cumsum([0, *(v.size for v in variables)]).tolist()
        parts, held = posed.call(ca.vertsplit(ca.DM(scale) * z, ends), True, False)
        nlp = {"x": z, "p": p, "f": ca.sum1(parts) / p[0], "g": held / p[1:]}
        solver = ipopt_solver(nlp, 1e-8, 1)  # only for the derivatives that it makes
        nothing = np.zeros(0)
        return cls(
            program,
            nlp,
            ca.Function("terms", [z], [parts]),
            solver.get_function("nlp_grad_f"),
            solver.get_function("nlp_jac_g") if rows else None,
            solver.get_function("nlp_hess_l"),
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
        """Largest gradient or curvature of the objective at z; 1 where it is flat."""
        ones = np.ones(1 + self.rows)
        curvature = np.array(self.hessian(z, ones, 1.0, np.zeros(self.rows)).full()).diagonal()
        found = np.abs(np.concatenate([self.objective_gradient(z)[1], curvature]))
        largest = float(found.max(where=np.isfinite(found), initial=0.0))
        return largest if largest > 0 else 1.0

    def constraint_scale(self, z: np.ndarray) -> np.ndarray:
        """Scales of the constraints: given, or their largest gradient, or their largest bound."""
        _, jacobian = self.constraint_jacobian(z)
        scale = np.max(np.abs(jacobian), axis=1, initial=0.0)
        bounds = np.abs(np.column_stack([self.constraint_lower, self.constraint_upper]))
        largest = np.max(bounds, axis=1, where=np.isfinite(bounds), initial=0.0)
        scale = np.where((scale > 0) & np.isfinite(scale), scale, largest)
        scale = np.where(scale > 0, scale, 1.0)
        return np.where(np.isnan(self.given_scale), scale, self.given_scale)

    def require_finite(self, z: np.ndarray) -> None:
        """Refuse a start at which something has no value."""
        program, at = self.program, self.split(z)
        for item in (*program.terms, *program.constraints):
            if not np.all(np.isfinite(program.evaluate(item.expression, at))):
                mend = "start where every expression has a finite value"
                raise ProgramError(f"{item.name} is not finite at the start", program.title, mend)


def ipopt_solver(nlp: dict[str, Any], tolerance: float, max_iterations: int) -> Any:
    """Ipopt, silent, with exact Hessian, on a program that is scaled already."""
    import casadi as ca

    options = {
        "print_time": False,
        "show_eval_warnings": False,  # a step into nowhere is shortened, nothing to tell
        "calc_lam_p": False,
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
