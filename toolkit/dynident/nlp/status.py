"""How a solver ended: one type for nonlinear and conic programs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Status:
    """How a solver ended.

    Attributes
    ----------
    solver : its name.
    word : "solved", "inaccurate", "infeasible", "unbounded", "iteration limit" or "failed".
    message : the solver's own.
    iterations : it took.
    seconds : of wall-clock time.
    """

    solver: str
    word: str
    message: str
    iterations: int = field(default=0, kw_only=True)
    seconds: float = field(default=0.0, kw_only=True)

    @property
    def ok(self) -> bool:
        """Whether there is a solution."""
        return self.word in ("solved", "inaccurate")

    def after(self, *others: Status) -> Status:
        """The same end with the iterations and the time of others before it."""
        return replace(
            self,
            iterations=self.iterations + sum(other.iterations for other in others),
            seconds=self.seconds + sum(other.seconds for other in others),
        )

    def __str__(self) -> str:
        return f"{self.solver}: {self.word} ({self.message}) in {self.iterations} iterations"
