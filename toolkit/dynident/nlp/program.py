"""A nonlinear program in CasADi: to print, to inspect, to extend, and to solve with Ipopt."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import FitError
from dynident.nlp.blocks import Constraint, Cost, Residual, Variable
from dynident.nlp.ipopt import Attempt, Transcription, run
from dynident.nlp.status import Status
from dynident.tables import Table, number, print_tables

Block = Variable | Residual | Cost | Constraint


@dataclass(frozen=True)
class Program:
    """Minimise 1/2 sum |residual|^2 + sum of costs over variables under constraints.

    Frozen: `program + block` is a new program.

    Attributes
    ----------
    title : what it poses.
    blocks : variables, residuals, costs and constraints, in the order in which they were added.

    Examples
    --------
    >>> x = Variable("x", 2, unit="kg", start=1.0)
    >>> program = Program("nearest to (3, 1)") + x + Residual("distance", x.symbol - [3, 1])
    >>> solution = (program + Constraint("sum", x.symbol[0] + x.symbol[1], upper=2)).solve()
    """

    title: str
    blocks: tuple[Block, ...] = ()

    def __post_init__(self) -> None:
        names = [block.name for block in self.blocks]
        for name in names:
            if names.count(name) > 1:
                raise FitError("is in the program twice", name, "give it another name")
        known = [v.symbol for v in self.variables]
        for block in self.blocks:
            if isinstance(block, Variable):
                continue
            for symbol in ca.symvar(ca.MX(block.expression)):
                if not any(ca.is_equal(symbol, one) for one in known):
                    mend = "add its Variable to the program first"
                    raise FitError(f"depends on '{symbol.name()}'", block.name, mend)

    def __add__(self, block: Block) -> Program:
        return replace(self, blocks=(*self.blocks, block))

    def __getitem__(self, name: str) -> Block:
        for block in self.blocks:
            if block.name == name:
                return block
        mend = f"blocks: {', '.join(block.name for block in self.blocks)}"
        raise FitError(f"the program has no block '{name}'", mend=mend)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The unknowns."""
        return tuple(b for b in self.blocks if isinstance(b, Variable))

    @property
    def residuals(self) -> tuple[Residual, ...]:
        """The rows of least squares."""
        return tuple(b for b in self.blocks if isinstance(b, Residual))

    @property
    def costs(self) -> tuple[Cost, ...]:
        """The other terms of the objective."""
        return tuple(b for b in self.blocks if isinstance(b, Cost))

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """The constraints."""
        return tuple(b for b in self.blocks if isinstance(b, Constraint))

    def solve(
        self,
        starts: Sequence[Mapping[str, ArrayLike]] = ({},),
        tolerance: float = 1e-9,
        max_iterations: int = 500,
    ) -> ProgramSolution:
        """Solve with Ipopt and exact Hessian, from one or several starts; the best one is kept.

        Parameters
        ----------
        starts : values of variables by name; what is not named starts where its `Variable` says.
        tolerance : of Ipopt, on the scaled program.
        max_iterations : from each start.

        Returns
        -------
        ProgramSolution
            Also where no start succeeded: its status says so.

        Raises
        ------
        FitError
            If a start does not fit the variables, or there is nothing to solve.
        """
        if not self.variables or not (self.residuals or self.costs):
            raise FitError("has no variables or no objective", self.title, "add them")
        form = Transcription.of(self.variables, self.residuals, self.costs, self.constraints)
        attempts = tuple(
            run(form, self._start(start), tolerance, max_iterations) for start in starts
        )
        best = min(attempts, key=lambda a: (not a.status.ok, a.objective))
        return self._solution(form, best, attempts)

    def _start(self, given: Mapping[str, ArrayLike]) -> np.ndarray:
        names = [v.name for v in self.variables]
        for name in given:
            if name not in names:
                raise FitError(f"no variable '{name}'", "start", f"variables: {', '.join(names)}")
        parts = []
        for variable in self.variables:
            value = np.asarray(given.get(variable.name, variable.start), dtype=float)
            if value.shape not in ((), (variable.size,)) or not np.all(np.isfinite(value)):
                what = f"has shape {value.shape} or is not finite"
                raise FitError(what, f"start of {variable.name}", f"give {variable.size} numbers")
            parts.append(np.broadcast_to(value, (variable.size,)))
        return np.concatenate(parts)

    def _solution(
        self, form: Transcription, best: Attempt, attempts: tuple[Attempt, ...]
    ) -> ProgramSolution:
        values, start = {}, 0
        for variable in self.variables:
            values[variable.name] = best.x[start : start + variable.size]
            start += variable.size
        multipliers, start = {}, 0
        for constraint in self.constraints:
            rows = len(np.asarray(constraint.lower))
            multipliers[constraint.name] = best.multipliers[start : start + rows]
            start += rows
        terms = (*self.residuals, *self.costs)
        parts = dict(zip((t.name for t in terms), form.terms(best.x), strict=True))
        return ProgramSolution(
            self,
            best.status,
            values,
            best.objective,
            parts,
            best.violation,
            best.stationarity,
            multipliers,
            attempts,
        )

    # --- in words ------------------------------------------------------------------------------

    @property
    def objective(self) -> str:
        """The objective, in words."""
        terms = [f"1/2 |{r.name}|^2" for r in self.residuals] + [c.name for c in self.costs]
        return "minimise " + " + ".join(terms)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        variables = tuple(
            (v.name, str(v.size), _units(v.unit), _range(v.lower, v.upper), _span(v.start))
            for v in self.variables
        )
        terms = tuple(
            (t.name, "residual" if isinstance(t, Residual) else "cost", _rows(t), _unit(t))
            for t in (*self.residuals, *self.costs)
        )
        constraints = tuple(
            (c.name, _rows(c), _range(c.lower, c.upper), c.unit) for c in self.constraints
        )
        columns = ("variable", "size", "unit", "bounds", "start")
        found = [Table(f"{self.title}: {self.objective}", columns, variables)]
        found.append(Table("Terms of the objective", ("term", "kind", "rows", "unit"), terms))
        if constraints:
            headings = ("constraint", "rows", "bounds", "unit")
            found.append(Table("Constraints", headings, constraints))
        return tuple(found)

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self.tables())

    def show(self) -> None:
        """Print variables, terms of the objective, and constraints."""
        print_tables(*self.tables())


@dataclass(frozen=True, eq=False)
class ProgramSolution:
    """What Ipopt found.

    Attributes
    ----------
    program : what was solved.
    status : how it ended; look at it.
    values : each variable's, by name.
    objective : at them.
    parts : what each residual and cost contributes to the objective.
    violation : largest violation of a constraint or bound, in the constraints' units.
    stationarity : norm of the Lagrangian's gradient over that of the objective, variables in
        units of their scale.
    multipliers : of each constraint, by name; positive where its upper bound holds.
    attempts : from each start.
    """

    program: Program
    status: Status
    values: dict[str, np.ndarray]
    objective: float
    parts: dict[str, float]
    violation: float
    stationarity: float
    multipliers: dict[str, np.ndarray]
    attempts: tuple[Attempt, ...]

    def require(self) -> ProgramSolution:
        """Return the solution, if it is one.

        Raises
        ------
        FitError
            If the solver did not succeed from any start.
        """
        if not self.status.ok:
            mend = "try other starts or bounds"
            raise FitError(f"was not solved ({self.status})", self.program.title, mend)
        return self

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        rows = tuple(
            (name, number(value, 6), f"{value / self.objective:.1%}" if self.objective else "")
            for name, value in self.parts.items()
        )
        notes = (
            f"{self.status}; constraints broken by {self.violation:.1e}, stationarity "
            f"{self.stationarity:.1e}.",
            "Objective from each start: "
            + ", ".join(f"{number(a.objective, 6)} ({a.status.word})" for a in self.attempts),
        )
        title = f"Objective {number(self.objective, 8)}"
        return (Table(title, ("term", "value", "share"), rows, notes),)

    def show(self) -> None:
        """Print the objective's parts and how the solver ended."""
        print_tables(*self.tables())


def _rows(block: Residual | Cost | Constraint) -> str:
    return str(ca.MX(block.expression).numel())


def _unit(term: Residual | Cost) -> str:
    return term.unit if isinstance(term, Residual) else ""


def _units(unit: str | tuple[str, ...]) -> str:
    return unit if isinstance(unit, str) else ", ".join(dict.fromkeys(unit))


def _range(lower: Any, upper: Any) -> str:
    low, high = float(np.min(lower, initial=math.inf)), float(np.max(upper, initial=-math.inf))
    if np.array_equal(lower, upper):
        return f"= {_span(lower)}"
    if low == -math.inf and high == math.inf:
        return "free"
    return f"{number(low, 4)} to {number(high, 4)}"


def _span(values: Any) -> str:
    low, high = float(np.min(values)), float(np.max(values))
    return number(low, 4) if low == high else f"{number(low, 4)} to {number(high, 4)}"
