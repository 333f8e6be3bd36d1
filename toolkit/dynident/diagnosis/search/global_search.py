"""The global search, over all shapes, where the ranking leaves a residual unexplained.

A response with backlash fits where its shape is nearly the true one and nowhere else: the few
shapes of the grid may all miss it. Differential evolution seeks it on one recording, all shapes of
a generation at once; all recordings are asked about the best that it finds. Where a link rattles, a
wrong shape may fit one recording and no other: then it is sought on some at once. About the best
there are others nearly as good: what is in a model is sought among them again, on all recordings.
What tells a true one is that the value found is the one at which its column was taken, which no
accident brings about.

Where no noise is known, nothing tells what of a residual is unexplained, but for bursts: noise
seldom makes them, nor a response that is linear in a smooth motion. There gaps are sought.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from dynident.criteria import GlobalSearchCriteria
from dynident.diagnosis.dependence.bursts import beyond_reversals, bursts_in
from dynident.diagnosis.search.moment_objective import ScoreTrial
from dynident.diagnosis.search.ranking import Ranking, candidates, joints_below_noise, judged
from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.diagnosis.search.scores.score import Score, admissible
from dynident.diagnosis.search.scores.scoring import scores
from dynident.diagnosis.verdict import within_noise
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, residuals
from dynident.evidence.held_out import on_recordings
from dynident.evidence.noise_model import systematic_square
from dynident.evidence.runs import Run
from dynident.fitting.shape_search import Evolution, ShapeProblem, ShapeSolution, search


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedModel:
    """A model in which something is sought.

    Attributes
    ----------
    evidence : that it is fitted to: who carries a payload may be known of one model alone.
    fitted : the fit.
    """

    evidence: Evidence
    fitted: EvidenceFit


@dataclass(frozen=True, eq=False, kw_only=True)
class RankedModel(FittedModel):
    """A model, and what is missing from it by the ranking or the global search.

    Attributes
    ----------
    ranking : candidates for it.
    """

    ranking: Ranking


_ABOUT = 1.0 / 7.0
"""Of all shapes and values that are sought, by their logarithms, to either side of those found.
Measured on 20 gaps: with a tenth one is missed by more than 5 %, with a seventh none."""

AnyModel = TypeVar("AnyModel", bound=FittedModel)


def global_search(
    start: RankedModel,
    last: RankedModel,
    progress: Callable[[str], None] = lambda _: None,
) -> RankedModel | None:
    """Return one of two models with an effect that was missed at the head of its ranking.

    What explains more or less waits until that is in the model, and comes up again if needed.

    Parameters
    ----------
    start, last : the model before anything was added, and with all that was added.
    progress : called with what is being done, for a progress display.

    Returns
    -------
    That of the two of whose residual it explains the larger share; None for none, or no need.
    """
    sought = _sought(start, last)
    if not sought:
        return None
    # An effect that is in the last model with a wrong shape is missing from the first one.
    wrong = sought[0] in last.fitted.model or last.fitted is start.fitted
    bases = (start,) if wrong else (last, start)
    searches: list[ShapeSolution[ScoreTrial]] = []
    for base in bases:  # what was added may imitate a part of what is missing, and hide the rest
        searches, found = _searched(bases, base, sought, searches, progress)
        if not found:
            continue
        _, one, better = max(found, key=lambda each: each[0])
        tests = better.ranking.tests + sum(each.evaluations for each in searches)
        best, refusal = judged(better.evidence, better.fitted, one, tests)
        if not refusal:
            alike = last.evidence.criteria.search.alike
            return replace(better, ranking=_headed(better.ranking, best, tests, alike))
    return None


def best_anywhere(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> Effect | None:
    """Return an effect at the best of all its shapes and values; None where none explains much.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model without the effect.
    effect : of many shapes, see `Effect.sought_in`.
    """
    base = FittedModel(evidence=evidence, fitted=fitted)
    _, found = _searched((base,), base, (effect,), (), lambda _: None)
    return found[0][1].effect if found else None


def best_about(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> Effect | None:
    """Return an effect at the best of the shapes and values about its own, whatever it explains.

    What comes in bursts has many optima near each other, in which a search with derivatives ends.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model without the effect.
    effect : as for `best_anywhere`, with the value at which its column is taken.

    Returns
    -------
    None where no possible one explains anything.
    """
    found = _shapes_about(evidence, fitted, effect)
    return found.best[0].found.effect if found.best else None


def _searched(
    bases: Sequence[AnyModel],
    base: AnyModel,
    sought: Sequence[Effect],
    earlier: Sequence[ShapeSolution[ScoreTrial]],
    progress: Callable[[str], None],
) -> tuple[list[ShapeSolution[ScoreTrial]], list[tuple[float, Score, AnyModel]]]:
    """Search the shapes of each effect in what one of the models leaves of its worst recording.

    Returns all searches, with the earlier ones, and the best of them for each of the models.
    """
    part = _worst_recordings(base, 1)
    if not part[1].error_signal > 0:
        return list(earlier), _finals(bases, earlier)
    searches = []
    for effect in sought:
        progress(f"{effect.label}, the global search")
        searches.append(_shapes_on(*part, effect))
    most = max(range(len(sought)), key=lambda k: _fall(searches[k]))
    alone = _fall(searches[most]) / part[1].error_signal
    searches = [*earlier, *searches]
    own, found = base.evidence.criteria.global_search, _finals(bases, searches)
    if alone > own.least and max((share for share, *_ in found), default=0.0) < own.holds * alone:
        wider = _worst_recordings(base, own.recordings)
        progress(f"{sought[most].label}, the global search in {len(wider[0].runs)} recordings")
        searches.append(_shapes_on(*wider, sought[most]))
        found = _finals(bases, searches)
    return searches, found


def _sought(start: RankedModel, last: RankedModel) -> list[Effect]:
    """Effects of many shapes: those that were added with one that may be wrong, or else all.

    These only at joints with a part of what either model leaves: what gives way at a joint is felt
    there, whatever the others feel of it. Where the noise is unknown, gaps at joints with bursts.
    """
    model, evidence = start.fitted.model, last.evidence
    every = [one for one in candidates(model) if one.sought_in(model.robot)]
    trained, judging = on_recordings(evidence, last.fitted), evidence.criteria.verdict
    if not last.fitted.noise_known:
        bursts = _joints_with_bursts(last)
        every = [one for one in every if one.joint in bursts and one.nonlinear]
        return [one for one in every if one in last.fitted.model] or every
    if within_noise(trained, judging):
        return []
    added = [one for one in every if one in last.fitted.model]
    if added:
        return added
    below_noise = joints_below_noise(evidence, last.fitted)
    felt = {
        joint
        for one in (start, last)
        for joint, is_felt in zip(model.robot.names, _felt(one.fitted), strict=True)
        if is_felt and joint not in below_noise
    }
    return [one for one in every if one.joint in felt]


def _joints_with_bursts(base: FittedModel) -> Collection[str]:
    """Joints at which few rows hold much of what a model leaves, away from their reversals."""
    model, criteria = base.fitted.model, base.evidence.criteria
    least = replace(criteria.verdict, held_by_few=criteria.global_search.held_by_few)
    trained = on_recordings(base.evidence, base.fitted)
    moving = beyond_reversals(trained, model, base.fitted.values)
    return bursts_in(moving, model.robot.names, model.robot.torque_units, least)


def may_be_elsewhere(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> bool:
    """Whether what a model leaves may come of wrong shapes of an effect that it has.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model as it fits them.
    effect : of the model.

    Returns
    -------
    True where more than a known noise is left; where none is known, if there are bursts.
    """
    if not effect.sought_in(fitted.model.robot):
        return False
    if fitted.noise_known:
        judged = on_recordings(evidence, fitted)
        return not within_noise(judged, evidence.criteria.verdict)
    bursts = _joints_with_bursts(FittedModel(evidence=evidence, fitted=fitted))
    return effect.joint in bursts and effect.nonlinear


def _felt(fitted: EvidenceFit) -> np.ndarray:
    """Joints (n,) with more left than their noise, or with a part of what is left of all."""
    over_noise = np.clip(fitted.squares / fitted.variances, 0.0, None)
    part = fitted.criteria.global_search.felt * over_noise.sum()
    return over_noise >= min(1.0, part)


def _finals(
    bases: Sequence[AnyModel], searches: Sequence[ShapeSolution[ScoreTrial]]
) -> list[tuple[float, Score, AnyModel]]:
    """The best of what was found for each model, and its share of what that model leaves."""
    every = ((one, _finalists(one.evidence, one.fitted, searches)[:1]) for one in bases)
    return [
        (best.fall / base.fitted.error_signal, best, base) for base, some in every for best in some
    ]


def _finalists(
    evidence: Evidence, fitted: EvidenceFit, searches: Sequence[ShapeSolution[ScoreTrial]]
) -> list[Score]:
    """What was found on one recording, by all of them, the best first, if it explains enough."""
    if not fitted.error_signal > 0:
        return []
    scores = [
        one
        for found in searches
        if found.best
        for one in _scores(evidence, fitted, [trial.found.effect for trial in found.best])
        if admissible(one, evidence, fitted)
        and one.drop_at_point > evidence.criteria.global_search.least * fitted.error_signal
    ]
    return sorted(scores, key=lambda one: -one.fall)


def _headed(ranking: Ranking, best: Score, tests: int, alike: float) -> Ranking:
    """A ranking with another effect at its head."""
    waits = f"asked again beside {best.effect.label}"
    others = [
        (one, why or ("" if abs(one.drop - best.drop) <= alike * best.drop else waits))
        for one, why in zip(ranking.scores, ranking.refusals, strict=True)
        if one.effect.label != best.effect.label
    ]
    return Ranking((best, *(one for one, _ in others)), tests, ("", *(why for _, why in others)))


def _fall(found: ShapeSolution[ScoreTrial]) -> float:
    """What the best shape of a search takes off the squared residual."""
    return -found.best[0].loss if found.best else 0.0


def _worst_recordings(base: FittedModel, most: int) -> tuple[Evidence, EvidenceFit]:
    """Recordings with most systematic residual over noise, and the model as they alone fit it."""
    evidence, fitted = base.evidence, base.fitted
    left = residuals(evidence, fitted.model, fitted.values)
    sizes = [_size(*each, fitted) for each in zip(evidence.runs, left, strict=True)]
    worst = sorted(np.argsort(sizes)[::-1][:most])
    alone = evidence.with_runs(tuple(evidence.runs[k] for k in worst))
    return alone, fit_evidence(alone, fitted.model, fitted)


def _size(run: Run, residual: np.ndarray, fitted: EvidenceFit) -> float:
    """What is left of a run (P, S, n) over the noise; nothing of one that does not tell its own."""
    if run.kind == "single" and fitted.noise_known:
        return -np.inf
    size = 0.0
    for j, variance in enumerate(fitted.variances.tolist()):
        versions = residual[..., j]
        if run.kind == "single":
            certain = versions[0, run.certain(j)]
            size += float(np.sum(certain**2)) / (max(len(certain), 1) * variance)
        else:
            size += systematic_square(versions, run.kind) / variance
    return size


def _shapes_on(
    evidence: Evidence, fitted: EvidenceFit, effect: Effect
) -> ShapeSolution[ScoreTrial]:
    """Search all shapes of an effect, and the values at which its column is taken."""
    bounds, systematic = np.log(effect.sought_in(fitted.model.robot)), fitted.error_signal
    criteria = evidence.criteria.global_search
    solver = replace(
        _evolution(criteria),
        enough=-criteria.enough * systematic,
        hope=-criteria.least * systematic,
    )
    return _shapes_within(evidence, fitted, effect, bounds, solver)


def _shapes_about(
    evidence: Evidence, fitted: EvidenceFit, effect: Effect
) -> ShapeSolution[ScoreTrial]:
    """Search the shapes and values about those that an effect has, in all recordings."""
    low, high = np.log(effect.sought_in(fitted.model.robot)).T
    at = np.log(np.maximum([*effect.shape, *effect.point], np.exp(low)))
    reach = _ABOUT * (high - low)
    # A fit may have led beyond what is sought.
    ends = np.maximum(at - reach, low), np.minimum(at + reach, np.maximum(at, high))
    about = np.stack(ends, axis=1)
    solver = _evolution(evidence.criteria.global_search)
    return _shapes_within(evidence, fitted, effect, about, solver)


def _evolution(criteria: GlobalSearchCriteria) -> Evolution:
    """A search that goes on whatever it explains."""
    return Evolution(
        population=criteria.population,
        generations=criteria.generations,
        patience=criteria.patience,
        finalists=criteria.finalists,
    )


def _shapes_within(
    evidence: Evidence, fitted: EvidenceFit, effect: Effect, bounds: np.ndarray, solver: Evolution
) -> ShapeSolution[ScoreTrial]:
    """Search shapes and values of an effect between bounds (s + 1, 2), logarithms."""
    shapes = len(effect.shape_parameters(fitted.model.robot))
    lower, upper = bounds.T

    def evaluate(points: Sequence[np.ndarray]) -> list[ScoreTrial]:
        tried = [effect.shaped(*x[:shapes]).at(x[shapes:]) for x in np.exp(points)]
        scores = _scores(evidence, fitted, tried)
        return [
            ScoreTrial(found=one, loss=-one.fall, admissible=admissible(one, evidence, fitted))
            for one in scores
        ]

    problem = ShapeProblem(lower=lower, upper=upper, start=(lower + upper) / 2, evaluate=evaluate)
    return search(problem, solver)


def _scores(evidence: Evidence, fitted: EvidenceFit, tried: list[Effect]) -> list[Score]:
    return scores(fitted, tried, candidate_moments(evidence, fitted, tried), len(tried))
