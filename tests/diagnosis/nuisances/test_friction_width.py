"""Widths that were found while an effect was missing do not stay when it is there."""

from __future__ import annotations

import pytest

from dynident.diagnosis.nuisances.friction_width import WidthProfile, with_friction_width
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.recording import Dataset
from study_files import recording, true_model

STATED = 0.01
"""rad/s, in the recordings and in the model alike."""


@pytest.mark.parametrize("found", [0.005, 0.02])
def test_a_width_that_the_whole_model_does_not_need_goes_back_to_the_stated(found: float) -> None:
    evidence = Evidence(true_model(), gather(Dataset((recording(0),))))
    other = fit_evidence(evidence, evidence.model.with_friction_width("elbow", found))
    assert with_friction_width(evidence, other).model.friction_widths[1] == STATED


def test_a_width_that_the_data_call_for_stays_and_its_interval_holds_it() -> None:
    """The recordings' width is five times below what the study says."""
    given = true_model().with_friction_width("elbow", 5 * STATED)
    evidence = Evidence(given, gather(Dataset(tuple(recording(seed) for seed in (0, 2)))))
    near = fit_evidence(evidence, given.with_friction_width("elbow", 2 * STATED))
    kept = with_friction_width(evidence, near)
    assert kept.model.friction_widths[1] == pytest.approx(STATED, rel=0.5)
    low, high = WidthProfile(evidence, kept, "elbow").interval()
    assert low <= kept.model.friction_widths[1] <= high
    assert low <= STATED <= high
