"""A nonlinear program that can be printed, inspected, extended and solved, and its solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import FitError, ProgramError
from dynident.nlp.blocks import (
    Block,
    Constraint,
    Cost,
    Residual,
    Variable,
    between,
    numbers_of,
    spread,
)
from dynident.nlp.ipopt import Attempt, interruptible, solve_scaled
from dynident.nlp.scaled import ScaledProgram
from dynident.tables import Shown, Table, number
from dynident.threads import single_threaded

_AT_BOUND = 1e-6  # of a variable's scale: nearer to a bound it is printed as being there
_REMEDIES = {
    "infeasible": "Loosen the constraints, or start nearer to a point that fulfils them",
    "unbounded": "Add bounds or a prior",
    "iteration limit": "Allow more iterations, or give scales and a start nearer to the solution",
    "failed": "Give scales and a start nearer to the solution",
}


@dataclass(frozen=True, eq=False, repr=False)
class Program(Shown):
    """Minimise 1/2 sum |residual|^2 + sum of costs over named variables, under constraints.

    A sum: `program + block` is a new program with a block more, and leaves the other as it was.
    Variables come before what depends on them.

    Attributes
    ----------
    title : what it identifies.
    blocks : variables, residuals, costs and constraints, in the order in which they were added.

    Raises
    ------
    ProgramError
        If a name occurs twice, or an expression depends on anything but the program's variables.

    Examples
    --------
    >>> x = Variable("x", 2, unit="kg", start=1.0)
    >>> program = Program("nearest to (3, 1)") + x + Residual("distance", x.symbol - [3, 1])
    >>> solution = (program + Constraint("sum", x.symbol[0] + x.symbol[1], upper=2)).solve()
    """

    title: str
    blocks: tuple[Block, ...] = ()

    def __post_init__(self) -> None:
        names, known = set(), set()
        for block in self.blocks:
            if block.name in names:
                remedy = "Name it otherwise, or put it in place by `program.replacing(block)`"
                raise ProgramError(f"{block.name} is in the program twice", self.title, remedy)
            names.add(block.name)
            if isinstance(block, Variable):
                known.add(block.symbol.__hash__())
                continue
            for symbol in ca.symvar(block.expression):
                if symbol.__hash__() not in known:
                    what = f"{block.name} depends on {symbol.name()}, no variable of the program"
                    raise ProgramError(what, self.title, f"Add the variable before {block.name}")

    # --- with other blocks ---------------------------------------------------------------------

    def __add__(self, addition: Block | tuple[Block, ...]) -> Program:
        """Return the program with a block, or several, more."""
        more = addition if isinstance(addition, tuple) else (addition,)
        for block in more:
            if not isinstance(block, Block):
                what = f"{type(block).__name__} is nothing that a program is made of"
                raise ProgramError(what, self.title, "Add a Variable, Residual, Cost or Constraint")
        return replace(self, blocks=(*self.blocks, *more))

    def replacing(self, block: Block) -> Program:
        """Return the program with a block in place of the one of the same name."""
        old = self[block.name]
        return replace(self, blocks=tuple(block if b is old else b for b in self.blocks))

    def without(self, *names: str) -> Program:
        """Return the program without the blocks of these names."""
        gone = [self[name] for name in names]
        return replace(self, blocks=tuple(b for b in self.blocks if b not in gone))

    # --- inspection ----------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Block:
        for block in self.blocks:
            if block.name == name:
                return block
        there = ", ".join(block.name for block in self.blocks) or "nothing"
        raise ProgramError(f"{name} is not in the program", self.title, f"There is: {there}")

    def __contains__(self, name: str) -> bool:
        return any(block.name == name for block in self.blocks)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The unknowns."""
        return tuple(b for b in self.blocks if isinstance(b, Variable))

    @property
    def terms(self) -> tuple[Residual | Cost, ...]:
        """What the objective is the sum of."""
        return tuple(b for b in self.blocks if isinstance(b, Residual | Cost))

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Rows between bounds."""
        return tuple(b for b in self.blocks if isinstance(b, Constraint))

    @property
    def objective(self) -> str:
        """The objective, in words."""
        words = (f"1/2 |{t.name}|^2" if isinstance(t, Residual) else t.name for t in self.terms)
        return "minimise " + (" + ".join(words) or "nothing: any such point")

    def point(self, values: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Values of all variables (k,): those given, within the bounds; the others at their start.

        Raises
        ------
        ProgramError
            If a name is unknown, a shape is wrong, or a number is missing.
        """
        given, found = dict(values or {}), [np.zeros(0)]
        for v in self.variables:
            where = f"variable {v.name}"
            numbers = numbers_of(given.pop(v.name, v.start), v.rows, where, "start")
            if not np.all(np.isfinite(numbers)):
                raise ProgramError("start is infinite", where)
            found.append(np.clip(numbers, v.lower, v.upper))
        if given:
            there = ", ".join(v.name for v in self.variables)
            what = f"{next(iter(given))} is no variable"
            raise ProgramError(what, self.title, f"There is: {there}")
        return np.concatenate(found)

    def evaluate(
        self, expression: Any, values: Mapping[str, ArrayLike] | None = None
    ) -> np.ndarray:
        """An expression of the program's symbols at given values (default: at the start)."""
        symbols = ca.vertcat(*(v.symbol for v in self.variables))
        function: Any = ca.Function("evaluate", [symbols], [ca.MX(expression)])
        result = np.array(function(self.point(values)).full())
        return result[:, 0] if result.shape[1] == 1 else result

    def tables(self) -> tuple[Table, ...]:
        """Variables, objective and constraints, as they are to be read."""
        variables = tuple(
            (*v.head, between(v.lower, v.upper), spread(v.start), spread(v.scale))
            for v in self.variables
        )
        terms = tuple((*t.head, type(t).__name__.lower()) for t in self.terms)
        constraints = tuple((*c.head, between(c.lower, c.upper)) for c in self.constraints)
        size = sum(v.rows for v in self.variables)
        columns = ("variable", "size", "unit", "bounds", "start", "scale")
        shown = (
            Table(f"{self.title}: {size} unknowns", columns, variables),
            Table("Objective", ("term", "rows", "unit", "kind"), terms, (self.objective,)),
            Table("Constraints", ("constraint", "rows", "unit", "bounds"), constraints),
        )
        return shown if constraints else shown[:2]

    # --- solution ------------------------------------------------------------------------------

    @cached_property
    def scaled(self) -> ScaledProgram:
        """The program in the solver's variables; made once, whatever the starts."""
        if not self.variables:
            raise ProgramError("has no variables", self.title)
        return ScaledProgram(self.variables, self.terms, self.constraints)

    @single_threaded
    @interruptible()
    def solve(
        self,
        starts: Sequence[Mapping[str, ArrayLike]] | None = None,
        tolerance: float = 1e-10,
        max_iterations: int = 500,
    ) -> ProgramSolution:
        """Solve the program by Ipopt with exact Hessian.

        A start that fails raises nothing: ask `status`, or call `ProgramSolution.require`.

        Parameters
        ----------
        starts : values of variables by name, one mapping per start; what is not named starts where
            the variable says. The best solution wins. Default: one start.
        tolerance : Ipopt's, on the scaled program.
        max_iterations : of each start.

        Returns
        -------
        The best of the starts' solutions, and where every start ended.

        Raises
        ------
        ProgramError
            If there is no variable, or a start does not suit the variables.
        """
        if not 0 < tolerance < 1:
            raise ProgramError(f"tolerance = {tolerance:g}", self.title, "choose it within 0 and 1")
        points = [self.point(start) for start in ([{}] if starts is None else starts)]
        if not points:
            raise ProgramError("there is no start", self.title, "give one, or None")
        attempts = solve_scaled(self.scaled, points, tolerance, max_iterations)
        best = min(attempts, key=lambda one: one.rank)
        return ProgramSolution(**vars(best), program=self, starts=attempts)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ProgramSolution(Shown, Attempt):
    """The best of the starts: one with a solution before one without, then the lowest objective.

    Attributes
    ----------
    program : what was solved.
    starts : all that were tried, in their order.
    """

    program: Program
    starts: tuple[Attempt, ...]

    @property
    def parts(self) -> dict[str, float]:
        """Contribution of each term to the objective, by name."""
        names = [term.name for term in self.program.terms]
        return dict(zip(names, map(float, self.terms), strict=True))

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Values of the variables by name, in their units; the last iterate where it failed."""
        found = _split(self.program.variables, self.x)
        # To the bit: what was multiplied by its scale may lie a rounding outside.
        return {v.name: np.clip(found[v.name], v.lower, v.upper) for v in self.program.variables}

    @property
    def multipliers(self) -> dict[str, np.ndarray]:
        """What the objective grows by per unit that a bound grows, by constraint or variable.

        Positive at a lower bound that holds, negative at an upper one, of either sign at an
        equation, nearly 0 elsewhere. At an optimum the objective's gradient is the sum, over
        constraints and variables, of their gradients times these.
        """
        blocks = (*self.program.variables, *self.program.constraints)
        return _split(blocks, np.concatenate([self.of_bounds, self.of_rows]))

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
        raise FitError(what, self.program.title, _REMEDIES.get(self.status.word))

    def tables(self) -> tuple[Table, ...]:
        """Values, parts of the objective, constraints and starts, as they are to be read."""
        program = self.program
        variables = [
            (name, number(value, 6), unit, _at_bound(value, *bounds))
            for v in program.variables
            for (name, unit), value, *bounds in zip(
                v.cells, self.values[v.name], v.lower, v.upper, v.scale, strict=True
            )
        ]
        parts = [(name, number(part, 6)) for name, part in self.parts.items()]
        proof = (
            f"stationarity {self.stationarity:.1e}, violation {self.violation:.1e}, "
            f"complementarity {self.complementarity:.1e}"
        )
        rows = [
            (name, number(value, 6), unit, number(multiplier))
            for c in program.constraints
            for (name, unit), value, multiplier in zip(
                c.cells, self.evaluate(c.expression), self.multipliers[c.name], strict=True
            )
        ]
        starts = [
            (str(i), number(s.objective, 8), s.status.word, str(s.status.iterations))
            for i, s in enumerate(self.starts)
        ]
        total, notes = ("sum", number(self.objective, 6)), (str(self.status), proof)
        shown = [
            Table(program.title, ("variable", "value", "unit", "bound"), tuple(variables)),
            Table("Objective", ("term", "value"), (*parts, total), notes),
        ]
        if rows:
            columns = ("constraint", "value", "unit", "multiplier")
            shown.append(Table("Constraints", columns, tuple(rows)))
        if len(starts) > 1:
            columns = ("start", "objective", "status", "iterations")
            shown.append(Table("Starts", columns, tuple(starts)))
        return tuple(shown)


def _split(blocks: Sequence[Block], numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers of all rows by the name of the block that they belong to."""
    parts = np.split(numbers, np.cumsum([block.rows for block in blocks])[:-1])
    return {block.name: part for block, part in zip(blocks, parts, strict=True)}


def _at_bound(value: float, lower: float, upper: float, scale: float) -> str:
    if lower == upper:
        return "fixed"
    near = _AT_BOUND * scale
    return "lower" if value - lower <= near else "upper" if upper - value <= near else "-"
