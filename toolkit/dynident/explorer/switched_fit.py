"""The model with the effects that are switched on: fitted at once, judged on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from threading import RLock

import numpy as np

from dynident.diagnosis.search.refusal import impossible_in
from dynident.effects import Effect, effects_of
from dynident.evidence import ResidualMap
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import HeldOut, on_blocks, on_recordings
from dynident.evidence.maps import residual_maps
from dynident.evidence.model_columns import model_columns
from dynident.evidence.runs import gather
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import LeastSquares, estimate_of
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.reversals.misplaced_reversals import fitted_without
from dynident.fitting.reversals.standing_joints import standing_in, without_stops
from dynident.fitting.sampling import Sampled, sample
from dynident.fitting.uncertainty.shape_errors import with_shape_errors
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset
from dynident.study import Study
from dynident.threads import single_threaded

_KEPT = 64  # fits that are remembered: switching back costs nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class SwitchedFit:
    """A model with some effects switched on.

    Attributes
    ----------
    estimate : least squares, weighted per joint; its sigma takes rows as independent, and is not
        shown: see `Refitter.with_intervals`.
    fitted : what it leaves of the training recordings.
    judged : what it leaves of what it has not seen: the test recordings, or blocks of time.
    """

    estimate: Estimate
    fitted: HeldOut
    judged: HeldOut

    @property
    def model(self) -> Model:
        """The model that was fitted."""
        return self.estimate.model


class Refitter:
    """Fits a study's model with effects more, quickly: columns are evaluated once and kept.

    The shapes of effects stay as they are given: they were sought by the diagnosis. Values are
    those of `di.fit` with these shapes, held-out errors those of `compare`; where a study has no
    test recordings, those of `compare_models`, on blocks of time.

    Parameters
    ----------
    study : its recordings, filter and criteria.
    model : to begin with; by default the study's.
    """

    def __init__(self, study: Study, model: Model | None = None) -> None:
        self.study, self.model = study, study.model if model is None else model
        criteria = study.criteria
        # Both errors that a switch compares are of the same rows: as if all had dry friction.
        dry = effects_of("coulomb_friction", self.model.robot)
        every = self.model + tuple(one for one in dry if one not in self.model)
        self._recorded = without_stops(every, study.train)
        test = without_stops(every, study.test, standing_in(self._recorded))
        runs = gather(self._recorded, criteria.noise)
        self._train = Evidence(self.model, runs, criteria=criteria)
        self._test = None
        if len(test):
            runs = gather(test, criteria.noise)
            self._test = Evidence(self.model, runs, criteria=criteria)
        # What is kept of columns is for one at a time; requests come in threads.
        self._lock, self._slowly = RLock(), RLock()
        self._fits = lru_cache(_KEPT)(self._fit)
        self._estimates = lru_cache(_KEPT)(self._with_intervals)

    def fit(self, effects: Sequence[Effect] = ()) -> SwitchedFit:
        """Fit the model with effects more.

        Parameters
        ----------
        effects : that are switched on, with their shapes; in any order.

        Raises
        ------
        FitError
            If the recordings cannot carry the model.
        """
        with self._lock:
            return self._fits(_ordered(effects))

    def with_intervals(self, effects: Sequence[Effect] = ()) -> Estimate:
        """Fit the same with standard deviations that hold: slower, see `LeastSquares.errors`.

        Parameters
        ----------
        effects : as for `fit`.
        """
        with self._slowly:  # or what is asked for twice would be worked out twice
            return self._estimates(_ordered(effects))

    def impossible(self, estimate: Estimate) -> tuple[str, ...]:
        """Return what an estimate says that no robot can have, by the rules of the diagnosis."""
        with self._lock:
            found = impossible_in(self._train, estimate, self.study.criteria.gates)  # type: ignore[arg-type]
        return tuple(str(one) for one in found)

    def maps(self, before: SwitchedFit, after: SwitchedFit) -> tuple[ResidualMap, ...]:
        """Return the residual maps of two fits on what both have not seen."""
        return residual_maps(self.model, before.judged, after.judged, self.study.criteria)

    @single_threaded
    def _fit(self, effects: tuple[Effect, ...]) -> SwitchedFit:
        model = self.model + effects
        estimate = self._estimate(model)
        fitted = on_recordings(self._train, estimate)
        if self._test is not None:
            judged = on_recordings(self._test, estimate)
        else:
            judged = on_blocks(self._train, fit_evidence(self._train, model))
        return SwitchedFit(estimate=estimate, fitted=fitted, judged=judged)

    def _estimate(self, model: Model) -> Estimate:
        """Least squares on the columns that are kept."""
        quick = partial(self._quickly, model)
        if model.needs_values:  # columns depend on the fit, and are taken again and again
            quick = partial(LeastSquares(errors="independent").fit, model)
        return fitted_without(quick, self._recorded)[0]

    def _quickly(self, model: Model, train: Dataset) -> Estimate:
        factors = factorise(
            self._rows(model, run, sample(one, train.filter))
            for run, one in enumerate(train.recordings)
        )
        solution = solve_factors(model, factors)
        return estimate_of(LeastSquares.name, "joint", model, train, factors, solution)

    def _rows(self, model: Model, run: int, sampled: Sampled) -> tuple[np.ndarray, np.ndarray]:
        """Columns (T, n, p) and torque (T, n) of a recording, zero in rows that do not count."""
        joints = range(model.robot.n)
        found = [model_columns(self._train, model, run, j, None)[0] for j in joints]
        rows = sampled.counted(np.stack(found, axis=1))
        return rows[:, :, :-1], rows[:, :, -1]

    @single_threaded
    def _with_intervals(self, effects: tuple[Effect, ...]) -> Estimate:
        method, model = LeastSquares(), self.model + effects
        estimate, train = fitted_without(partial(method.fit, model), self._recorded)
        return with_shape_errors(estimate, lambda one: method.fit(one, train))


def _ordered(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """One order for the same effects, in whichever they were switched on."""
    return tuple(sorted(effects, key=lambda effect: effect.label))
