"""Extending a model: the best effect is added, all is fitted anew and ranked again.

Until none passes every gate.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from dynident.diagnosis.extension.reversals import as_much, without_their_reversals
from dynident.diagnosis.extension.stage import DiagnosisTask, Stage, VisitedModel
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.nuisances.quantisation import nothing_but_rounding
from dynident.diagnosis.nuisances.reversal_laws import laws_of_the_rest, laws_that_do_as_well
from dynident.diagnosis.nuisances.sticking import seen_alike, without_sticking
from dynident.diagnosis.search.payload_recordings import with_payload
from dynident.diagnosis.search.ranking import rank, unresolved
from dynident.diagnosis.search.refusal import follows_the_filter, newly_impossible
from dynident.diagnosis.search.selection import (
    AddedEffect,
    alternatives_only,
    at_other_joints,
    breaks_its_promise,
    choose,
)
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_recordings


def rank_stage(stage: Stage, task: DiagnosisTask, worth: float = 0.0) -> Stage:
    """Rank every effect that the model lacks; drop alternatives that are significant beside it.

    Parameters
    ----------
    stage : the model as far as it is extended.
    task : what is asked.
    worth : share of the misfit from which an effect is looked at more closely.

    Returns
    -------
    With one ranking more.
    """
    added = len(stage.found)
    ranking = rank(stage.evidence, stage.fitted, added, task.progress, worth=worth)
    ranking = ranking.refusing(stage.refused)
    found = tuple(
        alternatives_only(one, ranking) if one in stage.latest else one for one in stage.found
    )
    visited = (*stage.visited, stage.visiting)
    return replace(stage, found=found, rounds=(*stage.rounds, ranking), visited=visited)


def extend(stage: Stage, task: DiagnosisTask, elsewhere: Collection[VisitedModel] = ()) -> Stage:
    """Add the best effect, refit, and rank again, until none passes every gate.

    Parameters
    ----------
    stage : the model with its latest ranking.
    task : what is asked; how many effects may be added, among others.
    elsewhere : models from which other ways went on.

    Returns
    -------
    The model with its last ranking; or, not ranked again, with all that one of the others has.
    """
    while stage.proposals < task.most:
        many = len(stage.found)
        stage = with_one_more(stage, task)
        if len(stage.found) == many or joins(stage, elsewhere):
            break
        stage = rank_stage(stage, task)
    return stage


def joins(stage: Stage, elsewhere: Collection[VisitedModel]) -> bool:
    """Whether a model is one by which another way has come."""
    return bool(elsewhere) and any(map(stage.visiting.is_same, elsewhere))


def with_one_more(stage: Stage, task: DiagnosisTask) -> Stage:
    """Add the best effect that stands every test, and refit; nothing where none does.

    Parameters
    ----------
    stage : the model with its latest ranking.
    task : what is asked.

    Returns
    -------
    The model with its effect, not ranked again; or with a ranking that says why there is none.
    """
    while True:
        if why := _resolved(stage, task):
            every = [one.effect.label for one in stage.rounds[-1].passing]
            return _refusing(stage, dict.fromkeys(every, why))
        best = choose(stage.evidence, stage.fitted, stage.rounds[-1])
        if best is None:
            laws = laws_of_the_rest(stage.evidence, stage.fitted)
            doubtful = without_their_reversals(stage, laws, "")
            if doubtful is stage:
                return stage
            stage = rank_stage(doubtful, task)
            continue
        label, many = best.score.effect.label, len(stage.found)
        laws = laws_that_do_as_well(stage.evidence, stage.fitted, best.score, many)
        doubtful = without_their_reversals(stage, laws, label)
        if doubtful is not stage:
            stage = rank_stage(doubtful, task)
            continue
        if laws:
            why = as_much(laws, label)
            earlier = (one for one in stage.notes if not one.startswith(f"{label} "))
            noted = replace(stage, notes=(*earlier, f"{why}."))
            stage = _refusing(noted, {label: why})
            continue
        wider, why = tried(stage, best, task)
        if not why:
            return wider
        stage = _refusing(stage, {label: why})


def _refusing(stage: Stage, reasons: Mapping[str, str]) -> Stage:
    """Return a stage whose latest ranking refuses effects, by their labels."""
    ranking = stage.rounds[-1].refusing(reasons)
    return replace(stage, rounds=(*stage.rounds[:-1], ranking))


def tried(stage: Stage, best: AddedEffect, task: DiagnosisTask) -> tuple[Stage, str]:
    """Return the model with one effect more, and why it is refused; that is empty if it is not.

    Parameters
    ----------
    stage : the model with its latest ranking.
    best : the effect.
    task : what is asked.

    Returns
    -------
    The model, all of it fitted anew and not ranked again, and the reason in words.
    """
    added = _add_and_refit(stage, best, task)
    if why := breaks_its_promise(stage.fitted, added.fitted, best.score):
        return added, why
    wider = _seen_anew(stage, added)
    why = newly_impossible(wider.evidence, stage.fitted, wider.fitted)
    why = why or unresolved(wider.evidence, wider.fitted, best.score.effect.label)
    effect = best.score.effect
    narrow = seen_alike(stage.narrow, wider.evidence, stage.doubtful, effect.joint)
    why = why or follows_the_filter(wider.evidence, narrow, wider.fitted, effect)
    return wider, why


def _add_and_refit(stage: Stage, best: AddedEffect, task: DiagnosisTask) -> Stage:
    """Return the model with one effect more, all of it fitted anew."""
    task.progress(f"adding {best.score.effect.label}")
    evidence, before, start = with_payload(stage.evidence, best.score), stage.fitted, stage.start
    if evidence is not stage.evidence:
        start = fit_evidence(evidence, start.model, start)
    others = at_other_joints(evidence, before, best, len(stage.found))
    others = tuple(one for one in others if one.score.effect.label not in stage.refused)
    added = (best, *others)
    model = before.model + tuple(one.score.effect for one in added)
    fitted = with_friction_width(evidence, refitted(evidence, model, before))
    found = (*stage.found, *added)
    return replace(stage, evidence=evidence, start=start, fitted=fitted, found=found)


def _seen_anew(stage: Stage, added: Stage) -> Stage:
    """Return a model with the evidence that it calls for: columns, a simulated loop, reversals."""
    evidence, fitted = added.evidence, added.fitted
    if _has_changed(evidence, stage.start, fitted):
        evidence = evidence.looked_at_anew()
    loop, moved = stage.loop.renewed(evidence, fitted)
    if moved is not evidence:
        evidence = moved
        fitted = with_friction_width(evidence, refitted(evidence, fitted.model, fitted))
    whole, start = evidence, added.start
    evidence, held = without_sticking(evidence, added.held, fitted)
    if evidence is not whole:
        start = fit_evidence(evidence, start.model, start)
        fitted = fit_evidence(evidence, fitted.model, fitted)
    return replace(added, evidence=evidence, held=held, loop=loop, start=start, fitted=fitted)


def _has_changed(evidence: Evidence, start: EvidenceFit, fitted: EvidenceFit) -> bool:
    """Whether effects have changed the predicted torque enough to look at candidates again."""
    before, now = (on_recordings(evidence, one) for one in (start, fitted))
    return now.error < before.error - evidence.criteria.search.another_model


def _resolved(stage: Stage, task: DiagnosisTask) -> str:
    """Why nothing is sought in what is left; empty where it may be missing physics."""
    judged = on_recordings(stage.evidence, stage.fitted)
    least = stage.evidence.criteria.verdict.resolution
    if np.all(judged.residual_rms <= least * judged.torque_rms):
        return "all that is left is less than the processing resolves"
    if nothing_but_rounding(judged, stage.fitted, task.train):
        return "all that is left may be the steps of the encoders"
    return ""
