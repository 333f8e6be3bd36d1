"""The time in which a joint warms up, shorter than the first value of its grid."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search import candidate_shapes, ranking
from dynident.diagnosis.search.moment_objective import ScoreTrial
from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.fitting.shape_search import ShapeProblem
from dynident.fitting.uncertainty.shape_slopes import ShapeSlope
from slides import at, gantry, recorded

TRUE = 5.0


def test_it_is_sought_below_its_grid_and_known_as_well_as_is_said() -> None:
    hidden = at("thermal_friction@x", TRUE)
    evidence = Evidence(gantry(), gather(recorded(hidden, (0.0, 6.0), (2, 3))))
    (best,) = rank(
        evidence, fit_evidence(evidence, gantry()), 0, only=(at("thermal_friction@x"),)
    ).scores
    assert 3.5 < best.effect.shape[0] < 7.0
    found = refitted(evidence, gantry() + best.effect)
    (effect,) = (one for one in found.model.effects if one.shape)
    values = found.values[found.model.slices[effect.label]]
    slope = ShapeSlope(effect.joint, of=effect, values=tuple(values))
    wider = fit_evidence(evidence, found.model + slope, found)
    (at_slope,) = range(*wider.model.slices[slope.label].indices(wider.model.size))
    sigma = float(np.sqrt(wider.covariance[at_slope, at_slope]))
    assert 0 < sigma < 0.1
    assert abs(np.log(effect.shape[0] / TRUE)) < 3.0 * sigma
    assert abs(wider.values[at_slope]) < 0.2 * sigma  # sigma is that of this estimate


@pytest.mark.parametrize("off", [-0.3, -0.003, -0.001, 0.0, 0.001, 0.0039, 0.3])
def test_a_bracket_ends_wherever_the_best_lies_beside_its_end(
    off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bracket that went on from its end would find the best at the other one, and turn back."""
    monkeypatch.setattr(candidate_shapes, "line_width", lambda *_: None)
    effect, robot = at("thermal_friction@x", 30.0), gantry().robot
    (shape,) = effect.shape_parameters(robot)
    low, _ = candidate_shapes._neighbours(shape, 30.0)
    best, asked = shape.coordinate(low) + off, []

    def by_trial(lower: np.ndarray, upper: np.ndarray) -> ShapeProblem:
        asked.append((lower[0], upper[0]))
        assert len(asked) < 20

        def trial(x: np.ndarray) -> ScoreTrial:
            drop = -float((x[0] - best) ** 2)
            score: Any = SimpleNamespace(effect=effect.shaped(shape.at(x[0])), drop=drop)
            return ScoreTrial(found=score, loss=-drop)

        def evaluate(points: Sequence[np.ndarray]) -> list[ScoreTrial]:
            return [trial(x) for x in points]

        start = np.array([shape.coordinate(30.0)])
        return ShapeProblem(lower=lower, upper=upper, start=start, evaluate=evaluate)

    objective: Any = SimpleNamespace(
        one=SimpleNamespace(effect=effect),
        fitted=SimpleNamespace(criteria=DEFAULTS, model=gantry()),
        evidence=None,
        by_trial=by_trial,
    )
    found = candidate_shapes._by_bracket(objective, shape)
    assert abs(shape.coordinate(found.effect.shape[0]) - best) < 0.01


@pytest.mark.parametrize(("untold", "chosen"), [(4.0, 30.0), (0.0, 3000.0)])
def test_of_changes_in_time_that_explain_as_much_the_least_is_taken(
    untold: float, chosen: float
) -> None:
    """A session that is short beside all of them shows one and the same ramp."""
    drops = {10.0: 5.0, 30.0: 9.0, 100.0: 9.5, 3000.0: 10.0}
    tried: Any = [
        SimpleNamespace(
            effect=at("thermal_friction@x").shaped(shape), penalised=drop, values=(shape / 10.0,)
        )
        for shape, drop in drops.items()
    ]
    assert ranking._best_of(tried, untold).effect.shape == (chosen,)
