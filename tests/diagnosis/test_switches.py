"""Effects switched on and off: every choice is a fit of its own, judged on the same data."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from dynident import diagnose
from dynident.criteria import DEFAULTS
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.recorded_units import in_recorded_units
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import gather
from dynident.fitting.drive_gains import GainProblem, fit_drive_gains
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

HIDDEN = ("joint_spring@shoulder", "torque_offset@elbow")
VALUES = {"k__shoulder": 1.5, "c__shoulder": -0.3, "offset__elbow": 0.6}


def recordings(seeds) -> Dataset:
    # No dry friction: no rows are left out, and a direct fit is of the same rows.
    full = Model(arm()) + "viscous_friction"
    for name in HIDDEN:
        full = full + name
    truth = true_values(full, Fv__shoulder=1.2, Fv__elbow=0.5, **VALUES)
    return Dataset(
        tuple(
            synthetic(full, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.1)
            for seed in seeds
        )
    )


@pytest.fixture(scope="module")
def given() -> Model:
    return Model(arm()) + "viscous_friction"


@pytest.fixture(scope="module")
def found(given) -> Diagnosis:
    return diagnose(given, recordings(range(3)), recordings([3]), switches="all")


@pytest.mark.slow
def test_the_ends_are_the_model_as_given_and_the_final_one(found):
    assert {step.effect.label for step in found.steps} == set(HIDDEN)
    assert found.switches is not None
    first, *_, last = found.switches.choices
    assert first.error == found.test_error.before and last.error == found.test_error.after
    for j, joint in enumerate(found.joints):
        assert first.joint_errors[j] == joint.error_before
        assert last.joint_errors[j] == joint.error_after
    assert [one.on for one in found.switches.choices] == list(product((False, True), repeat=2))


@pytest.mark.slow
def test_every_choice_is_the_fit_of_that_model(found, given):
    evidence = Evidence(given, gather(recordings(range(3)), DEFAULTS.noise), criteria=DEFAULTS)
    held = Evidence(given, gather(recordings([3]), DEFAULTS.noise), criteria=DEFAULTS)
    start = fit_evidence(evidence, given, fit_evidence(evidence, given))  # its noise settled
    for choice in found.switches.choices[1:]:
        model = given
        for effects, on in zip(found.switches.effects, choice.on, strict=True):
            model = model + effects if on else model
        direct = on_recordings(held, fit_evidence(evidence, model, start))
        if sum(choice.on) == 1:  # of all of them, the search has settled the noise once more
            assert choice.error == pytest.approx(direct.error, rel=1e-9)
            assert choice.joint_errors == pytest.approx(direct.joint_errors, rel=1e-9)
            kept = np.isin(direct.runs[0].t, found.switches.t)
            assert choice.predicted == pytest.approx(direct.runs[0].predicted[kept], rel=1e-9)


def test_either_effect_alone_leaves_the_other_one_at_its_joint(found):
    choices = {one.on: one for one in found.switches.choices}
    names = [effects[0].joint for effects in found.switches.effects]
    robot = [joint.name for joint in found.joints]
    for k, name in enumerate(names):
        on = tuple(i == k for i in range(2))
        here, other = robot.index(name), robot.index(names[1 - k])
        alone = choices[on].joint_errors
        given, both = choices[False, False].joint_errors, choices[True, True].joint_errors
        assert alone[here] < 0.5 * given[here]
        assert alone[other] > 2.0 * both[other]


@pytest.mark.slow
def test_nothing_is_fitted_unasked(given):
    # Most of the time of a diagnosis that leaves much goes into what that depends on.
    whole = given + HIDDEN[0] + HIDDEN[1]
    assert diagnose(whole, recordings([0]), most=0).switches is None
    assert diagnose(whole, recordings([0]), most=0, switches="all").switches is None


def test_torques_are_in_the_unit_of_the_drives(found, given):
    gains = np.array([20.0, -4.0])
    data = recordings([0])
    amperes = Dataset((data.recordings[0].replace(tau=data.recordings[0].tau / gains),))
    known = dict(zip(arm().names, gains, strict=True))
    drives = replace(fit_drive_gains(GainProblem(given, amperes, known)), unit="A")
    shown = in_recorded_units(found, drives).switches
    assert shown is not None
    assert shown.measured * gains == pytest.approx(found.switches.measured)
    for before, after in zip(found.switches.choices, shown.choices, strict=True):
        assert after.predicted * gains == pytest.approx(before.predicted)
        assert after.error == before.error
