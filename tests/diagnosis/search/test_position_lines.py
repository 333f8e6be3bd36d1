"""Cogging of a linear axis between the values of its grid, and how sharply its place is said."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.shapes.position_lines import line_width, lines, shapes_tried
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from slides import at, gantry, recorded

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


def test_every_line_that_can_be_told_apart_counts_as_tried() -> None:
    evidence = Evidence(gantry(), gather(recorded()))
    fitted = fit_evidence(evidence, gantry())
    width = line_width(evidence, RIPPLE)
    assert width is not None and width < 3.0
    assert shapes_tried(evidence, RIPPLE) == pytest.approx(2970 / width, abs=1)
    assert rank(evidence, fitted, 0, only=(RIPPLE,)).tests == shapes_tried(evidence, RIPPLE)
    drift = at("torque_drift@y")
    assert shapes_tried(evidence, drift) == 1 and lines(evidence, fitted, drift) == ()
