"""The fixed-point iteration of an instrumental variable estimate.

In: a model, where it begins, and a source of instruments. Out: the iterations, with what the last
of them found and how they ended.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynident.errors import DynidentError, SimulationError
from dynident.fitting.fixed_point import FixedPoint
from dynident.fitting.history import Ending, Round, Way
from dynident.fitting.instrumental.normal_equations import (
    InstrumentalSolution,
    factorise_instruments,
    solve_instruments,
)
from dynident.fitting.instrumental.simulated_loop import LoopSource
from dynident.fitting.instrumental.source import InstrumentSource, ProgressCallback, silent
from dynident.model import Model
from dynident.moments.factors import TriangularFactors
from dynident.recording import Dataset

_HALVINGS = 5
_COLUMNS = 1e-3
"""Share of the tolerance within which columns that depend on the estimate converge."""


@dataclass(frozen=True, kw_only=True)
class IterationSettings:
    """When the iterations end, and how rows are weighted; see `IV`."""

    weighting: Literal["joint", "none"] = "joint"
    tolerance: float = 1e-2
    rounds: int = 20
    progress: ProgressCallback = silent


@dataclass(frozen=True, eq=False)
class _Found:
    """What one iteration found; see `Iterations`."""

    values: np.ndarray
    simulated: np.ndarray | None
    found: TriangularFactors
    solution: InstrumentalSolution
    instruments: Dataset
    rounds: list[Round]


class Iterations:
    """The fixed-point iteration at work, and what it has found so far.

    Attributes
    ----------
    source : of the instruments.
    start, start_name : (p,) where they began, and what that is in words.
    values : (p,) the estimate so far.
    model : with its columns at that estimate.
    rounds : one for each iteration done.
    ending, message : how they ended.
    found, solution : of the last round.
    instruments : recordings behind the last round.
    simulated : (p,) values whose simulation these are; None where they are none, or that of the
        nearest possible robot.
    """

    def __init__(
        self,
        settings: IterationSettings,
        model: Model,
        source: InstrumentSource,
        start: np.ndarray,
        start_name: str,
    ) -> None:
        self._settings, self.model, self.source = settings, model, source
        self._fixed_point = FixedPoint()
        # Of values found to those at which their columns were taken: a step may be shorter.
        self._off = np.inf
        self._good: np.ndarray | None = None
        self.start, self.start_name = start, start_name
        self.simulated: np.ndarray | None = None
        self._root: np.ndarray | None = None
        self.values = start
        self.rounds: list[Round] = []
        self._past: list[_Found] = []
        self.ending, self.message = Ending.ROUNDS_EXHAUSTED, ""
        self.found: TriangularFactors
        self.solution: InstrumentalSolution
        self.instruments: Dataset

    def run(self) -> None:
        """Iterate until the residual stays, or an estimate cannot be simulated."""
        limit = self._settings.rounds if self.source.iterates else 1
        for count in range(limit):
            self._settings.progress("instrumental variables", count, limit)
            try:
                way = self._renew()
            except SimulationError as error:
                if not self.rounds:
                    raise
                self._keep_last_good(error)
                return
            self._estimate(way)
            if not self.source.iterates:
                self.ending = Ending.DIRECT
                return
            if len(self.rounds) > 1 and self._converged():
                self.ending = Ending.CONVERGED
                break
        if self.ending is Ending.ROUNDS_EXHAUSTED:
            self.message = f"the residual still changes after {limit} iterations"
            if self.rounds[-1].way.share < 1.0:
                self.message = f"the estimates of {limit} iterations could only be approached"
        if doubt := self.source.verdict():
            self.ending, self.message = Ending.DOUBTFUL_LOOP, doubt

    def _keep_last_good(self, error: SimulationError) -> None:
        """Go back to the last estimate that could be simulated, and what was found there."""
        if len(self._past) < 2:
            what = f"the first estimate has no motion, nor has any part of the way to it: {error}"
            remedy = "choose another start, or look for what the model lacks"
            raise SimulationError(what.rstrip("."), "IV", remedy, reason=error.reason) from None
        lost = len(self.rounds)
        self._restore(self._past[-2])
        self.ending = Ending.NOT_SIMULATED
        self.message = (
            f"the estimate of iteration {lost} has no motion ({str(error).rstrip('.')}), nor has "
            f"any part of the way to it: the values are those of iteration {lost - 1}"
        )

    def _restore(self, past: _Found) -> None:
        self.values, self.simulated = past.values, past.simulated
        self.model = self.model.at(past.values)
        self.found, self.solution = past.found, past.solution
        self.instruments, self.rounds = past.instruments, past.rounds

    def _renew(self) -> Way:
        """Make the instruments of the estimate so far, projected or damped if need be."""
        try:
            self._make(self.values)
            return Way(1.0)
        except SimulationError as error:
            reason = error
        if isinstance(self.source, LoopSource):
            with suppress(DynidentError):
                nearest = self.source.projected(self.values, self._root)
                self.instruments = nearest.instruments
                self._good = self.simulated = nearest.values
                return Way(1.0, projected=True)
        if self._good is None:
            raise reason
        for halving in range(1, _HALVINGS + 1):
            share = 0.5**halving
            values = self._good + share * (self.values - self._good)
            try:
                self._make(values)
                self.values = values
                return Way(share)
            except SimulationError:
                continue
        raise reason

    def _make(self, values: np.ndarray) -> None:
        self.instruments = self.source.at(values)
        self._good = values
        self.simulated = values if self.source.iterates else None

    def _estimate(self, way: Way) -> None:
        found, solution = self._solved()
        model, values = self.model, solution.values
        if model.needs_values:
            self._off = float(np.linalg.norm(values - self.values))
            values = self._fixed_point.following(model, self.values, values)
            if not self.source.iterates:
                # The instruments stay: only the columns are taken anew.
                for _ in range(self._settings.rounds):
                    self.values = values
                    if self._off <= self._settings.tolerance * _COLUMNS * np.linalg.norm(values):
                        break
                    found, solution = self._solved()
                    self._off = float(np.linalg.norm(solution.values - self.values))
                    values = self._fixed_point.following(model, self.values, solution.values)
            self.model = model.at(values)
        R = found.pooled(solution.weights)[: model.size, : model.size]
        self.found, self.solution, self._root, self.values = found, solution, R, values
        self.rounds.append(
            Round(
                values=values,
                error_measured=found.relative(found.residual_norms(values)),
                error_simulated=found.relative(found.simulated_norms(values)),
                correlation=solution.correlation,
                way=way,
            )
        )

        self._past.append(
            _Found(values, self.simulated, found, solution, self.instruments, list(self.rounds))
        )

    def _solved(self) -> tuple[TriangularFactors, InstrumentalSolution]:
        """The solution with columns at the values so far."""
        self.model = self.model.at(self.values)
        found = factorise_instruments(
            self.model, self.source.measured, self.instruments, self.values
        )
        given, weighting = self.model.given_values(), self._settings.weighting
        return found, solve_instruments(found, self.model.names, given, weighting)

    def _converged(self) -> bool:
        """Whether the residual stays, at estimates that were simulated as they are."""
        if any(one.way.share < 1.0 for one in self.rounds[-2:]):
            return False
        if self.model.needs_values:
            last = self.rounds[-1].values
            if self._off > self._settings.tolerance * np.linalg.norm(last):
                return False
        before, now = (one.error_simulated for one in self.rounds[-2:])
        return abs(now - before) <= self._settings.tolerance * before
