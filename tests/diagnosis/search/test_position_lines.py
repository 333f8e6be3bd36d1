"""Cogging of a linear axis between the values of its grid, and how sharply its place is said."""

from __future__ import annotations

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.shapes.residual_lines import line_width, lines, shapes_tried
from dynident.effects import effects_of
from dynident.effects.position_lines import PositionLines
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from slides import at, gantry, recorded
from synthetic import arm, synthetic, true_values

RIPPLE = at("torque_ripple@y")


@pytest.mark.parametrize("k", [95.0, 104.7, 1234.5])
def test_a_line_between_two_of_the_grid_is_found_over_a_long_travel(k: float) -> None:
    evidence = Evidence(gantry(), gather(recorded(at("torque_ripple@y", k), (3.0, 1.5))))
    fitted = fit_evidence(evidence, gantry())
    found = rank(evidence, fitted, 0, only=(RIPPLE,))
    assert found.refusals == ("",)
    # Noise tells the place of this line to some 0.01 rad/m.
    assert found.scores[0].effect.shape[0] == pytest.approx(k, abs=0.05)
    np.testing.assert_allclose(found.scores[0].values, (3.0, 1.5), atol=0.2)


def turned(k: float) -> tuple[Model, Dataset]:
    """An elbow whose gear's fast side comes round k / 2 times a turn, moved slowly, twice."""
    model = Model(arm()) + "viscous_friction"
    hidden = next(e for e in effects_of("torque_ripple@elbow", model.robot)).shaped(k)
    known = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "As__elbow": 0.2, "Ac__elbow": 0.1}
    made = synthetic(
        model + hidden,
        true_values(model + hidden, **known),
        duration=80.0,
        period=40.0,
        rate_hz=200.0,
        torque_std=0.05,
    )
    return model, Dataset((made,))


@pytest.mark.parametrize("k", [20.0, 100.0, 200.0, 321.0])
@pytest.mark.slow
def test_a_line_of_a_gears_fast_side_is_found_and_fitted(k: float) -> None:
    """Beyond the grid of what comes some dozens of times in a turn."""
    model, recordings = turned(k)
    evidence = Evidence(model, gather(recordings))
    (asked,) = effects_of("torque_ripple@elbow", model.robot)
    found = rank(evidence, fit_evidence(evidence, model), 0, only=(asked,))
    assert found.refusals == ("",)
    assert found.scores[0].effect.shape[0] == pytest.approx(k, abs=0.05)
    estimate = di.fit(model + "torque_ripple@elbow", recordings)
    (shape,) = estimate.shapes
    assert shape.value == pytest.approx(k, abs=0.05)
    assert estimate.value("As@elbow") == pytest.approx(0.2, abs=0.01)
    assert estimate.value("Ac@elbow") == pytest.approx(0.1, abs=0.02)


def test_lines_that_move_too_fast_to_be_seen_are_not_looked_for() -> None:
    """At 2 rad/s a hundred waves a turn are 32 Hz, where rows of 50 Hz show 25."""
    (asked,) = effects_of("torque_ripple@elbow", arm())
    t = np.arange(0.0, 8.0, 0.02)
    q = np.abs((2.0 * t) % 4.0 - 2.0)
    found = PositionLines.of(asked, arm(), (q, np.full(len(t), 2.0)), 50.0)
    assert found is not None and 60.0 <= found.high < 80.0
    assert found.tried < 80
    assert PositionLines.of(asked, arm(), (np.zeros(9), np.zeros(9)), 50.0) is None


def test_every_line_that_can_be_told_apart_counts_as_tried() -> None:
    evidence = Evidence(gantry(), gather(recorded()))
    fitted = fit_evidence(evidence, gantry())
    width = line_width(evidence, RIPPLE)
    assert width is not None and width < 3.0
    assert shapes_tried(evidence, RIPPLE) == pytest.approx(2970 / width, abs=1)
    assert rank(evidence, fitted, 0, only=(RIPPLE,)).tests == shapes_tried(evidence, RIPPLE)
    drift = at("torque_drift@y")
    assert shapes_tried(evidence, drift) == 1 and lines(evidence, fitted, drift) == ()
