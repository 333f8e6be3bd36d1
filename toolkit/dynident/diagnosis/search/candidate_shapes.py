"""Shape parameters and points of secants at which a candidate explains most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import fminbound, minimize, minimize_scalar

from dynident.diagnosis.search.gradient import by_gradient, grid_of
from dynident.diagnosis.search.scoring import (
    Columns,
    Score,
    candidate_moments,
    impossible,
    moments_with_payload,
    score,
)
from dynident.effects import Effect
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Signals
from dynident.model import Model


@dataclass(frozen=True)
class Beside:
    """Columns of an effect, for a model that has it, to be judged beside the model without it.

    What depends on the bodies or on the predicted torque is that of the model with the effect: the
    parameters that were fitted without it have taken on a part of it.
    """

    evidence: Evidence
    whole: EvidenceFit

    def columns(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> list[list[Signals]]:
        """As `Evidence.columns`."""
        return self.evidence.columns(variants, self.whole.model, self.whole.values)


def score_at(
    evidence: Evidence,
    fitted: EvidenceFit,
    effect: Effect,
    like: Score,
    grid: int,
    columns_of: Columns | None = None,
) -> Score:
    """Score an effect with other columns; carriers of a payload as in `like`."""
    (parts,) = candidate_moments(evidence, fitted, [effect], columns_of)
    if like.payload_recordings is not None:
        parts = tuple(
            moments_with_payload(part, evidence, like.payload_recordings) for part in parts
        )
    return score(fitted, effect, *parts, grid=grid, payload_recordings=like.payload_recordings)


def refined(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None = None
) -> Score:
    """Return a score at the shape parameters and secants that fit best."""
    if not one.drop > 0:
        return one
    if not one.effect.shape_parameters(fitted.model.robot):
        return _at_its_values(evidence, fitted, one, columns_of) if one.effect.nonlinear else one
    has_slopes = type(one.effect).sensitivities is not Effect.sensitivities
    search = by_gradient if has_slopes else _by_trial
    if one.effect.point:
        one = _at_best_value(evidence, fitted, one, columns_of)
    return _better(one, search(evidence, fitted, one, columns_of))


def _better(one: Score, other: Score) -> Score:
    return other if other.drop_at_point > one.drop_at_point else one


def _at_its_values(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None
) -> Score:
    """Take secants through the values found, until they settle."""
    criteria = fitted.criteria.shapes
    for _ in range(criteria.linearisations):
        if not one.values or not np.any(one.values):
            return one
        effect = one.effect.at(_within_bounds(one, fitted))
        old = one.effect.point or (0.0,) * len(effect.point)
        change = np.linalg.norm(np.subtract(effect.point, old))
        if change <= criteria.converged * np.linalg.norm(effect.point):
            break
        better = score_at(evidence, fitted, effect, one, grid_of(effect, fitted), columns_of)
        if not better.drop > criteria.least_explained * one.drop:
            break  # the secant has left the range in which the law is what it is
        one = better
    return one


def _at_best_value(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None
) -> Score:
    """Seek the value at which the column that is taken there fits best.

    Columns that change with the value as those of bursts do cannot be iterated on.
    """
    best = one

    def loss(logarithm: float) -> float:
        nonlocal best
        effect = one.effect.at([float(np.exp(logarithm))])
        found = score_at(evidence, fitted, effect, one, grid_of(effect, fitted), columns_of)
        if found.drop_at_point > best.drop_at_point and not impossible(found, fitted):
            best = found
        return -found.drop_at_point

    (start,) = np.log(one.effect.point)
    criteria = fitted.criteria.shapes
    span = (start - criteria.value_range, start + criteria.value_range)
    minimize_scalar(loss, bounds=span, method="bounded", options={"maxiter": criteria.values_tried})
    return best


def _within_bounds(one: Score, fitted: EvidenceFit) -> list[float]:
    limits = one.effect.parameters(fitted.model.robot)
    return np.clip(one.values, [p.lower for p in limits], [p.upper for p in limits]).tolist()


def _by_trial(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None
) -> Score:
    shapes = one.effect.shape_parameters(fitted.model.robot)
    grid = grid_of(one.effect, fitted)

    def at(shape: np.ndarray) -> Score:
        effect = one.effect.shaped(*np.exp(np.atleast_1d(shape)))
        result = score_at(evidence, fitted, effect, one, grid, columns_of)
        return result

    def loss(shape: np.ndarray) -> float:
        return -at(shape).drop

    return at(_minimum(loss, shapes, one.effect.shape, fitted.criteria.shapes.precision))


def _minimum(loss: Callable[[np.ndarray], float], shapes, start, precision: float) -> np.ndarray:
    if len(shapes) == 1:
        low, high = _neighbours(shapes[0], start[0])
        span = (float(np.log(low)), float(np.log(high)))
        return np.atleast_1d(np.asarray(fminbound(loss, *span, xtol=2 * precision)))
    bounds = [(np.log(s.lower), np.log(s.upper)) for s in shapes]
    return minimize(loss, np.log(start), bounds=bounds, method="Nelder-Mead").x


def reshaped(evidence: Evidence, others: EvidenceFit, whole: EvidenceFit, effect: Effect) -> Score:
    """Return an effect's score at the shape that fits best near its own.

    Parameters
    ----------
    others, whole : the model without the effect, and with it.
    effect : as it is in the model.
    """
    beside = Beside(evidence, whole).columns
    blank = Score(effect, None, not_identifiable=False)
    now = score_at(evidence, others, effect, blank, grid_of(effect, others), beside)
    return refined(evidence, others, now, beside)


def best_shape(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> Effect:
    """Return an effect at the shape at which it explains most; as it is where it explains nothing.

    `fitted` is the model without it.
    """
    tried = [effect, *effect.variants(fitted.model.robot)]
    found = candidate_moments(evidence, fitted, tried)
    scores = (score(fitted, one, *parts, 1) for one, parts in zip(tried, found, strict=True))
    best = max(scores, key=lambda one: one.drop_at_point)
    return refined(evidence, fitted, best).effect if best.drop_at_point > 0 else effect


def _neighbours(shape, value: float) -> tuple[float, float]:
    grid = np.array(shape.grid)
    if len(grid) < 2:
        return shape.lower, shape.upper
    i = int(np.argmin(np.abs(grid - value)))
    low = grid[i - 1] if i > 0 else max(shape.lower, grid[0] ** 2 / grid[1])
    high = grid[i + 1] if i + 1 < len(grid) else min(shape.upper, grid[-1] ** 2 / grid[-2])
    return float(low), float(high)
