"""The search for missing effects: score, confirm, gate."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import fminbound, minimize

from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.present import Present
from dynident.diagnose.runs import Run
from dynident.diagnose.scoring import Score, candidate_moments, carried, cross_validate, score
from dynident.effects import Effect, catalogue
from dynident.model import Model

CONTENDERS = 6
"""Effects that are refined and cross-validated in each round."""

LEVEL = 0.01
"""Level of the test, corrected for the number of effects and shapes tried (Bonferroni)."""

LEAST_SHARE = (0.006, 0.02)
"""Least share of the squared residual that the first effect, and later ones, must explain."""

_CONFIDENT = 1.5  # standard errors of the held-out gain
_MOST_BLOCKS = 0.65  # share of blocks in which the held-out residual must fall otherwise
_TELL_APART = 2.0  # standard errors between two effects' held-out residuals
_ALIKE = 0.015  # two drops within this share of the larger are alike
_MOST_CARRIERS = 6  # recordings up to which every choice of payload carriers is tried


@dataclass(frozen=True)
class Ranking:
    """Every candidate's best score, best first, and what the gate says of it.

    Attributes
    ----------
    scores : one for each effect and place.
    tests : number of effects and shapes tried.
    refusals : why a score is not material; empty where it is.
    """

    scores: tuple[Score, ...]
    tests: int
    refusals: tuple[str, ...]

    @property
    def material(self) -> tuple[Score, ...]:
        """Scores that pass every gate, best first."""
        pairs = zip(self.scores, self.refusals, strict=True)
        return tuple(s for s, refusal in pairs if not refusal and not s.absorbed)

    def corrected(self, one: Score) -> float:
        """The p value of a score, corrected for all tests of this round."""
        return float(min(1.0, one.p_value * self.tests))


def candidates(model: Model) -> list[Effect]:
    """Every effect of the catalogue at every place where the model has none of its label."""
    found = []
    for effect in catalogue().values():
        found += [e.on(model.robot) for e in effect.candidates(model.robot) if e not in model]
    return found


def rank(
    store: ColumnStore,
    present: Present,
    added: int,
    tell: Callable[[str], None] = lambda _: None,
    only: tuple[Effect, ...] = (),
) -> Ranking:
    """Score every candidate on a model.

    Parameters
    ----------
    store, present : the evidence, and the model as it fits it.
    added : number of effects added so far; later ones must explain more.
    tell : told what is being done, for a progress display.
    only : candidates, where not the whole catalogue is meant.
    """
    model, best, tests = present.model, [], 0
    for effect in only or candidates(model):
        tell(effect.label)
        tried = list(_score_variants(store, present, effect))
        tests += len(tried)
        best.append(max(tried, key=lambda s: s.penalised))
    best.sort(key=lambda s: -s.penalised)
    for i in range(min(CONTENDERS, len(best))):
        if best[i].absorbed:
            break
        tell(f"{best[i].effect.label}, cross-validated")
        best[i] = _confirm(store, present, best[i])
    best.sort(key=lambda s: -s.penalised)
    least = LEAST_SHARE[min(added, 1)]
    scores = tuple(best)
    refusals = tuple(_refusal(s, model, tests, least) for s in scores)
    return Ranking(scores, tests, refusals)


def indistinguishable(ranking: Ranking, winner: Score) -> tuple[Effect, ...]:
    """Effects whose held-out residuals the data cannot tell from the winner's.

    An effect that contains the winner and adds nothing to it is not named.
    """
    found = []
    assert winner.losses is not None
    for other in ranking.material:
        if other.effect == winner.effect or other.losses is None:
            continue
        same_place = other.effect.joint == winner.effect.joint
        if same_place and winner.effect.name in other.effect.contains:
            continue
        difference = other.losses - winner.losses
        error = difference.std(ddof=1) * np.sqrt(len(difference))
        apart = difference.sum() > _TELL_APART * error
        alike = abs(winner.drop - other.drop) <= _ALIKE * winner.drop
        if alike or not apart:
            found.append(other.effect)
    return tuple(found)


def refined(store: ColumnStore, present: Present, one: Score) -> Score:
    """Return a score at the shape parameters that fit best."""
    shapes = one.effect.shape_parameters(present.model.robot)
    if not shapes or not one.drop > 0:
        return one
    grid = int(np.prod([len(s.grid) for s in shapes]))

    def at(shape: np.ndarray) -> Score:
        effect = one.effect.shaped(*np.exp(np.atleast_1d(shape)))
        result = _score_at(store, present, effect, grid, one.carriers)
        store.forget(effect)
        return result

    def loss(shape: np.ndarray) -> float:
        return -at(shape).drop

    if len(shapes) == 1:
        low, high = _neighbours(shapes[0], one.effect.shape[0])
        span = (float(np.log(low)), float(np.log(high)))
        found = np.atleast_1d(np.asarray(fminbound(loss, *span, xtol=2e-3)))
    else:
        bounds = [(np.log(s.lower), np.log(s.upper)) for s in shapes]
        start = np.log(one.effect.shape)
        found = minimize(loss, start, bounds=bounds, method="Nelder-Mead").x
    better = at(found)
    return better if better.drop > one.drop else one


def best_shape(store: ColumnStore, present: Present, effect: Effect) -> Effect:
    """Return an effect at the shape at which it explains most; as it is where it explains nothing.

    `present` is the model without it.
    """
    tried = [effect, *effect.variants(present.model.robot)]
    found = candidate_moments(store, present, tried)
    scores = (score(present, one, *parts, 1) for one, parts in zip(tried, found, strict=True))
    best = max(scores, key=lambda one: one.drop)
    return refined(store, present, best).effect if best.drop > 0 else effect


def carrier_choices(runs: tuple[Run, ...]) -> list[tuple[bool, ...]]:
    """Which runs may carry the payload: as the study says, or every choice where it is silent."""
    stated = [run.recording.payload for run in runs]
    if any(flag is not None for flag in stated):
        return [tuple(bool(flag) for flag in stated)]
    if len(runs) > _MOST_CARRIERS:
        singles = np.eye(len(runs), dtype=bool)
        return [tuple(bool(c) for c in row) for row in (*singles, *~singles)]
    every = product((False, True), repeat=len(runs))
    return [c for c in every if any(c) and not all(c)] or [(True,) * len(runs)]


def _score_variants(store: ColumnStore, present: Present, effect: Effect) -> Iterator[Score]:
    if "payload" in effect.needs:
        choices = carrier_choices(store.runs)
        (whole,) = candidate_moments(store, present, [effect])
        for choice in choices:
            parts = (carried(part, store, choice) for part in whole)
            one = score(present, effect, *parts, grid=len(choices), carriers=choice)
            # A load has mass: of two complementary choices only one can be meant.
            yield one if not _impossible(one, present.model) else replace(one, penalised=-np.inf)
        return
    shapes = list(effect.variants(present.model.robot))
    found = candidate_moments(store, present, shapes)
    for shaped, parts in zip(shapes, found, strict=True):
        yield score(present, shaped, *parts, grid=len(shapes))


def _score_at(store, present, effect: Effect, grid: int, carriers) -> Score:
    (parts,) = candidate_moments(store, present, [effect])
    if carriers is not None:
        parts = tuple(carried(part, store, carriers) for part in parts)
    return score(present, effect, *parts, grid=grid, carriers=carriers)


def _confirm(store: ColumnStore, present: Present, one: Score) -> Score:
    one = refined(store, present, one)
    (parts,) = candidate_moments(store, present, [one.effect])
    if one.carriers is not None:
        parts = tuple(carried(part, store, one.carriers) for part in parts)
    without, with_effect = cross_validate(present, *parts)
    return replace(one, losses=with_effect, gains=without - with_effect)


def _refusal(one: Score, model: Model, tests: int, least: float) -> str:
    """Why an effect is not material; empty where it is."""
    if one.absorbed:
        return one.effect.advice
    impossible = _impossible(one, model)
    if impossible:
        return impossible
    if one.rank == 0:
        return "its columns are noise in this data"
    if min(1.0, one.p_value * tests) >= LEVEL:
        return "not significant"
    if not one.penalised > 0:
        return "explains less than its parameters cost"
    if one.share < least:
        return f"explains only {100 * one.share:.2g} % of the squared residual"
    if one.gains is None:
        return "other effects explain more"
    spread = one.gains.std(ddof=1) * np.sqrt(len(one.gains))
    confident = one.gains.sum() > _CONFIDENT * spread
    if not (one.gains.sum() > 0 and (confident or np.mean(one.gains > 0) >= _MOST_BLOCKS)):
        return "does not help on held-out blocks"
    return ""


def _impossible(one: Score, model: Model) -> str:
    """What is physically impossible in a score's values, beyond their uncertainty."""
    if one.absorbed or not one.values:
        return ""
    parameters = one.effect.parameters(model.robot)
    for parameter, value, sigma in zip(parameters, one.values, one.sigma, strict=True):
        if value < parameter.lower - 3 * sigma or value > parameter.upper + 3 * sigma:
            return f"would need {parameter.name} = {value:.3g} {parameter.unit}"
    return ""


def _neighbours(shape, value: float) -> tuple[float, float]:
    grid = np.array(shape.grid)
    i = int(np.argmin(np.abs(grid - value)))
    low = grid[i - 1] if i > 0 else max(shape.lower, grid[0] ** 2 / grid[1])
    high = grid[i + 1] if i + 1 < len(grid) else min(shape.upper, grid[-1] ** 2 / grid[-2])
    return float(low), float(high)
