"""How far an answer is from the best there is: a bound that any multipliers prove.

The problem is convex, so multipliers in the dual cones bound its objective from below, whoever
found them; the bound below is computed in plain arithmetic and does not trust a solver's word.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from dynident.constraints.sets import Within
from dynident.inertia import distance_rows
from dynident.nlp.conic import Multipliers, cone_rows, cone_values
from dynident.nlp.problem import TOLERANCE, Problem
from dynident.nlp.status import Status
from dynident.tables import Table, number

_FALLS = 1e-13  # of the largest: curvature (its root) that is rounding

OPTIMAL = 1e-4
"""Relative gap below which an answer is called the optimum."""


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound of a problem's objective.

    Attributes
    ----------
    value : no point of the set has a smaller objective.
    stationarity : norm of the Lagrangian's gradient over those of the objective's parts,
        parameters in units of their size.
    dual_feasibility : smallest eigenvalue or sign of the multipliers over the largest, before
        they were put into their cones: 0 or a little below.
    """

    value: float
    stationarity: float
    dual_feasibility: float


@dataclass(frozen=True)
class Certificate:
    """What is proved about an answer.

    Attributes
    ----------
    notion : of consistency that was asked for, in words, and how far inside the set ends.
    program : how it was found.
    objective : of the answer.
    bound : below which no answer can be; NaN where there is none.
    nothing : an objective next to nothing, in which the gap is counted where the bound is less.
    gap : (objective - bound) / bound, or over `nothing`.
    stationarity : of the answer, see `Bound`; of a nonlinear program in its own variables; NaN
        where it was not computed.
    dual_feasibility : of the multipliers that prove the bound; NaN where there are none.
    violation : how far the answer breaks a constraint, relative to the sizes of parameters.
    worst_margin : the body that is nearest to the boundary, the matrix that says so, and its
        smallest eigenvalue in units of the body's size.
    starts : objective reached from each start that was tried; empty where none is needed.
    status : the solver's.
    """

    notion: str
    program: str
    objective: float
    bound: float
    nothing: float
    gap: float
    stationarity: float
    dual_feasibility: float
    violation: float
    worst_margin: tuple[str, str, float]
    starts: tuple[float, ...]
    status: Status

    @property
    def optimal(self) -> bool:
        """Whether the answer is the optimum, to `OPTIMAL`."""
        return self.gap <= OPTIMAL and self.violation <= TOLERANCE

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.violation > TOLERANCE:
            return f"This is not a solution: it breaks a constraint by {self.violation:.1g}."
        if not np.isfinite(self.bound):
            return "Nothing is proved: the conic program gave no bound."
        if self.optimal:
            return f"This is the optimum: no point of the set is better by more than {self._gap}."
        return f"This is NOT proved to be the optimum: a point better by {self._gap} may exist."

    @property
    def _gap(self) -> str:
        excess = max(self.objective - self.bound, 0.0)
        if abs(self.bound) < self.nothing:
            return f"{excess:.1e}, where {self.nothing:.1e} is next to nothing"
        return f"{excess / abs(self.bound):.1e} of the objective"

    def table(self) -> Table:
        """The certificate as a table."""
        body, rule, value = self.worst_margin
        starts = f"{len(self.starts)}: " + ", ".join(number(s, 6) for s in self.starts)
        rows = (
            ("set", self.notion),
            ("program", f"{self.program}; {self.status}"),
            ("objective", number(self.objective, 8)),
            ("lower bound", number(self.bound, 8)),
            ("gap", _figure(self.gap)),
            ("stationarity", _figure(self.stationarity)),
            ("dual feasibility of the bound", _figure(self.dual_feasibility)),
            ("constraints broken by", _figure(self.violation)),
            ("smallest margin", f"{_figure(value)} of its size ({rule} of {body})"),
            *((("objective from each start", starts),) if self.starts else ()),
        )
        return Table("Certificate", ("", ""), rows, (self.sentence,))

    def to_dict(self) -> dict[str, Any]:
        """The certificate as JSON holds it."""
        body, rule, value = self.worst_margin
        return {
            "notion": self.notion,
            "program": self.program,
            "optimal": self.optimal,
            "sentence": self.sentence,
            "objective": self.objective,
            "bound": self.bound,
            "gap": self.gap,
            "stationarity": self.stationarity,
            "dual_feasibility": self.dual_feasibility,
            "violation": self.violation,
            "smallest_margin": {"body": body, "rule": rule, "relative": value},
            "starts": list(self.starts),
            "status": {"solver": self.status.solver, "word": self.status.word},
        }


def _figure(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.1e}"


def lower_bound(problem: Problem, x: np.ndarray, multipliers: Multipliers) -> Bound:
    """Return the bound that multipliers prove, developed at a point x near the optimum.

    The Lagrangian is at least its value at x less what its gradient there can still bring: half
    the squared Newton decrement for the quadratic, and for the entropy (self-concordant) what
    Nesterov's bound says (Nesterov, "Lectures on convex optimization", theorem 5.1.12).

    The set is that of bodies at least the inset inside, as programs see it.
    """
    if not np.isfinite(problem.objective(x)):
        return Bound(-np.inf, np.inf, 0.0)
    scale = problem.space.scale
    bodies, floor_bodies = _semidefinite(multipliers.bodies)
    cones, floor_cones = _in_cones(multipliers.cones)
    linear, floor_linear = _signed(problem, multipliers.linear)
    gradient = scale * problem.gradient(x)
    rest = gradient - scale * _pull(problem, bodies, linear, cones)
    # What the constraints' slack takes from the objective at x.
    slack = 0.0
    if bodies.size:
        slack += float(np.sum(bodies * problem.body_matrices(x - problem.inset)))
    slack += sum(float(c @ v) for c, v in zip(cones, cone_values(problem, x), strict=True))
    value = problem.linear.A @ x
    at = np.where(linear > 0, problem.linear.lower, problem.linear.upper)
    slack += float(np.sum(linear[linear != 0] * (value - at)[linear != 0]))
    bound = problem.objective(x) - slack - _gain(problem, x, rest)
    entropy = scale * problem.entropy_gradient(x)
    parts = np.linalg.norm(gradient - entropy) + np.linalg.norm(entropy)
    size = max(float(parts), np.finfo(float).tiny)
    floor = min(floor_bodies, floor_cones, floor_linear)
    return Bound(float(bound), float(np.linalg.norm(rest) / size), floor)


def certify(
    problem: Problem,
    x: np.ndarray,
    status: Status,
    program: str,
    bound: Bound | None,
    starts: tuple[float, ...] = (),
) -> Certificate:
    """State what is proved about an answer x (s,)."""
    objective = problem.objective(x)
    # An objective of zero needs no bound to be the smallest: zero up to rounding of its terms, and
    # up to what a step of twice the inset costs.
    step = 2.0 * problem.A @ problem.inset
    nothing = max(1e-18 * float(problem.b @ problem.b), 0.5 * float(step @ step))
    least = max(nothing / OPTIMAL, np.finfo(float).tiny)
    if problem.entropy is None and objective <= nothing and bound is None:
        bound = Bound(0.0, float("nan"), float("nan"))  # a sum of squares is not negative
    value = bound.value if bound else float("nan")
    excess = objective - value
    gap = excess / max(abs(value), least)
    within = problem.within
    inside = f", each link {within.inset:.0e} of its size inside" if within.inset else ""
    return Certificate(
        within.notion + (inside if within.consistency != "none" else ""),
        program,
        objective,
        value,
        least,
        float(gap),
        bound.stationarity if bound else float("nan"),
        bound.dual_feasibility if bound else float("nan"),
        max(problem.violation(x), problem.body_violation(x)),
        _worst(problem, x),
        starts,
        status,
    )


def _worst(problem: Problem, x: np.ndarray) -> tuple[str, str, float]:
    semi = problem.within.consistency == "semi"
    judged = problem if semi else replace(problem, within=Within("full"))
    least = np.linalg.eigvalsh(judged.body_matrices(x))[:, 0]
    k = int(np.argmin(least))
    matrix = "spatial inertia" if semi else "pseudo-inertia"
    return problem.space.bodies[k], matrix, float(least[k])


def unconstrained_bound(problem: Problem, x: np.ndarray) -> Bound:
    """The bound that a minimiser x (s,) without constraints is: none with constraints is lower."""
    scale = problem.space.scale
    parts = scale * (problem.A.T @ (problem.A @ x)), scale * (problem.A.T @ problem.b)
    size = float(np.linalg.norm(parts[0]) + np.linalg.norm(parts[1])) or 1.0
    rest = float(np.linalg.norm(parts[0] - parts[1]))
    return Bound(problem.objective(x), rest / size, float("nan"))


def _pull(
    problem: Problem, bodies: np.ndarray, linear: np.ndarray, cones: list[np.ndarray]
) -> np.ndarray:
    """Gradient of the constraints' terms in the Lagrangian, (s,)."""
    pull = problem.linear.A.T @ linear
    if bodies.size:
        inertial = np.einsum("nkij,nij->nk", problem.scaled_matrices, bodies)
        pull[: problem.space.rigid] += inertial.ravel()
    for row, one in zip(cone_rows(problem), cones, strict=True):
        pull += row.T @ one / problem.space.scale
    return pull


def _gain(problem: Problem, x: np.ndarray, rest: np.ndarray) -> float:
    """What the Lagrangian can still fall below its value at x."""
    scale = problem.space.scale
    rows = problem.A * scale
    weight = 1.0
    if problem.entropy is not None:
        weight = problem.entropy.weight
        blocks = np.zeros((problem.space.rigid, problem.space.size))
        for k in range(len(problem.space.bodies)):
            part = slice(10 * k, 10 * k + 10)
            blocks[part, part] = distance_rows(x[part]) * scale[part]
        rows = np.vstack([rows / np.sqrt(weight), blocks])
    # |rest| in the inverse Hessian rows' rows.
    R = np.asarray(np.linalg.qr(rows, mode="r"))
    diagonal = np.abs(np.diag(R))
    if len(R) < rows.shape[1] or diagonal.min() <= _FALLS * diagonal.max():
        return float("inf")  # a direction that nothing holds: there it falls for ever
    decrement = float(np.linalg.norm(solve_triangular(R.T, rest / weight, lower=True)))
    if problem.entropy is None:
        return 0.5 * decrement**2
    if decrement >= 1.0:
        return float("inf")
    return weight * (-decrement - np.log1p(-decrement))


def _semidefinite(matrices: np.ndarray) -> tuple[np.ndarray, float]:
    """Nearest positive semidefinite matrices, and how far the given ones were from it."""
    if not matrices.size:
        return matrices, 0.0
    values, vectors = np.linalg.eigh(matrices)
    floor = min(0.0, float(values.min() / max(np.abs(values).max(), np.finfo(float).tiny)))
    return np.einsum("nik,nk,njk->nij", vectors, np.clip(values, 0.0, None), vectors), floor


def _in_cones(vectors: tuple[np.ndarray, ...]) -> tuple[list[np.ndarray], float]:
    """Vectors of the second-order cone near the given ones, and how far those were from it."""
    found, floor = [], 0.0
    for vector in vectors:
        norm = float(np.linalg.norm(vector[1:]))
        if norm > vector[0]:
            floor = min(floor, float((vector[0] - norm) / (norm or 1.0)))
        found.append(np.concatenate([[max(vector[0], norm)], vector[1:]]))
    return found, floor


def _signed(problem: Problem, linear: np.ndarray) -> tuple[np.ndarray, float]:
    """Multipliers of the signs that bounds allow, and how far the given ones were from it."""
    lower, upper = problem.linear.lower, problem.linear.upper
    low, high = np.where(np.isfinite(upper), -np.inf, 0.0), np.where(np.isfinite(lower), np.inf, 0)
    signed = np.clip(linear, low, high)
    size = max(float(np.abs(linear).max(initial=0.0)), np.finfo(float).tiny)
    return signed, min(0.0, -float(np.abs(signed - linear).max(initial=0.0)) / size)
