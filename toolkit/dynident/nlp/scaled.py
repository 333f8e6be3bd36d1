"""A nonlinear program in variables and rows that are of the size of one, as functions of numbers.

Variables are divided by their scales, the objective by its largest gradient or curvature in them,
constraints by their largest gradient: tolerances mean the same whatever the units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dynident.nlp.blocks import Constraint, Cost, Residual, Variable

_ROUNDING = 1e-4  # of the largest gradient or curvature: below 1e-10 of it nothing is significant


@dataclass(frozen=True, eq=False, kw_only=True)
class Local:
    """A program at a point.

    Attributes
    ----------
    terms : (t,) of the objective.
    gradient, curvature : (k,) of the objective, and the diagonal of its Hessian.
    rows, jacobian : (m,), (m, k) of the constraints.
    """

    terms: np.ndarray
    gradient: np.ndarray
    curvature: np.ndarray
    rows: np.ndarray
    jacobian: np.ndarray

    @property
    def scale(self) -> float:
        """What counts as one in the objective.

        That is the sum of its terms, as a step of one scale along a gradient of a millionth gains
        a millionth of them; but no more than its largest gradient or curvature, where a constant is
        in it, and not so much less that rounding would hide the gradient.
        """
        found = np.abs(np.concatenate([self.gradient, self.curvature]))
        steepest = float(found.max(where=np.isfinite(found), initial=0.0))
        total = float(np.sum(np.abs(self.terms)))
        return float(np.clip(total, _ROUNDING * steepest, steepest)) or 1.0


class ScaledProgram:
    """A program in the solver's variables z (k,).

    Parameters
    ----------
    variables, terms, constraints : of the program.

    Attributes
    ----------
    scale, lower, upper : (k,) of the variables, bounds in scales.
    row_lower, row_upper : (m,) of the constraints.
    nlp : CasADi's dictionary of expressions; its parameters p (1 + m,) are the scales of objective
        and constraints.
    hessian : casadi.Function of z, p and multipliers, as Ipopt evaluates it.
    """

    def __init__(
        self,
        variables: Sequence[Variable],
        terms: Sequence[Residual | Cost],
        constraints: Sequence[Constraint],
    ) -> None:
        self._names = [*(t.name for t in terms), *(c.name for c in constraints for _ in c.lower)]
        self.scale = np.concatenate([v.scale for v in variables])
        self.lower = np.concatenate([v.lower for v in variables]) / self.scale
        self.upper = np.concatenate([v.upper for v in variables]) / self.scale
        self.row_lower = np.concatenate([np.zeros(0), *(c.lower for c in constraints)])
        self.row_upper = np.concatenate([np.zeros(0), *(c.upper for c in constraints)])
        rows = len(self.row_lower)
        z, p = ca.MX.sym("z", len(self.scale)), ca.MX.sym("p", 1 + rows)
        squares = [t for t in terms if isinstance(t, Residual)]
        expressions = [
            ca.vertcat(ca.MX(0, 1), *(t.cost for t in terms)),
            ca.vertcat(ca.MX(0, 1), *(c.expression for c in constraints)),
            sum((t.cost for t in terms if isinstance(t, Cost)), start=ca.MX(0)),
            *(part for r in squares for part in (r.residual, r.expression)),
        ]
        posed: Any = ca.Function("posed", [ca.vertcat(*(v.symbol for v in variables))], expressions)
        parts, held, costs, *inner = posed.call([ca.DM(self.scale) * z], True, False)
        total = ca.densify(ca.sum1(parts))
        self.nlp = {"x": z, "p": p, "f": total / p[0], "g": held / p[1:] if rows else ca.MX(0, 1)}
        matrices = [ca.sparsify(ca.DM(r.matrix)) for r in squares]
        triples = list(zip(matrices, inner[::2], inner[1::2], strict=True))
        self.hessian: Any = _hessian(self.nlp, costs, triples)
        curvature = ca.diag(self.hessian(z, np.ones(1 + rows), 1.0, np.zeros(rows)))
        found = [parts, ca.gradient(total, z), curvature, held, ca.jacobian(held, z)]
        self._local: Any = ca.Function("local", [z], found)

    def at(self, z: np.ndarray) -> Local:
        """The program at a point."""
        terms, gradient, curvature, rows, jacobian = (m.full() for m in self._local(z))
        return Local(
            terms=terms.ravel(),
            gradient=gradient.ravel(),
            curvature=curvature.ravel(),
            rows=rows.ravel(),
            jacobian=jacobian,
        )

    def undefined(self, here: Local) -> str:
        """Name of a term or a constraint that has no finite value; empty if all have."""
        values = zip(self._names, [*here.terms, *here.rows], strict=True)
        return next((name for name, value in values if not np.isfinite(value)), "")

    def scales(self, here: Local) -> np.ndarray:
        """Scales of the objective and of the rows at a point, (1 + m,).

        Those of rows are their largest gradient, or where they have none their largest bound.
        """
        steepest = np.max(np.abs(here.jacobian), axis=1, initial=0.0)
        bounds = np.abs(np.column_stack([self.row_lower, self.row_upper]))
        largest = np.max(bounds, axis=1, where=np.isfinite(bounds), initial=0.0)
        found = np.where((steepest > 0) & np.isfinite(steepest), steepest, largest)
        return np.append(here.scale, np.where(found > 0, found, 1.0))


def _hessian(nlp: dict[str, Any], costs: Any, squares: list[tuple[Any, Any, Any]]) -> Any:
    """The exact Hessian of the Lagrangian, as Ipopt asks for it: its upper triangle.

    That of 1/2 |A y - b|^2 is J' A'A J, J the Jacobian of y, and the curvature of y weighted by
    A' (A y - b): A'A is a matrix of numbers, J and the curvature have few entries, and nothing is
    differentiated through A, as CasADi would. `squares` are A, A y - b and y of each residual.
    """
    z, p = nlp["x"], nlp["p"]
    factor, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", nlp["g"].shape[0])
    weights = [ca.MX.sym("w", y.shape[0]) for _, _, y in squares]
    curved, pulls, gauss = costs, [], ca.MX(z.shape[0], z.shape[0])
    for (A, rows, y), weight in zip(squares, weights, strict=True):
        jacobian = ca.jacobian(y, z)
        curved = curved + ca.dot(weight, y)
        pulls.append(ca.mtimes(A.T, rows))
        gauss = gauss + ca.mtimes(jacobian.T, ca.mtimes(ca.mtimes(A.T, A), jacobian))
    lagrangian = factor / p[0] * curved + ca.dot(multipliers, nlp["g"])
    inputs = [z, p, factor, multipliers]
    curvature: Any = ca.Function("curvature", [*inputs, *weights], [ca.hessian(lagrangian, z)[0]])
    exact = curvature(*inputs, *pulls) + factor / p[0] * gauss
    names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", inputs, [ca.triu(exact)], *names)
