"""Columns that depend on the time in the session, beside columns that repeat."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynident.diagnosis.search.ranking import rank
from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.diagnosis.search.scores.scoring import score
from dynident.effects import Effect, catalogue, effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.evidence.time_varying import steady, time_varying_variants
from dynident.model import Model
from dynident.recording import Dataset
from study_files import recording, true_model
from synthetic import synthetic, true_values


@cache
def fitted(seed: int) -> tuple[Evidence, EvidenceFit]:
    evidence = Evidence(true_model(), gather(Dataset((recording(seed),))))
    return evidence, fit_evidence(evidence, evidence.model)


def warmed(hidden: Effect) -> tuple[Evidence, EvidenceFit]:
    """Six repetitions in which the shoulder warms up, and the model without that."""
    model = true_model() + hidden
    known = {"Fv__shoulder": 1.2, "Fv__elbow": 1.0, "Fc__elbow": 1.5, "Fvt__shoulder": 0.8}
    made = synthetic(
        model,
        true_values(model, **known),
        duration=48.0,
        rate_hz=100.0,
        position_std=1e-5,
        torque_std=0.05,
    )
    evidence = Evidence(true_model(), gather(Dataset((made,))))
    return evidence, fit_evidence(evidence, evidence.model)


def at_shoulder(name: str, model: Model) -> Effect:
    effects = catalogue()[name].candidates(model.robot)
    return next(e.on(model.robot) for e in effects if e.label == f"{name}@shoulder")


@pytest.mark.parametrize("unknown", [(), (90, 91, 97, 150)])
def test_what_the_time_leaves_as_it_is_has_the_instrument_of_any_column(
    unknown: tuple[int, ...],
) -> None:
    """That of the next repetition, as viscous friction has it, under noise of any colour.

    Else a change that is far slower than the session would explain the difference of the two. Also
    after rows whose dry friction nothing tells.
    """
    evidence, found = fitted(0)
    assert len(found.noise[0].colour) > 1
    (run,) = evidence.runs
    uncertain = ~run.certain_rows
    uncertain[list(unknown), 0] = True
    evidence = evidence.with_runs((replace(run, uncertain=uncertain),))
    slow = at_shoulder("thermal_friction", evidence.model).shaped(1e5)
    columns = evidence.of(slow, 0, evidence.model, None)[0][:, 0]
    (stack,) = evidence.stacks
    white = stack.unfolded(stack.whitened([[[columns]]], 0, found.noise[0]))
    made = time_varying_variants(evidence, [slow], stack, 0, found.noise[0], ([[columns]], white))
    change = run.recording.duration / 1e5
    np.testing.assert_allclose(made.instruments, steady(white).instruments, rtol=2.0 * change)


@pytest.mark.parametrize("warm", [20.0, 60.0])
def test_changes_far_slower_than_the_session_are_one_ramp(warm: float) -> None:
    """Six repetitions in which viscous friction falls, which is noise to products of them all."""
    hidden = at_shoulder("thermal_friction", true_model()).shaped(warm)
    evidence, found = warmed(hidden)
    asked = at_shoulder("thermal_friction", evidence.model)
    shapes = [asked.shaped(T) for T in (warm, 300.0, 1000.0, 3000.0)]
    moments = candidate_moments(evidence, found, shapes)
    true, *slow = (score(found, e, *m, 1).drop for e, m in zip(shapes, moments, strict=True))
    assert true > 10.0 * np.log(found.rows)
    assert np.ptp(slow) < 0.02 * true
    assert max(slow) < 1.1 * true
    (best,) = rank(evidence, found, 0, only=(asked,)).passing
    assert warm / 5.0 < best.effect.shape[0] < 5.0 * warm
    # Beside it nothing is left, of the torque's own scale neither.
    wider = fit_evidence(evidence, found.model + hidden, found)
    value, sigma = (
        float(one[wider.model.slices[hidden.label]][0])
        for one in (wider.values, np.sqrt(np.diag(wider.covariance)))
    )
    assert abs(value - 0.8) < 4.0 * sigma < 0.2
    (gain,) = effects_of("drive_gain@shoulder", evidence.model.robot)
    ((beside, own),) = candidate_moments(evidence, wider, [gain])
    assert abs(score(wider, gain, beside, own, 1).drop) < 0.02 * true


@pytest.mark.slow
def test_friction_of_a_joint_that_warms_up_is_known_as_well_as_is_said() -> None:
    """Noise of encoders in the columns, times the whole torque, had been errors of many sigma."""
    hidden = at_shoulder("thermal_friction", true_model()).shaped(20.0)
    model = true_model() + hidden
    known = {"Fv__shoulder": 1.2, "Fv__elbow": 1.0, "Fc__elbow": 1.5, "Fvt__shoulder": 0.8}
    true, off = true_values(model, **known), []
    for seed in range(20):
        made = synthetic(
            model, true, seed, duration=16.0, rate_hz=100.0, position_std=1e-4, torque_std=0.05
        )
        evidence = Evidence(model, gather(Dataset((made,))))
        found = fit_evidence(evidence, model)
        off.append((found.values - true)[-2:] / np.sqrt(np.diag(found.covariance))[-2:])
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5


@pytest.mark.parametrize("seed", [0, 1001, 1017, 1041])
def test_a_torque_that_does_not_drift_is_not_said_to(seed: int) -> None:
    evidence, found = fitted(seed)
    ramp = at_shoulder("torque_drift", evidence.model)
    ((beside, own),) = candidate_moments(evidence, found, [ramp])
    one = score(found, ramp, beside, own, 1)
    # Two repetitions 8 s apart, of 375 rows of 0.02 N m: what the eye sees.
    assert abs(one.values[0]) < 1e-3
    assert one.p_value > 1e-3
