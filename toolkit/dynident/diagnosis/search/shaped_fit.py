"""A model fitted with the shapes of its effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.diagnosis.search.candidate_shapes import best_shape, reshaped
from dynident.diagnosis.search.global_search import best_about, best_anywhere, may_be_elsewhere
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.fitting.uncertainty.shape_slopes import ShapeSlope
from dynident.model import Model

_OFF = (0.96, 1.04)
"""Times its value at which the column of what comes in bursts is taken, to begin again."""


def shaped(evidence: Evidence, model: Model) -> EvidenceFit:
    """Fit a model as it was given, each shape parameter sought on its grid.

    Where that leaves more than a known noise, or bursts, those of many shapes are sought
    everywhere: a response with play fits at the true ones alone, and a grid may lead astray.
    """
    fitted = fit_evidence(evidence, model)
    for effect in fitted.model.effects:
        if effect.shape_parameters(model.robot):
            others = fit_evidence(evidence, fitted.model - effect, fitted)
            better = best_shape(evidence, others, effect)
            fitted = fit_evidence(evidence, fitted.model.with_shapes((better,)), fitted)
    fitted = refitted(evidence, fitted.model, fitted)
    for effect in fitted.model.effects:
        if not may_be_elsewhere(evidence, fitted, effect):
            continue
        others = fit_evidence(evidence, fitted.model - effect, fitted)
        begin = best_anywhere(evidence, others, effect)
        if begin is not None:
            fitted = sought_about(evidence, fitted, begin)
    return fitted


def sought_about(evidence: Evidence, fitted: EvidenceFit, begin: Effect) -> EvidenceFit:
    """Return the best fit with an effect at other shapes, each the best about the one before.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model with the effect.
    begin : the effect with the shape and value about which they are sought first.
    """
    first = fitted
    for _ in range(evidence.criteria.global_search.refined):
        others = fit_evidence(evidence, fitted.model - begin, fitted)
        near = best_about(evidence, others, begin)
        if near is None:
            break
        trial = refitted(evidence, fitted.model.with_shapes((near,)), fitted)
        fitted = min((fitted, trial), key=lambda one: one.misfit(first))
        latest = fitted.model.effect(begin.label)
        if latest == begin or not may_be_elsewhere(evidence, fitted, latest):
            break
        begin = latest
    return fitted


def refitted(evidence: Evidence, model: Model, near: EvidenceFit | None = None) -> EvidenceFit:
    """Fit a model, each shape parameter refined with the others as they are.

    Responses that depend on the bodies are refined again with the bodies that come out, which were
    others while the effect was missing, until nothing is gained.

    Parameters
    ----------
    evidence : the training recordings.
    model : with its shapes to begin with.
    near : as for `fit_evidence`.

    Returns
    -------
    The fit of the model with the shapes that explain most.
    """
    criteria = evidence.criteria.shapes
    fitted = fit_evidence(evidence, model, near)
    with_shapes = [e.label for e in model.effects if e.shape_parameters(model.robot)]
    driven = [e.label for e in model.effects if e.is_dynamic_response]
    for again in range(criteria.refits if driven else 1):
        labels = with_shapes if again == 0 and len(with_shapes) > 1 else driven
        before = fitted
        for label in labels:
            effect = fitted.model.effect(label)
            others = fit_evidence(evidence, fitted.model - effect, fitted)
            better = reshaped(evidence, others, fitted, effect).effect
            trial = fit_evidence(evidence, fitted.model.with_shapes((better,)), fitted)
            if trial.misfit(fitted) < fitted.misfit(fitted):
                fitted = trial
        had, has = before.misfit(before), fitted.misfit(before)
        if had - has < criteria.gained * had + criteria.negligible * before.noise_known:
            better = _from_other_values(evidence, fitted, driven)
            if better.misfit(fitted) > (1.0 - criteria.gained) * fitted.misfit(fitted):
                break
            fitted = better
    for label in with_shapes:
        fitted = _of_the_time(evidence, fitted, label)
    return fitted


def _from_other_values(
    evidence: Evidence, fitted: EvidenceFit, labels: Sequence[str]
) -> EvidenceFit:
    """Return the best fit from columns taken at values a little off; as it is if none is better.

    What comes in bursts changes by steps with its value, among which a search with derivatives
    ends early.
    """
    best = fitted
    for label in labels:
        effect = fitted.model.effect(label)
        if not effect.point:
            continue
        others = fit_evidence(evidence, fitted.model - effect, fitted)
        for factor in _OFF:
            begin = effect.at([factor * value for value in effect.point])
            better = reshaped(evidence, others, fitted, begin).effect
            trial = fit_evidence(evidence, fitted.model.with_shapes((better,)), fitted)
            best = min((best, trial), key=lambda one: one.misfit(fitted))
    return best


def _of_the_time(evidence: Evidence, fitted: EvidenceFit, label: str) -> EvidenceFit:
    """Return the fit with the shape of a time-varying effect estimated as the parameters are.

    With instruments of another time what a column takes away is largest beside the shape that
    makes residual and instruments orthogonal, of which sigma is: Gauss-Newton steps lead there.
    """
    criteria, robot = evidence.criteria.shapes, fitted.model.robot
    earlier, last = fitted, np.inf
    for _ in range(criteria.linearisations):
        effect = fitted.model.effect(label)
        shapes = effect.shape_parameters(robot)
        if not effect.time_varying or len(shapes) != 1:
            break
        values = tuple(fitted.values[fitted.model.slices[label]].tolist())
        slope = ShapeSlope(effect.joint, effect.source, of=effect, values=values)
        wider = fit_evidence(evidence, fitted.model + slope, fitted)
        (at,) = range(*wider.model.slices[slope.label].indices(wider.model.size))
        step, sigma = float(wider.values[at]), float(np.sqrt(wider.covariance[at, at]))
        known = wider.solution.rank > fitted.solution.rank
        if not known or abs(step) <= criteria.precision or sigma > np.log(criteria.furthest):
            break
        if abs(step) >= last:
            return earlier  # the last step led away
        earlier, last = fitted, abs(step)
        step = float(np.clip(step, -np.log(criteria.furthest), np.log(criteria.furthest)))
        better = effect.shaped(shapes[0].at(shapes[0].coordinate(effect.shape[0]) + step))
        if better.shape == effect.shape:
            break  # at its bound
        fitted = fit_evidence(evidence, fitted.model.with_shapes((better,)), fitted)
    return fitted
