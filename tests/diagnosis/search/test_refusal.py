"""What no robot can have: no step makes it, and no model that has it is complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from brief_search import BRIEF
from dynident import diagnose as find
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.extension import extending
from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.refusal import newly_impossible
from dynident.diagnosis.search.scores.score import Score, impossible
from dynident.diagnosis.search.selection import breaks_its_promise
from dynident.effects import effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FULL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def recordings(true: Model, changed: dict[str, float], many: int) -> Dataset:
    truth = true_values(true, **{**FRICTION, **changed})
    made = (
        synthetic(true, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(many)
    )
    return Dataset(tuple(made))


def diagnosed(true: Model = FULL, **changed: float) -> Diagnosis:
    each = recordings(true, changed, 3).recordings
    return find(FULL, Dataset(each[:2]), Dataset(each[2:]), criteria=BRIEF)


@pytest.mark.slow
def test_a_model_without_residual_whose_friction_drives_a_joint_is_not_complete() -> None:
    found = diagnosed(Fv__elbow=-1.0, Fc__elbow=0.2)
    assert not found.steps and not found.wiring
    assert found.verdict == "unexplained"
    (clause,) = found.impossible
    assert clause.startswith("the friction at elbow (-0.2")
    assert "no robot can have what the fit says, the friction at elbow" in found.sentence
    assert found.to_dict()["impossible"] == [clause]
    assert found.detection_limits == ()


@pytest.mark.slow
def test_the_same_model_of_a_robot_that_can_be_is_complete() -> None:
    """One negative coefficient is no fault where friction as a whole takes power."""
    found = diagnosed(Fv__elbow=-0.1, Fc__elbow=1.5)
    assert found.verdict == "nothing_missing" and found.impossible == ()


def test_what_was_impossible_already_is_no_fault_of_the_effect_that_makes_it_certain() -> None:
    """An inertia of -3 kg m^2 in doubt, then beyond doubt; and two that the effect has made."""
    model = FULL + "rotor_inertia@elbow"
    evidence = Evidence(model, gather(recordings(FULL, {}, 1)))
    fitted = fit_evidence(evidence, model)

    def at(rotor: float, sigma: float) -> EvidenceFit:
        values, at = fitted.values.copy(), model.names.index("Ia@elbow")
        values[at] = rotor
        covariance = 1e-8 * np.eye(len(values))
        covariance[at, at] = sigma**2
        return replace(fitted, values=values, covariance=covariance)

    certain = at(-3.0, 0.1)
    assert newly_impossible(evidence, at(-3.0, 1.5), certain) == ""
    for possible in (at(0.0, 1.5), at(-0.5, 0.1)):
        assert "inertia at elbow" in newly_impossible(evidence, possible, certain)


@pytest.mark.slow
def test_after_an_effect_that_breaks_its_promise_the_next_best_is_tried(monkeypatch) -> None:
    def broken(fitted, wider, one) -> str:
        return "keeps no promise" if one.effect.name == "quadratic_drag" else ""

    monkeypatch.setattr(extending, "breaks_its_promise", broken)
    true = FULL + "quadratic_drag@shoulder" + "torque_offset@elbow"
    found = diagnosed(true, Fq__shoulder=0.8, offset__elbow=0.4)
    assert "torque_offset@elbow" in [one.effect.label for one in found.steps]
    assert not [one for one in found.steps if one.effect.name == "quadratic_drag"]
    (drag,) = (c for c in found.candidates if c.effect.label == "quadratic_drag@shoulder")
    assert drag.status == "not_material" and drag.remark == "keeps no promise"


def test_a_promise_is_broken_by_what_is_fitted_not_by_what_it_was_scored() -> None:
    """Of a filtered dynamic regressor: fitted as if it had no part, it explains nothing."""
    evidence = Evidence(FULL, gather(recordings(FULL, {}, 2)))
    fitted = fit_evidence(evidence, FULL)
    (one,) = rank(evidence, fitted, 0, only=effects_of("joint_elasticity@elbow", FULL.robot)).scores
    promising = replace(one, drop=0.5 * fitted.error_signal)
    assert "explains 0.0 % of the residual" in breaks_its_promise(fitted, fitted, promising)
    assert "promise 50.0 %" in breaks_its_promise(fitted, fitted, promising)
    assert breaks_its_promise(fitted, fitted, replace(one, drop=0.0)) == ""


def test_friction_that_no_torque_has_overcome_is_impossible() -> None:
    """The foot of a narrow law fits with any level: the joint would not have moved with it."""
    (law,) = effects_of("stribeck_friction@elbow", FULL.robot)
    model = FULL + law.shaped(0.01)
    evidence = Evidence(FULL, gather(recordings(model, {"Fs__elbow": 0.6}, 1)))
    fitted, wider = fit_evidence(evidence, FULL), fit_evidence(evidence, model)
    peak = float(fitted.torque_peaks[1])
    assert 2.0 < peak < 20.0
    blank = Score(effect=law, payload_recordings=None, not_identifiable=False)
    assert not impossible(replace(blank, values=(0.9 * peak,), sigma=(0.1,)), fitted)
    assert not impossible(replace(blank, values=(1.1 * peak,), sigma=(peak,)), fitted)
    beyond = impossible(replace(blank, values=(3.0 * peak,), sigma=(0.1,)), fitted)
    assert beyond.startswith("would need Fs = ") and "elbow, where drive and bodies make" in beyond
    assert not newly_impossible(evidence, fitted, wider)
    values = np.array(wider.values)
    values[model.slices[law.label]] = 3.0 * peak
    assert "elbow, where drive and bodies make" in newly_impossible(
        evidence, fitted, replace(wider, values=values)
    )
