"""Widths that were found while an effect was missing do not stay when it is there."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.nuisances import friction_width
from dynident.diagnosis.nuisances.friction_width import (
    WidthProfile,
    at_best_widths,
    with_friction_width,
)
from dynident.diagnosis.nuisances.width_notes import found_widths
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.effects.friction.stribeck_friction import StribeckFriction
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from study_files import recording, true_model
from synthetic import synthetic, true_values

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
    (note,) = found_widths(evidence, kept).notes
    width = kept.model.friction_widths[1]
    assert f"friction_width = {{ shoulder = 0.01, elbow = {width:.2g} }}" in note


@pytest.mark.parametrize(("stated", "fits"), [(5 * STATED, 0), (1.02 * STATED, 1)])
def test_a_width_far_beyond_its_price_needs_no_fit_of_the_stated_one(
    stated: float, fits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The profile says the same as the fit does; where it is less clear, the fit is asked."""
    given = true_model().with_friction_width("elbow", stated)
    evidence = Evidence(given, gather(Dataset((recording(0), recording(2)))))
    own = fit_evidence(evidence, true_model())
    made: list[Model] = []

    def counted(evidence: Evidence, model: Model, near: EvidenceFit) -> EvidenceFit:
        made.append(model)
        return fit_evidence(evidence, model, near)

    monkeypatch.setattr(friction_width, "fit_evidence", counted)
    kept = friction_width._reconsidered(evidence, own)
    assert len(made) == fits
    drop = friction_width._drop(evidence, fit_evidence(evidence, given, own), own)
    assert (kept is own) == (drop > friction_width._price(own))


@pytest.mark.parametrize(("stated", "is_found"), [(0.014, False), (0.04, True)])
def test_where_nothing_repeats_a_width_is_taken_if_it_is_worth_its_price(
    stated: float, is_found: bool
) -> None:
    """Each fit whitened by its own residual misses the same, whatever its width."""
    truth = true_model() + "stribeck_friction@elbow"
    friction = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__elbow": 1.5, "Fs__elbow": 0.8}
    once = synthetic(
        truth,
        true_values(truth, **friction),
        8,
        rate_hz=100,
        period=None,
        position_std=1e-5,
        torque_std=0.1,
    )
    given = truth.with_friction_width("elbow", stated)
    evidence = Evidence(given, gather(Dataset((once,))))
    start = fit_evidence(evidence, given)
    found = with_friction_width(evidence, start)
    assert not start.noise_known
    assert (found.model.friction_widths[1] != stated) == is_found
    if is_found:
        assert found.model.friction_widths[1] == pytest.approx(STATED, rel=0.5)
        worth = start.error_signal - in_metric_of(evidence, found, start).error_signal
        assert worth > 2 * np.log(start.rows)


@pytest.mark.slow
def test_a_width_and_stribeck_friction_that_makes_up_for_it_are_told_apart() -> None:
    """With either held the other has its best value, and both are wrong."""
    stribeck = StribeckFriction("elbow").shaped(0.03)
    truth = true_model().with_friction_width("elbow", 0.004) + stribeck
    friction = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__elbow": 1.5, "Fs__elbow": 0.8}
    values = true_values(truth, **friction)
    runs = [
        synthetic(truth, values, seed, rate_hz=200, period=None, torque_std=0.02)
        for seed in (8, 9, 10)
    ]
    given = truth.with_friction_width("elbow", 0.01)
    evidence = Evidence(given, gather(Dataset(tuple(runs))))
    start = refitted(evidence, given)
    place = given.names.index("Fs@elbow")
    assert start.values[place] > 1.2 * 0.8
    found = with_friction_width(evidence, start)
    (speed,) = next(e.shape for e in found.model.effects if e.label == stribeck.label)
    assert found.model.friction_widths[1] == pytest.approx(0.004, rel=0.1)
    assert found.values[place] == pytest.approx(0.8, rel=0.1)
    assert speed == pytest.approx(0.03, rel=0.1)


def test_dithered_friction_may_be_as_wide_as_the_speeds_whatever_is_stated() -> None:
    """Far beyond the widths that are tried as a parameter of the joint."""
    truth = true_model().with_friction_width("elbow", 0.4)
    friction = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__elbow": 1.5}
    once = synthetic(
        truth, true_values(truth, **friction), 8, rate_hz=200, period=None, torque_std=0.01
    )
    evidence = Evidence(true_model(), gather(Dataset((once,))))
    start = fit_evidence(evidence, true_model())
    found = at_best_widths(evidence, start, {"elbow"})
    assert found.model.friction_widths[1] == pytest.approx(0.4, rel=0.35)
    assert found.model.friction_widths[0] == start.model.friction_widths[0]
    left = [on_recordings(evidence, one).residual_rms[1] for one in (found, start)]
    assert left[0] < 0.2 * left[1]
    assert at_best_widths(evidence, start, {"shoulder"}) is start  # no dry friction there
