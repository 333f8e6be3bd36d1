"""The time in which a joint warms up, shorter than the first value of its grid."""

from __future__ import annotations

import numpy as np

from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
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
