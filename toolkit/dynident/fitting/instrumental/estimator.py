"""The instrumental variable estimator, iterated to a fixed point."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from dynident.closed_loop import Controller
from dynident.errors import DynidentError, FitError, SimulationError
from dynident.fitting.estimate import Estimate
from dynident.fitting.fixed_point import FixedPoint
from dynident.fitting.history import Ending, Round, Way
from dynident.fitting.instrumental.estimate_assembly import assemble
from dynident.fitting.instrumental.loop_source import LoopSource
from dynident.fitting.instrumental.normal_equations import (
    InstrumentalFactors,
    InstrumentalSolution,
    moments,
    solve,
)
from dynident.fitting.instrumental.simulated_loop import SimulatedLoop
from dynident.fitting.instrumental.source import (
    Guess,
    Instruments,
    InstrumentSource,
    ProgressCallback,
    silent,
)
from dynident.fitting.instrumental.starts import START_NAMES, Start, start_values
from dynident.fitting.least_squares import LeastSquares
from dynident.model import Model
from dynident.recording import Dataset
from dynident.threads import single_threaded

_HALVINGS = 5
_COLUMNS = 1e-3
"""Share of the tolerance within which columns that depend on the estimate settle."""


@dataclass(frozen=True)
class IV:
    """Instrumental variables: x = (V' W)^-1 V' y, V from motion that has not the measured noise.

    With noisy positions the regressor W is noisy too, and least squares is wrong however long the
    recording. V, the same columns along a motion without that noise, mends this. Where V comes
    from the simulated loop of the last estimate, the two are iterated to a fixed point.

    Parameters
    ----------
    instruments : a `Controller`, for the simulated loop with its defaults; a `SimulatedLoop`;
        `SwappedPeriods`; or `Filtered`.
    start : "least_squares"; "description", of the robot, without effects; "regular", every rotor
        inertia (or inertia about the joint's axis) 1 and all else 0; or an earlier estimate of the
        same model.
    weighting : "joint" weights each joint's rows with the standard deviation of its residual.
    tolerance : the iterations stop when the norm of y - V x changes by less, relatively.
    rounds : at most so many iterations.
    tell : of progress.

    Notes
    -----
    Janot, Vandanjon and Gautier, "An instrumental variable approach for rigid industrial robots
    identification" (preprint 2010), equations 28 to 34.
    """

    instruments: Controller | Instruments
    start: Start | Estimate = "least_squares"
    weighting: Literal["joint", "none"] = "joint"
    tolerance: float = 1e-2
    rounds: int = 20
    progress: ProgressCallback = field(default=silent, compare=False)
    name: ClassVar[str] = "instrumental variables"

    def __post_init__(self) -> None:
        if not hasattr(self.chosen, "prepare"):
            what = f"a {type(self.instruments).__name__} is no choice of instruments"
            remedy = (
                "give the study's controller (a [controller] table), SwappedPeriods() or Filtered"
            )
            raise FitError(what, "IV", remedy)
        if not isinstance(self.start, Estimate) and self.start not in START_NAMES:
            remedy = f"choose {', '.join(START_NAMES)}, or give an estimate"
            raise FitError(f"start = {self.start!r}", "IV", remedy)
        if not 0 < self.tolerance < 1 or self.rounds < 1:
            what = f"tolerance = {self.tolerance!r}, rounds = {self.rounds!r}"
            raise FitError(what, "IV", "choose a tolerance between 0 and 1, and 1 round or more")

    @property
    def chosen(self) -> Instruments:
        """The instruments: a controller alone stands for its simulated loop."""
        if isinstance(self.instruments, Controller):
            return SimulatedLoop(self.instruments)
        return self.instruments

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are what they are.

        Raises
        ------
        FitError
            If the recordings cannot carry the model or the instruments, or lose rank.
        SimulationError
            If not even the start can be simulated.
        """
        iterations = self.iterated(model, dataset)
        return assemble(self, iterations.source, iterations, iterations.start_name)

    def iterated(self, model: Model, dataset: Dataset) -> Iterations:
        """Return the iterations of a fit, done; raises what `fit` raises."""
        if not dataset.recordings:
            raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
        first = LeastSquares(self.weighting).fit(model, dataset)
        start = start_values(self.start, model, first)
        guess = Guess(start, (model.given_values(), first.values), self.progress)
        source = self.chosen.prepare(model, dataset, guess)
        name = "an earlier estimate" if isinstance(self.start, Estimate) else self.start
        if self.start == "least_squares" and _hopeless(source, start):
            start = start_values("regular", model, first)
            name = "regular (least squares has lost the inertias in noise)"
            source = self.chosen.prepare(model, dataset, replace(guess, start=start))
        iterations = Iterations(self, model, source, start, name.replace("_", " "))
        iterations.run()
        return iterations


def _hopeless(source: InstrumentSource, start: np.ndarray) -> bool:
    return isinstance(source, LoopSource) and source.next_to_massless(start)


@dataclass(frozen=True, eq=False)
class _Past:
    """What one iteration found; see `Iterations`."""

    values: np.ndarray
    simulated: np.ndarray | None
    found: InstrumentalFactors
    solution: InstrumentalSolution
    instruments: Dataset
    rounds: list[Round]


class Iterations:
    """The fixed-point iteration at work, and what it has found so far.

    Attributes
    ----------
    source : of the instruments.
    start, start_name : (p,) where they began, and what that is in words.
    values : (p,) the present estimate.
    model : with its columns at the present estimate.
    rounds : one for each iteration done.
    ending, message : how they ended.
    found, solution : of the last round.
    instruments : recordings behind the last round.
    simulated : (p,) values whose simulation these are; None where they are none, or that of the
        nearest possible robot.
    """

    def __init__(
        self, method: IV, model: Model, source: InstrumentSource, start: np.ndarray, start_name: str
    ) -> None:
        self._method, self.model, self.source = method, model, source
        self._settling = FixedPoint()
        self._good: np.ndarray | None = None
        self.start, self.start_name = start, start_name
        self.simulated: np.ndarray | None = None
        self._root: np.ndarray | None = None
        self.values = start
        self.rounds: list[Round] = []
        self._past: list[_Past] = []
        self.ending, self.message = Ending.ROUNDS_EXHAUSTED, ""
        self.found: InstrumentalFactors
        self.solution: InstrumentalSolution
        self.instruments: Dataset

    def run(self) -> None:
        """Iterate until the residual stays, or an estimate cannot be simulated."""
        limit = self._method.rounds if self.source.iterates else 1
        for count in range(limit):
            self._method.progress("instrumental variables", count, limit)
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
            if len(self.rounds) > 1 and self._settled():
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

    def _restore(self, past: _Past) -> None:
        self.values, self.simulated = past.values, past.simulated
        self.model = self.model.at(past.values)
        self.found, self.solution = past.found, past.solution
        self.instruments, self.rounds = past.instruments, past.rounds

    def _renew(self) -> Way:
        """Make the instruments of the present estimate, projected or damped if need be."""
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
            values = self._settling.following(model, self.values, values)
            if not self.source.iterates:
                # The instruments stay: only the columns are taken anew.
                for _ in range(self._method.rounds):
                    change = np.linalg.norm(values - self.values)
                    self.values = values
                    if change <= self._method.tolerance * _COLUMNS * np.linalg.norm(values):
                        break
                    found, solution = self._solved()
                    values = self._settling.following(model, self.values, solution.values)
            self.model = model.at(values)
        R = found.factors.pooled(solution.weights)[: model.size, : model.size]
        self.found, self.solution, self._root, self.values = found, solution, R, values
        self.rounds.append(
            Round(
                values,
                found.relative(found.residual_norms(values)),
                found.relative(found.simulated_norms(values)),
                solution.correlation,
                way,
            )
        )

        self._past.append(
            _Past(values, self.simulated, found, solution, self.instruments, list(self.rounds))
        )

    def _solved(self) -> tuple[InstrumentalFactors, InstrumentalSolution]:
        """The solution with columns at the present values."""
        self.model = self.model.at(self.values)
        found = moments(self.model, self.source.measured, self.instruments, self.values)
        given, weighting = self.model.given_values(), self._method.weighting
        return found, solve(found, self.model.names, given, weighting)

    def _settled(self) -> bool:
        """Whether the residual stays, at estimates that were simulated as they are."""
        if any(one.way.share < 1.0 for one in self.rounds[-2:]):
            return False
        if self.model.needs_values:
            last, one = self.rounds[-1].values, self.rounds[-2].values
            if np.linalg.norm(last - one) > self._method.tolerance * np.linalg.norm(last):
                return False
        before, now = (one.error_simulated for one in self.rounds[-2:])
        return abs(now - before) <= self._method.tolerance * before
