"""Shape parameters and linearisation points at which a candidate explains most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from dynident.diagnosis.search.moment_objective import MomentObjective
from dynident.diagnosis.search.scores.candidate_moments import Columns, candidate_moments
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.scores.scoring import scores
from dynident.diagnosis.search.shapes.residual_lines import line_width, lines
from dynident.effects import Effect, ShapeParameter
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Signals
from dynident.fitting.shape_search import Bracket, Simplex, TrustRegion, search
from dynident.model import Model

_OF_A_LINE = 1e-4
"""Share of the width of a line over position to which its place is sought: noise tells a strong
line's far better than the precision of other shapes."""
_GOES_ON = 1.0 + 1e-3
"""Times as much that must be explained where a search with derivatives ends at its reach, for it to
go on: along a direction that tells nothing it would leave for shapes that are another law."""
_AT_END = 2.0
"""Precisions from an end of a bracket within which the best lies beyond it."""
_AS_MUCH = float(chdtri(1, 0.05))
"""Squared, whitened residual by which one shape is told from another (95 %)."""


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
        """As `Evidence.columns`.

        Parameters
        ----------
        variants : one effect at one place, with any number of shapes.
        model, values : not used: the columns are those of `whole`.

        Returns
        -------
        For each run, for each variant: (T, J, k) for each replicate.
        """
        return self.evidence.columns(variants, self.whole.model, self.whole.values)


def refined(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None = None
) -> Score:
    """Return a score at the shape parameters and linearisation points that fit best.

    Parameters
    ----------
    evidence, fitted : the evidence, and the model without the effect as it fits it.
    one : the score that is refined.
    columns_of : where columns come from; `Evidence.columns` by default.
    """
    if not one.drop > 0:
        return one
    if one.effect.point and one.effect.is_dynamic_response and not min(one.effect.point) > 0.0:
        return one  # where a gap has closed, no shape of its two sides is seen
    objective, criteria = MomentObjective(evidence, fitted, one, columns_of), fitted.criteria.shapes
    if not one.effect.shape_parameters(fitted.model.robot):
        return _at_its_values(objective) if one.effect.nonlinear else one
    if one.effect.point:
        # A column that changes with the value as that of a burst does cannot be iterated on.
        solver = Bracket(evaluations=criteria.values_tried)
        found = search(objective.by_value(criteria.value_range), solver).best
        objective = replace(objective, one=_better(one, *(trial.found for trial in found)))
    differentiable = type(one.effect).sensitivities is not Effect.sensitivities
    # What depends on the time has instruments of its own, which no derivative has.
    if differentiable and not one.effect.time_varying:
        # A flat metric hides what matters in a sharp one: hence the small fall.
        solver = TrustRegion(
            precision=criteria.gradient_precision,
            fall=criteria.gradient_fall,
            evaluations=criteria.evaluations,
        )
        while True:
            found = search(objective.by_derivatives(), solver).best
            better = _better(objective.one, *(trial.found for trial in found))
            gained = better.drop_at_point > _GOES_ON * objective.one.drop_at_point
            if not gained or not objective.went_as_far_as_it_may(better):
                return better
            objective = replace(objective, one=better)
    found = _by_trial(objective)
    if found.drop - objective.one.drop < untold(evidence, one.effect):
        return objective.one
    return _better(objective.one, found)


def untold(evidence: Evidence, effect: Effect) -> float:
    """Return how much less a shape may explain than the best one and be taken all the same.

    Where a motion repeats, the noise that repetitions tell holds what changes with the time, and
    how long the change takes is told afterwards, when it is in the model.

    Parameters
    ----------
    evidence, effect : the recordings, and what is sought.

    Returns
    -------
    Squared, whitened residual; zero but for changes in time where a motion repeats.
    """
    repeats = any(run.kind == "repeated" for run in evidence.runs)
    return _AS_MUCH if effect.time_varying and repeats else 0.0


def _better(one: Score, *others: Score) -> Score:
    """The score that explains more at the value where its column is taken; the first of equals."""
    return max((one, *others), key=lambda each: each.drop_at_point)


def _at_its_values(objective: MomentObjective) -> Score:
    """Linearise at the values found, until they converge."""
    one, criteria = objective.one, objective.fitted.criteria.shapes
    for _ in range(criteria.linearisations):
        if not one.values or not np.any(one.values):
            return one
        effect = one.effect.at(_within_bounds(one, objective.fitted))
        old = one.effect.point or (0.0,) * len(effect.point)
        change = np.linalg.norm(np.subtract(effect.point, old))
        if change <= criteria.converged * np.linalg.norm(effect.point):
            break
        better = objective.score_at(effect)
        if not better.drop > criteria.least_explained * one.drop:
            break  # the point has left the range in which the law is what it is
        one = better
    return one


def _within_bounds(one: Score, fitted: EvidenceFit) -> list[float]:
    limits = one.effect.parameters(fitted.model.robot)
    return np.clip(one.values, [p.lower for p in limits], [p.upper for p in limits]).tolist()


def _by_trial(objective: MomentObjective) -> Score:
    """The best score where no derivatives are known; of one shape, between its neighbours."""
    effect = objective.one.effect
    shapes = effect.shape_parameters(objective.fitted.model.robot)
    if len(shapes) == 1:
        return _by_bracket(objective, shapes[0])
    lower, upper = np.array([[s.coordinate(x) for x in (s.lower, s.upper)] for s in shapes]).T
    return search(objective.by_trial(lower, upper), Simplex()).best[0].found


def _by_bracket(objective: MomentObjective, shape: ShapeParameter) -> Score:
    """The best score of one shape between its neighbours, or beyond where it ends at one."""
    effect, precision = objective.one.effect, 2.0 * objective.fitted.criteria.shapes.precision
    near = _neighbours(shape, effect.shape[0])
    if width := line_width(objective.evidence, effect):
        # Further away there are side lobes, which lead astray.
        around = effect.shape[0] - 2 * width, effect.shape[0] + 2 * width
        beyond = effect.shape[0] > max(shape.grid)
        near = around if beyond else (max(near[0], around[0]), min(near[1], around[1]))
        precision = min(precision, _OF_A_LINE * width / effect.shape[0])
    low, high = (shape.coordinate(x) for x in near)
    ends = shape.coordinate(shape.lower), shape.coordinate(shape.upper)
    tried = []
    while True:
        problem = objective.by_trial(np.array([low]), np.array([high]))
        found = search(problem, Bracket(precision)).best[0].found
        tried.append(found)
        at, reach = shape.coordinate(found.effect.shape[0]), high - low
        # A bracket only grows, so that the best is inside the next one.
        if at - low < _AT_END * precision and low > ends[0]:
            low = max(low - reach, ends[0])
        elif high - at < _AT_END * precision and high < ends[1]:
            high = min(high + reach, ends[1])
        else:
            return max(tried, key=lambda one: one.drop)


def reshaped(evidence: Evidence, others: EvidenceFit, whole: EvidenceFit, effect: Effect) -> Score:
    """Return an effect's score at the shape that fits best near its own.

    Parameters
    ----------
    others, whole : the model without the effect, and with it.
    effect : as it is in the model.
    """
    beside = Beside(evidence, whole).columns
    blank = Score(effect=effect, payload_recordings=None, not_identifiable=False)
    now = MomentObjective(evidence, others, blank, beside).score_at(effect)
    return refined(evidence, others, now, beside)


def best_shape(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> Effect:
    """Return an effect at the shape at which it explains most; as it is where it explains nothing.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the model without the effect.
    effect : with the shape that is tried first.
    """
    found = lines(evidence, fitted, effect)
    tried = [effect, *effect.variants(fitted.model.robot), *found]
    every = scores(fitted, tried, candidate_moments(evidence, fitted, tried), 1)
    best = max(every, key=lambda one: one.drop_at_point)
    return refined(evidence, fitted, best).effect if best.drop_at_point > 0 else effect


def _neighbours(shape, value: float) -> tuple[float, float]:
    grid = np.array(shape.grid)
    if len(grid) < 2:
        return shape.lower, shape.upper
    i = int(np.argmin(np.abs(grid - value)))
    # Beyond its ends the grid goes on as it is spaced.
    before, after = (
        shape.at(2 * shape.coordinate(end) - shape.coordinate(inner))
        for end, inner in ((grid[0], grid[1]), (grid[-1], grid[-2]))
    )
    low = grid[i - 1] if i > 0 else before
    high = grid[i + 1] if i + 1 < len(grid) else after
    return float(low), float(high)
