"""What a nonlinear program's solver found, with the figures that say how good it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident.errors import FitError
from dynident.nlp.status import Status
from dynident.tables import Table, number, print_tables

if TYPE_CHECKING:
    from dynident.nlp.program import Program


@dataclass(frozen=True, eq=False)
class Attempt:
    """Where one start ended.

    Attributes
    ----------
    start : values of the variables that it began from, by name.
    values : values of the variables at its end, by name.
    status : how the solver ended.
    objective : at the end.
    violation : of the worst constraint, in units of the constraint's scale.
    stationarity : largest entry of the Lagrangian's gradient, relative; see `ProgramSolution`.
    complementarity : largest product of a multiplier and its distance from the bound, relative.
    multipliers : see `ProgramSolution`.
    """

    start: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    status: Status
    objective: float
    violation: float
    stationarity: float
    complementarity: float
    multipliers: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class ProgramSolution:
    """The best of the starts.

    Attributes
    ----------
    program : what was solved.
    best : the start that won: one with a solution before one without, then the lowest objective.
    starts : all that were tried, in their order.
    parts : contribution of each term to the objective, by name.
    """

    program: Program
    best: Attempt
    starts: tuple[Attempt, ...]
    parts: dict[str, float]

    @property
    def status(self) -> Status:
        """How the solver ended."""
        return self.best.status

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Values of the variables by name, in their units; the last iterate where it failed."""
        return self.best.values

    @property
    def objective(self) -> float:
        """Value of the objective."""
        return self.best.objective

    @property
    def violation(self) -> float:
        """Of the worst constraint or bound, in units of its scale; 0 where all hold."""
        return self.best.violation

    @property
    def stationarity(self) -> float:
        """Largest entry of the Lagrangian's gradient, in units of the variables' scales.

        Relative to the objective's largest gradient or curvature there: about the step, in scales,
        that is still missing.
        """
        return self.best.stationarity

    @property
    def complementarity(self) -> float:
        """Largest product of a multiplier and its distance from the bound, relative likewise."""
        return self.best.complementarity

    @property
    def multipliers(self) -> dict[str, np.ndarray]:
        """What the objective grows by per unit that a bound grows, by constraint or variable.

        Positive at a lower bound that holds, negative at an upper one, of either sign at an
        equation, nearly 0 elsewhere. At an optimum the objective's gradient is the sum, over
        constraints and variables, of their gradients times these.
        """
        return self.best.multipliers

    def evaluate(self, expression: Any) -> np.ndarray:
        """An expression of the program's symbols at the solution."""
        return self.program.evaluate(expression, self.values)

    def require(self) -> ProgramSolution:
        """Return the solution itself, if there is one.

        Raises
        ------
        FitError
            If no start reached a solution.
        """
        if self.status.ok:
            return self
        tried = f"; none of {len(self.starts)} starts did better" if len(self.starts) > 1 else ""
        what = f"the program was not solved ({self.status}){tried}"
        raise FitError(what, self.program.title, _MENDS.get(self.status.word))

    def tables(self) -> tuple[Table, ...]:
        """Values, parts of the objective, constraints and starts, as they are to be read."""
        program, values = self.program, self.values
        variables = tuple(
            (
                v.name if v.size == 1 else f"{v.name}[{i}]",
                number(values[v.name][i], 6),
                unit or "-",
                _at_bound(values[v.name][i], v.lower[i], v.upper[i], v.scale[i]),
            )
            for v in program.variables
            for i, unit in enumerate(v.unit)
        )
        parts = tuple((name, number(part, 6)) for name, part in self.parts.items())
        shown = [
            Table(program.title, ("variable", "value", "unit", "bound"), variables),
            Table(
                "Objective",
                ("term", "value"),
                (*parts, ("sum", number(self.objective, 6))),
                (
                    str(self.status),
                    f"stationarity {self.stationarity:.1e}, violation {self.violation:.1e}, "
                    f"complementarity {self.complementarity:.1e}",
                ),
            ),
        ]
        if program.constraints:
            rows = []
            for c in program.constraints:
                value = self.evaluate(c.expression)
                multiplier = self.multipliers.get(c.name, np.full(c.rows, np.nan))
                rows += [
                    (
                        c.name if c.rows == 1 else f"{c.name}[{i}]",
                        number(v, 6),
                        c.unit or "-",
                        number(m),
                    )
                    for i, (v, m) in enumerate(zip(value, multiplier, strict=True))
                ]
            columns = ("constraint", "value", "unit", "multiplier")
            shown.append(Table("Constraints", columns, tuple(rows)))
        if len(self.starts) > 1:
            tried = tuple(
                (str(i), number(s.objective, 8), s.status.word, str(s.status.iterations))
                for i, s in enumerate(self.starts)
            )
            shown.append(Table("Starts", ("start", "objective", "status", "iterations"), tried))
        return tuple(shown)

    def show(self) -> None:
        """Print the solution to the terminal."""
        print_tables(*self.tables())

    def __str__(self) -> str:
        return "\n".join(str(table) for table in self.tables())

    def _repr_html_(self) -> str:
        return "".join(table._repr_html_() for table in self.tables())


_MENDS = {
    "infeasible": "Loosen the constraints, or start nearer to a point that fulfils them",
    "unbounded": "Add bounds or a prior",
    "iteration limit": "Allow more iterations, or give scales and a start nearer to the solution",
    "failed": "Give scales and a start nearer to the solution",
}


def _at_bound(value: float, lower: float, upper: float, scale: float) -> str:
    if lower == upper:
        return "fixed"
    near = 1e-6 * scale
    return "lower" if value - lower <= near else "upper" if upper - value <= near else "-"
