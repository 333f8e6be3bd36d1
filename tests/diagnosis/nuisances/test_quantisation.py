"""What the steps of an encoder leave is neither noise nor missing physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from brief_search import BRIEF
from dynident import diagnose as find
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import gather
from dynident.fitting.uncertainty.encoder_steps import mean_rounding, rounding_power
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

VALUES = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5}
STEP = 2e-4


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


def recordings(model: Model, step: float, torque_std: float, count: int) -> tuple[Recording, ...]:
    truth = true_values(model, **VALUES)
    smooth = (
        synthetic(model, truth, k, rate_hz=250.0, torque_std=torque_std) for k in range(count)
    )
    return tuple(one.replace(q=np.round(one.q / step) * step) if step else one for one in smooth)


def test_rounding_power_is_what_rounding_leaves(model: Model) -> None:
    runs = Dataset(recordings(model, STEP, 1e-3, 3))
    evidence = Evidence(model, gather(runs))
    fitted = fit_evidence(evidence, model)
    judged = on_recordings(evidence, fitted)
    assert judged.ratio is not None and judged.noise_std is not None
    left = judged.ratio * judged.noise_std
    assert (left > 3.0 * judged.noise_std).all(), "rounding is not to be seen"
    predicted = np.sqrt(rounding_power(model, fitted.values, runs))
    np.testing.assert_allclose(predicted, left, rtol=0.3)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.3, 0.7, 2.0])
@pytest.mark.slow
def test_rounding_in_the_mean_is_that_of_many_draws(noise: float) -> None:
    rng, steps = np.random.default_rng(5), np.array([1e-3, 0.0])
    q = np.column_stack([rng.uniform(-3e-3, 3e-3, 40), np.ones(40)])
    draws = q[:, 0] + noise * steps[0] * rng.standard_normal((200_000, 40))
    rounded = np.mean(np.round(draws / steps[0]) * steps[0] - draws, axis=0)
    found = mean_rounding(q, steps, np.array([noise * steps[0], 0.0]))
    np.testing.assert_allclose(found[:, 0], rounded, atol=6e-3 * steps[0])
    np.testing.assert_array_equal(found[:, 1], 0.0)


def test_steps_much_smaller_than_the_noise_leave_nothing_that_repeats(model: Model) -> None:
    """However few the rows: two draws of the noise would agree by chance."""
    truth = true_values(model, **VALUES)
    clean = synthetic(model, truth, 1, rate_hz=250.0)
    noisy = clean.q + 2e-5 * np.random.default_rng(1).standard_normal(clean.q.shape)
    runs = Dataset((replace(clean, q=np.round(noisy / 1e-5) * 1e-5),))
    fitted = fit_evidence(Evidence(model, gather(runs)), model)
    np.testing.assert_array_equal(rounding_power(model, fitted.values, runs), np.zeros(2))


def test_jumps_of_a_position_are_no_noise_that_could_repeat(model: Model) -> None:
    """As of an angle that is kept within a turn: what a filter takes off them is no noise."""
    one = recordings(model, STEP, 0.1, 1)[0]
    jumped = np.array(one.q)
    jumped[len(jumped) // 2 :, 0] += 5000 * STEP
    evidence = Evidence(model, gather(Dataset((one,))))
    fitted = fit_evidence(evidence, model)
    usual = rounding_power(model, fitted.values, Dataset((one,)))
    found = rounding_power(model, fitted.values, Dataset((replace(one, q=jumped),)))
    assert np.all(found <= 2.0 * usual)


def test_there_is_none_without_steps(model: Model) -> None:
    runs = Dataset(recordings(model, 0.0, 1e-3, 1))
    evidence = Evidence(model, gather(runs))
    values = fit_evidence(evidence, model).values
    np.testing.assert_array_equal(rounding_power(model, values, runs), np.zeros(2))


@pytest.mark.slow
def test_a_healthy_robot_with_a_coarse_encoder_lacks_nothing(model: Model) -> None:
    runs = recordings(model, STEP, 0.1, 2)
    found = find(model, Dataset(runs[:1]), Dataset(runs[1:]))
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    assert any("steps of the encoder at shoulder" in note for note in found.notes)


@pytest.mark.slow
def test_the_same_residual_without_steps_is_unexplained(model: Model) -> None:
    moved = tuple(off_the_lattice(one) for one in recordings(model, STEP, 0.1, 2))
    judged = find(model, Dataset(moved[:1]), Dataset(moved[1:]), most=0)
    assert judged.verdict == "unexplained"


@pytest.mark.slow
def test_a_search_takes_the_same_residual_without_steps_for_missing_physics(model: Model) -> None:
    moved = tuple(off_the_lattice(one) for one in recordings(model, STEP, 0.1, 2))
    train, test = Dataset(moved[:1]), Dataset(moved[1:])
    judged = find(model, train, test, propose="never", criteria=BRIEF)
    assert judged.verdict != "nothing_missing"


def off_the_lattice(recording: Recording) -> Recording:
    """The same positions moved off their lattice by far less than a step."""
    rng = np.random.default_rng(3)
    return replace(recording, q=recording.q + 1e-7 * rng.standard_normal(recording.q.shape))
