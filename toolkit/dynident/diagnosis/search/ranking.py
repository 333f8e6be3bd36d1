"""The search for missing effects: score, confirm, gate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import SearchCriteria
from dynident.diagnosis.search.candidate_shapes import refined, untold
from dynident.diagnosis.search.cross_validation import (
    cross_validate,
    helps_on_blocks,
    left_out_losses,
)
from dynident.diagnosis.search.payload_recordings import payload_scores, unconfirmed
from dynident.diagnosis.search.scores.candidate_moments import (
    candidate_moments,
    moments_with_payload,
)
from dynident.diagnosis.search.scores.score import Score, impossible
from dynident.diagnosis.search.scores.scoring import scores
from dynident.diagnosis.search.shapes.residual_lines import (
    is_beyond,
    lines,
    lines_beyond,
    shapes_tried,
)
from dynident.effects import Block, Effect, catalogue, law_effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, residuals
from dynident.evidence.noise_model import differences, systematic_square
from dynident.model import Model
from dynident.moments.replicates import Kind

_ALIKE = 1e-10
"""Share of the squared residual by which scores of the same differ, as they are rounded."""
_BEYOND = 0.01
"""Share of all chances of a false effect that lines beyond the grids of ripples have: hundreds of
them, which few robots have, are not to make the others less significant (weighted Bonferroni). Such
a line is sharp: where there is one, it is significant all the same."""
_NOISY = "plain least squares takes it for the noise in accelerations: record a repeated motion"


@dataclass(frozen=True)
class Ranking:
    """Every candidate's best score, best first, and what the gate says of it.

    Attributes
    ----------
    scores : one for each effect and place.
    tests : number of effects and shapes tried.
    refusals : which gate a score does not pass; empty where it passes all.
    """

    scores: tuple[Score, ...]
    tests: int
    refusals: tuple[str, ...]

    @property
    def passing(self) -> tuple[Score, ...]:
        """Scores that pass every gate, best first."""
        pairs = zip(self.scores, self.refusals, strict=True)
        return tuple(s for s, refusal in pairs if not refusal and not s.not_identifiable)

    def refusing(self, reasons: Mapping[str, str]) -> Ranking:
        """Return the ranking with further effects refused, a reason for each label."""
        refusals = tuple(
            refusal or reasons.get(s.effect.label, "")
            for s, refusal in zip(self.scores, self.refusals, strict=True)
        )
        return replace(self, refusals=refusals)

    def corrected(self, one: Score) -> float:
        """The p value of a score, corrected for all tests of this round."""
        return float(min(1.0, one.p_value * self.tests))


def candidates(model: Model) -> list[Effect]:
    """Every effect that shows in residuals, wherever the model has none of its label.

    Of those that require others, or refine others at their joint, the ones that have these in the
    model; of those that may be common to all joints, no more than there are joints: with them, one
    more says nothing new. What an effect of the model excludes at its joint is not among them.
    """
    excluded = {(one, effect.joint) for effect in model.effects for one in effect.excludes}
    found = []
    laws = (law_effect(law) for law in model.laws)
    for effect in (*catalogue().values(), *laws):
        if effect.found_by != "residual" or not all(one in model for one in effect.requires):
            continue
        own = sum(one.name == effect.name for one in model.effects)
        if effect.place == "joint or robot" and own >= model.robot.n:
            continue
        found += [
            e.on(model.robot)
            for e in effect.candidates(model.robot)
            if e not in model
            and (e.name, e.joint) not in excluded
            and all(f"{one}@{e.joint}" in model for one in e.beyond)
        ]
    return found


def carries_noise(evidence: Evidence) -> bool:
    """Return whether columns are those of recordings throughout, and nothing tells their noise.

    Parameters
    ----------
    evidence : of the training recordings.
    """
    return all(run.kind == "single" and run.columns_from == "recording" for run in evidence.runs)


def rank(
    evidence: Evidence,
    fitted: EvidenceFit,
    added: int,
    progress: Callable[[str], None] = lambda _: None,
    only: tuple[Effect, ...] = (),
    least: float | None = None,
    worth: float = 0.0,
) -> Ranking:
    """Score every candidate on a model.

    Parameters
    ----------
    evidence, fitted : recordings and their columns, and the model as it fits them.
    added : number of effects added so far; later ones must explain more.
    progress : is called with what is being done, for a display.
    only : candidates, where not the whole catalogue is meant.
    least : share of the squared residual that they must explain; None for that of the criteria.
    worth : share of the misfit that an effect has to explain to be looked at more closely: what
        explains less is not cross-validated.

    Returns
    -------
    Every effect at its best shape, best first, with the gate that it does not pass; what can be
    significant nowhere stands last.
    """
    criteria, best, tests, beyond = evidence.criteria, [], 0, 0
    noisy = carries_noise(evidence)
    asked = only or tuple(candidates(fitted.model))
    below_noise: frozenset[str] = frozenset()
    if any(effect.is_dynamic_response for effect in asked):
        below_noise = joints_below_noise(evidence, fitted)
    for effect in asked:
        driven = effect.is_dynamic_response
        found_before = bool(effect.point)  # by its bursts, which noise does not make
        if driven and ((noisy and not found_before) or effect.joint in below_noise):
            best.append(Score(effect=effect, payload_recordings=None, not_identifiable=False))
            continue
        progress(effect.label)
        shapes = _shapes(evidence, fitted, effect)
        tried = list(_score_variants(evidence, fitted, effect, shapes))
        # A payload has no shapes, and recordings that may carry it in their place.
        within = sum(not is_beyond(one, fitted.model.robot) for one in shapes) or len(tried)
        tests += max(within, shapes_tried(evidence, effect))
        beyond += lines_beyond(evidence, effect)
        best.append(_best_of(tried, untold(evidence, effect)))
    tests += math.ceil(_BEYOND * tests) if beyond else 0
    alike = _ALIKE * fitted.error_total
    order = best_first([one.penalised for one in best], alike)
    hopeful = [i for i in order if _may_win(best[i], tests, criteria.search)]
    hopeful = [i for i in hopeful if best[i].drop >= worth * fitted.error_signal]
    for i in hopeful[: len(only) or criteria.search.contenders]:
        progress(f"{best[i].effect.label}, cross-validated")
        best[i] = _confirm(evidence, fitted, best[i])
    dearer = beyond / (_BEYOND * tests) if tests else 1.0
    best = [_at_its_price(one, dearer, fitted.model) for one in best]
    if least is None:
        least = criteria.gates.later_share if added else criteria.gates.first_share
    order = best_first([one.penalised for one in best], alike)
    others = (i for i in order if i not in hopeful)
    scores = tuple(best[i] for i in (*(i for i in order if i in hopeful), *others))
    refusals = tuple(
        _unseen(s, noisy) or _refusal(s, evidence, fitted, tests, least) for s in scores
    )
    return Ranking(scores, tests, refusals)


def _at_its_price(one: Score, dearer: float, model: Model) -> Score:
    """A score whose p value, times the tests, holds those that are made for its kind alone."""
    if one.not_identifiable or not is_beyond(one.effect, model.robot):
        return one
    return replace(one, p_value=min(1.0, one.p_value * max(1.0, dearer)))


def best_first(values: Sequence[float], alike: float) -> list[int]:
    """Return the places of values, the largest first; of those that are alike the first one first.

    What two effects do is the same where one is the other's column by another name: which of them
    is named first must not hang on rounding.

    Parameters
    ----------
    values : of the candidates in the order of the catalogue.
    alike : by how much those that are the same may differ.
    """
    found: list[int] = []
    same: list[int] = []
    for place in sorted(range(len(values)), key=lambda one: -values[one]):
        if same and values[same[0]] - values[place] > alike:
            found += sorted(same)
            same = []
        same.append(place)
    return found + sorted(same)


def _may_win(one: Score, tests: int, criteria: SearchCriteria) -> bool:
    """Whether it is worth the time to cross-validate an effect."""
    if one.not_identifiable or one.penalised == -np.inf:
        return False
    return one.p_value * tests <= criteria.hopeless


def _unseen(one: Score, noisy: bool) -> str:
    """Why a filtered dynamic regressor was not evaluated; empty where it was."""
    if one.drop != 0 or one.not_identifiable or not one.effect.is_dynamic_response:
        return ""
    return _NOISY if noisy else f"nothing is left to explain at {one.effect.joint}"


def joints_below_noise(evidence: Evidence, fitted: EvidenceFit) -> frozenset[str]:
    """Joints at which no residual worth a costly search is left; none where noise is unknown."""
    if not fitted.noise_known:
        return frozenset()
    left = zip(evidence.runs, residuals(evidence, fitted.model, fitted.values), strict=True)
    judged: list[tuple[Kind, np.ndarray]] = [(r.kind, e) for r, e in left if r.kind != "single"]
    found = []
    for j, name in enumerate(fitted.model.robot.names):
        systematic = np.mean([systematic_square(e[..., j], kind) for kind, e in judged])
        each = [differences(e[..., j], kind).ravel() for kind, e in judged]
        noise = np.mean(np.concatenate(each) ** 2)
        if systematic < evidence.criteria.search.below_noise**2 * noise:
            found.append(name)
    return frozenset(found)


def _shapes(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> list[Effect]:
    """An effect with the shapes of its grid, those found before, and lines; none of a payload."""
    if effect.is_payload:
        return []
    seen = _seen(fitted, effect)
    shapes = [variant.suited(seen) for variant in effect.variants(fitted.model.robot)]
    # Found before, where no variant may be near enough.
    before = [effect] if effect.point else []
    return list(dict.fromkeys([*shapes, *before, *lines(evidence, fitted, effect)]))


def _score_variants(
    evidence: Evidence, fitted: EvidenceFit, effect: Effect, shapes: Sequence[Effect]
) -> Iterator[Score]:
    """Score an effect with shapes, but for those that cannot be the best; in their order."""
    if effect.is_payload:
        for one in payload_scores(evidence, fitted, effect):
            yield _possible(one, evidence, fitted)
        return
    robot, count = fitted.model.robot, shapes_tried(evidence, effect) + bool(effect.point)
    more = lines_beyond(evidence, effect)
    grid = [count + more if is_beyond(one, robot) else count for one in shapes]
    moments = candidate_moments(evidence, fitted, shapes, evidence.first_look)
    every = scores(fitted, shapes, moments, np.array(grid))
    found, best = {}, -np.inf
    for v in sorted(range(len(every)), key=lambda v: -every[v].penalised):
        if every[v].penalised < best - untold(evidence, effect):
            break
        found[v] = _possible(every[v], evidence, fitted)
        best = max(best, found[v].penalised)
    yield from (found[v] for v in sorted(found))


def _best_of(tried: list[Score], untold: float) -> Score:
    """The score of the best shape; of a change in time, the least change that explains as much.

    A session that is short beside a change shows a ramp, whatever the time that the change takes:
    the longer that is, the larger are the values of the same ramp.

    Parameters
    ----------
    tried : scores of one effect.
    untold : how much less another shape may explain.
    """
    best = max(tried, key=lambda s: s.penalised)
    if not untold > 0 or not best.penalised > 0:
        return best
    as_much = (one for one in tried if best.penalised - one.penalised < untold)
    return min(as_much, key=lambda one: np.linalg.norm(one.values))


def _possible(one: Score, evidence: Evidence, fitted: EvidenceFit) -> Score:
    """Return a score that counts for nothing where its values are impossible."""
    if not impossible(one, fitted):
        return one
    anew = _beside_the_new_torque(one, evidence, fitted)
    return replace(anew, penalised=-np.inf) if impossible(anew, fitted) else anew


def _beside_the_new_torque(one: Score, evidence: Evidence, fitted: EvidenceFit) -> Score:
    """Return a score with the share of the torque that a model predicts once the effect is in it.

    A score's value is a share of what the model predicts without the effect. The gain of one drive
    is, but for the bodies' scale, the gain of every other: with that scale a value that seems to be
    impossible is the only one that is not.
    """
    if not (one.effect.linear_in_torque and one.penalised > 0):
        return one
    wider = fit_evidence(evidence, fitted.model + one.effect, fitted)
    if not wider.misfit(fitted) < fitted.misfit(fitted):
        return one
    own = wider.model.slices[one.effect.label]
    covariance = wider.covariance[own, own]
    sigma = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    return replace(
        one,
        values=tuple(wider.values[own].tolist()),
        sigma=tuple(sigma.tolist()),
        covariance=covariance,
    )


def _seen(fitted: EvidenceFit, effect: Effect) -> Block:
    """One sample with the bodies that an effect needs of the fitted model."""
    still = np.zeros((1, fitted.model.robot.n))
    block = fitted.model.block(np.zeros(1), still, still, still)
    return fitted.model.with_bodies(effect, block, fitted.values)


def judged(evidence: Evidence, fitted: EvidenceFit, one: Score, tests: int) -> tuple[Score, str]:
    """Refine and cross-validate a score, and judge it.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them.
    one : the score.
    tests : number of effects and shapes tried.

    Returns
    -------
    The score, and the gate that it does not pass, in words; "" where it passes all.
    """
    one = _confirm(evidence, fitted, one)
    return one, _refusal(one, evidence, fitted, tests, evidence.criteria.gates.first_share)


def _confirm(evidence: Evidence, fitted: EvidenceFit, one: Score) -> Score:
    screened, one = one, refined(evidence, fitted, one)
    # The shape that was screened is one of the tests that are counted; it may be told better.
    one = replace(one, p_value=min(one.p_value, screened.p_value))
    (parts,) = candidate_moments(evidence, fitted, [one.effect])
    if one.payload_recordings is not None:
        parts = tuple(
            moments_with_payload(part, evidence, one.payload_recordings) for part in parts
        )
    without, with_effect = cross_validate(fitted.beside(one.effect), *parts)
    gains = without - with_effect
    # Columns taken at a value count as far as that is the value found.
    relaxed = one.penalised - (one.drop - one.drop_at_point)
    # Of what the fit itself misses: the losses of rivals are compared.
    return replace(one, penalised=relaxed, losses=left_out_losses(fitted) - gains, gains=gains)


def _refusal(one: Score, evidence: Evidence, fitted: EvidenceFit, tests: int, least: float) -> str:
    """Why an effect is not significant or not relevant; empty where it is both."""
    gates = evidence.criteria.gates
    if one.not_identifiable:
        return one.effect.advice
    if beyond := impossible(one, fitted):
        return beyond
    if one.rank == 0:
        return "its columns are noise in this data"
    if min(1.0, one.p_value * tests) >= gates.level:
        return "not significant"
    if not one.penalised > 0:
        return "explains less than its parameters cost"
    if one.share < least:
        return f"explains only {100 * one.share:.2g} % of the squared residual"
    if why := one.effect.unresolved(one.values, evidence.longest_step):
        return why
    if one.gains is None:
        return "other effects explain more"
    assert one.losses is not None
    gain = one.gains.sum() / max(float(np.sum(one.losses + one.gains)), 1e-300)
    if 0 < gain < gates.least_gain:
        return f"takes only {100 * gain:.2g} % off the held-out squared residual"
    if not helps_on_blocks(one.gains, gates):
        return "does not help on held-out blocks"
    free = evidence.without_noise_in(one.effect)
    if free is not evidence:
        return _like_noise(one.effect, free, fitted, tests, least)
    return unconfirmed(evidence, fitted, one)


def _like_noise(
    effect: Effect, free: Evidence, fitted: EvidenceFit, tests: int, least: float
) -> str:
    """Why a response may be made of the noise of measured positions; empty where it is not.

    A column of noisy positions explains their noise, also on held-out data. Along the simulated
    motion, which knows nothing of that noise, it explains nothing unless something is missing.
    """
    shapes = _shapes(free, fitted, effect)
    tried = list(_score_variants(free, fitted, effect, shapes))
    best = max(tried, key=lambda each: each.penalised)
    if best.penalised > -np.inf:
        best = _confirm(free, fitted, best)
    why = _refusal(best, free, fitted, tests + len(shapes), least)
    return f"along the simulated motion, which has no noise of positions: {why}" if why else ""


def unresolved(evidence: Evidence, fitted: EvidenceFit, label: str) -> str:
    """Return why the samples do not tell an effect with the values of a fit; empty if they do.

    Parameters
    ----------
    evidence : the recordings.
    fitted : the model with the effect.
    label : of the effect.
    """
    effect = fitted.model.effect(label)
    values = fitted.values[fitted.model.slices[label]].tolist()
    return effect.unresolved(values, evidence.longest_step)
