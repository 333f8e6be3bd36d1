"""How far an answer is from the best there is: what is proved about it, in figures and in words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.constraints.sets import Within
from dynident.nlp.duality import Bound
from dynident.nlp.problem import TOLERANCE, Problem
from dynident.nlp.status import Status
from dynident.tables import Table, number

OPTIMAL = 1e-4
"""Relative gap below which an answer is called the optimum."""


@dataclass(frozen=True, kw_only=True)
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
            if self.objective <= self.bound:
                return "This is the optimum: no point of the set is better, but for rounding."
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
        return Table("Certificate", ("what", "value"), rows, (self.sentence,))

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


def certify(
    problem: Problem,
    x: np.ndarray,
    status: Status,
    program: str,
    bound: Bound | None,
    starts: tuple[float, ...] = (),
) -> Certificate:
    """Return what is proved about an answer.

    Parameters
    ----------
    problem : that was to be solved.
    x : (s,) the answer, in SI units of the standard parameters.
    status : the solver's.
    program : how it was found, in words.
    bound : that multipliers prove; None where there are none.
    starts : objective reached from each start that was tried.
    """
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
    within = problem.within
    inside = f", each link {within.inset:.0e} of its size inside" if within.inset else ""
    return Certificate(
        notion=within.notion + (inside if within.consistency != "none" else ""),
        program=program,
        objective=objective,
        bound=value,
        nothing=least,
        gap=float(excess / max(abs(value), least)),
        stationarity=bound.stationarity if bound else float("nan"),
        dual_feasibility=bound.dual_feasibility if bound else float("nan"),
        violation=max(problem.violation(x), problem.body_violation(x)),
        worst_margin=_worst(problem, x),
        starts=starts,
        status=status,
    )


def _worst(problem: Problem, x: np.ndarray) -> tuple[str, str, float]:
    semi = problem.within.consistency == "semi"
    judged = problem if semi else replace(problem, within=Within("full"))
    least = np.linalg.eigvalsh(judged.body_matrices(x))[:, 0]
    k = int(np.argmin(least))
    matrix = "spatial inertia" if semi else "pseudo-inertia"
    return problem.space.bodies[k], matrix, float(least[k])
