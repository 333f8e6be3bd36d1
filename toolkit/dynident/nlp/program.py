"""A nonlinear program that can be printed, inspected, extended and solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import ProgramError
from dynident.nlp.blocks import Constraint, Cost, Residual, Variable, numbers_of
from dynident.nlp.compiled import Compiled
from dynident.nlp.ipopt import solve
from dynident.nlp.solution import ProgramSolution
from dynident.tables import Table, number, print_tables

Block = Variable | Residual | Cost | Constraint


@dataclass(frozen=True, eq=False)
class Program:
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
        import casadi as ca

        names = [block.name for block in self.blocks]
        known = set()
        for block in self.blocks:
            if names.count(block.name) > 1:
                remedy = "Name it otherwise, or put it in place by `program.replacing(block)`"
                raise ProgramError(f"{block.name} is in the program twice", self.title, remedy)
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
        self[block.name]
        return replace(
            self, blocks=tuple(block if b.name == block.name else b for b in self.blocks)
        )

    def without(self, *names: str) -> Program:
        """Return the program without the blocks of these names."""
        for name in names:
            self[name]
        return replace(self, blocks=tuple(b for b in self.blocks if b.name not in names))

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
    def size(self) -> int:
        """Number of unknown numbers."""
        return sum(v.size for v in self.variables)

    @property
    def objective(self) -> str:
        """The objective, in words."""
        return "minimise " + (" + ".join(t.term for t in self.terms) or "nothing: any such point")

    def point(self, values: Mapping[str, ArrayLike] | None = None) -> dict[str, np.ndarray]:
        """Values of all variables: those given, moved within the bounds; the others at their start.

        Raises
        ------
        ProgramError
            If a name is unknown, a shape is wrong, or a number is missing.
        """
        given = dict(values or {})
        found = {}
        for variable in self.variables:
            value = given.pop(variable.name, variable.start)
            where = f"variable {variable.name}"
            numbers = numbers_of(value, variable.size, where, "start")
            if not np.all(np.isfinite(numbers)):
                raise ProgramError("start is infinite", where)
            found[variable.name] = np.clip(numbers, variable.lower, variable.upper)
        if given:
            there = ", ".join(v.name for v in self.variables)
            what = f"{next(iter(given))} is no variable"
            raise ProgramError(what, self.title, f"There is: {there}")
        return found

    def evaluate(
        self, expression: Any, values: Mapping[str, ArrayLike] | None = None
    ) -> np.ndarray:
        """An expression of the program's symbols at given values (default: at the start)."""
        import casadi as ca

        at = self.point(values)
        symbols = [v.symbol for v in self.variables]
        function: Any = ca.Function("evaluate", symbols, [ca.MX(expression)])
        result = np.array(function(*(at[v.name] for v in self.variables)).full())
        return result[:, 0] if result.shape[1] == 1 else result

    def tables(self) -> tuple[Table, ...]:
        """Variables, objective and constraints, as they are to be read."""
        variables = tuple(_variable_row(v) for v in self.variables)
        columns = ("variable", "size", "unit", "bounds", "start", "scale")
        terms = tuple((t.name, _kind(t), str(t.rows), t.unit or "-") for t in self.terms)
        shown = [
            Table(f"{self.title}: {self.size} unknowns", columns, variables),
            Table("Objective", ("term", "kind", "rows", "unit"), terms, (self.objective,)),
        ]
        if self.constraints:
            rows = tuple(
                (c.name, str(c.rows), c.unit or "-", _bounds(c.lower, c.upper))
                for c in self.constraints
            )
            shown.append(Table("Constraints", ("constraint", "rows", "unit", "bounds"), rows))
        return tuple(shown)

    def show(self) -> None:
        """Print the program to the terminal."""
        print_tables(*self.tables())

    def __str__(self) -> str:
        return "\n".join(str(table) for table in self.tables())

    def _repr_html_(self) -> str:
        return "".join(table._repr_html_() for table in self.tables())

    # --- solution ------------------------------------------------------------------------------

    @cached_property
    def compiled(self) -> Compiled:
        """The program in the solver's variables; made once, whatever the starts."""
        return Compiled.of(self)

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

        Raises
        ------
        ProgramError
            If there is no variable, or a start does not suit the variables.
        """
        return solve(self, starts, tolerance, max_iterations)


def _kind(term: Residual | Cost) -> str:
    return "residual" if isinstance(term, Residual) else "cost"


def _variable_row(variable: Variable) -> tuple[str, ...]:
    return (
        variable.name,
        str(variable.size),
        ", ".join(dict.fromkeys(variable.unit)) or "-",
        _bounds(variable.lower, variable.upper),
        _range(variable.start),
        _range(variable.scale),
    )


def _bounds(lower: np.ndarray, upper: np.ndarray) -> str:
    """Bounds in a cell; those of several entries by their extremes."""
    if np.all(lower == upper):
        return f"= {_range(lower)}"
    low, high = float(lower.min()), float(upper.max())
    if low == -np.inf and high == np.inf:
        free = np.all(np.isinf(lower) & np.isinf(upper))
        return "free" if free else "some entries bounded"
    if high == np.inf:
        return f">= {number(low)}"
    if low == -np.inf:
        return f"<= {number(high)}"
    return f"{number(low)} to {number(high)}"


def _range(values: np.ndarray) -> str:
    low, high = number(float(values.min())), number(float(values.max()))
    return low if low == high else f"{low} to {high}"
