"""A second look, at every shape there may be, where the first one leaves a residual unexplained.

A response in a gap fits where its shape is nearly the true one and nowhere else: the few shapes of
the first look may all miss it. Differential evolution (Storn and Price 1997) seeks it on one
recording, all shapes of a generation in the same steps of time; all recordings are asked about the
best that it finds. What tells a true one is that the value found is the one at which its column was
taken, which no accident brings about.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution

from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.held_out import on_recordings
from dynident.diagnose.noise import systematic_square
from dynident.diagnose.present import Present, fit_present, residuals
from dynident.diagnose.scoring import Score, candidate_moments, impossible, score
from dynident.diagnose.search import Ranking, candidates, judged, quiet_joints
from dynident.diagnose.verdict import within_noise
from dynident.effects import Effect

_LEAST = 0.1  # of the systematic square that the best of all shapes must explain, to be refined
_ENOUGH = 0.9  # of it that ends the search: the gradient does the rest
_POPULATION = 12  # shapes of a generation, per unknown
_GENERATIONS = 25
_PATIENCE = 6  # generations after which a search that explains nothing is given up


def second_look(
    store: ColumnStore,
    start: Present,
    last: Present,
    first: Ranking,
    tell: Callable[[str], None] = lambda _: None,
) -> Ranking | None:
    """Return the first ranking with an effect at its head that it had missed; None for none.

    Parameters
    ----------
    store, start : the evidence, and the model before anything was added.
    last : the model with all that was added.
    first : the ranking on `start`.
    """
    if not start.noise_known or within_noise(on_recordings(store, last)):
        return None
    sought = _sought(store, start, last)
    if not sought:
        return None
    part = _worst_recording(store, start)
    searches = []
    for effect in sought:
        tell(f"{effect.label}, a second look")
        searches.append(_Search.of(*part, effect))
    tests = first.tests + sum(one.tried for one in searches)
    found = [one.best for one in searches if one.best is not None]
    best = max(found, key=lambda one: one.settled_drop, default=None)
    if best is None:
        return None
    (everywhere,) = _scores(store, start, [best.effect])
    if everywhere.settled_drop < _LEAST * start.error_signal:
        return None
    best, refusal = judged(store, start, everywhere, tests)
    if refusal:
        return None
    rest = [
        (one, why)
        for one, why in zip(first.scores, first.refusals, strict=True)
        if one.effect.label != best.effect.label
    ]
    return Ranking((best, *(one for one, _ in rest)), tests, ("", *(why for _, why in rest)))


def _sought(store: ColumnStore, start: Present, last: Present) -> list[Effect]:
    """Effects of many shapes: those that were added with one that may be wrong, or else all."""
    quiet = quiet_joints(store, start)
    every = [
        effect
        for effect in candidates(start.model)
        if effect.sought_in(start.model.robot) and effect.joint not in quiet
    ]
    return [effect for effect in every if effect in last.model] or every


def _worst_recording(store: ColumnStore, start: Present) -> tuple[ColumnStore, Present]:
    """The recording with the largest systematic residual, and the model as it alone fits it."""
    left = residuals(store, start.model, start.values)
    sizes = [
        -1.0
        if run.kind == "single"
        else sum(systematic_square(e[..., j], run.kind) for j in range(e.shape[-1]))
        for run, e in zip(store.runs, left, strict=True)
    ]
    alone = ColumnStore(store.model, (store.runs[int(np.argmax(sizes))],))
    alone.prepare(start.model.effects)
    return alone, fit_present(alone, start.model, start)


@dataclass
class _Search:
    """A search over the shapes of one effect, and over the values at which its column is taken."""

    store: ColumnStore
    present: Present
    effect: Effect
    best: Score | None = None
    tried: int = 0
    generations: int = field(default=0)

    @classmethod
    def of(cls, store: ColumnStore, present: Present, effect: Effect) -> _Search:
        search = cls(store, present, effect)
        differential_evolution(
            search.loss,
            np.log(effect.sought_in(present.model.robot)),
            popsize=_POPULATION,
            maxiter=_GENERATIONS,
            init="sobol",
            rng=0,
            polish=False,
            updating="deferred",
            vectorized=True,
            callback=search.ends,
        )
        return search

    @property
    def explained(self) -> float:
        """Share of the systematic square that the best shape takes away."""
        return 0.0 if self.best is None else self.best.settled_drop / self.present.error_signal

    def loss(self, logs: np.ndarray) -> np.ndarray:
        """What the shapes in the columns of `logs` (unknowns, V) leave, (V,)."""
        shapes = len(self.effect.shape_parameters(self.present.model.robot))
        tried = [self.effect.shaped(*x[:shapes]).at(x[shapes:]) for x in np.exp(logs.T)]
        scores = _scores(self.store, self.present, tried)
        self.tried += len(tried)
        possible = [one for one in scores if not impossible(one, self.present.model)]
        best = max(filter(None, [self.best, *possible]), key=lambda s: s.settled_drop, default=None)
        self.best = best
        return np.array([-one.settled_drop for one in scores])

    def ends(self, intermediate_result: OptimizeResult) -> bool:
        """Whether enough is explained, or nothing after so long."""
        self.generations += 1
        hopeless = self.generations >= _PATIENCE and self.explained < _LEAST
        return hopeless or self.explained > _ENOUGH


def _scores(store: ColumnStore, present: Present, tried: list[Effect]) -> list[Score]:
    parts = candidate_moments(store, present, tried)
    for one in tried:
        store.forget(one)
    return [
        score(present, one, *part, grid=len(tried)) for one, part in zip(tried, parts, strict=True)
    ]
