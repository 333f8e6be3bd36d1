"""What changes from repetition to repetition, and is measured as noise."""

from __future__ import annotations

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis.nuisances.drifting_noise import drift_notes, drifts_in
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.moments.repetition_drift import DriftSums
from dynident.recording import Dataset, Recording
from study_files import true_model
from synthetic import synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 1.0, "Fc__elbow": 1.5}


def recorded(seed: int, repetitions: int) -> Recording:
    return synthetic(
        true_model(),
        true_values(true_model(), **FRICTION),
        seed,
        duration=8.0 * repetitions,
        rate_hz=100.0,
        position_std=1e-5,
        torque_std=0.05,
    )


def drifts(*recordings: Recording):
    evidence = Evidence(true_model(), gather(Dataset(recordings)))
    return drifts_in(evidence, fit_evidence(evidence, evidence.model))


def with_torque(made: Recording, more: np.ndarray) -> Recording:
    """The recording with more torque (T,) at its elbow, N m."""
    return made.replace(tau=made.tau + np.outer(more, [0.0, 1.0]))


@pytest.mark.parametrize("repetitions", [2, 3, 8])
@pytest.mark.slow
def test_noise_alone_does_not_drift(repetitions: int) -> None:
    found = [drifts(*(recorded(2 * seed + k, repetitions) for k in (0, 1))) for seed in range(10)]
    assert found == [()] * 10


@pytest.mark.parametrize("colour_s", [0.05, 0.3])
def test_noise_that_forgets_itself_within_a_repetition_does_not_drift(colour_s: float) -> None:
    kept = np.exp(-0.01 / colour_s)
    for seed in range(6):
        made, rng = recorded(seed, 6), np.random.default_rng(seed)
        noise = np.zeros(len(made.t))
        for k in range(1, len(noise)):
            noise[k] = kept * noise[k - 1] + np.sqrt(1.0 - kept**2) * rng.normal()
        assert drifts(with_torque(made, 0.2 * noise)) == ()


@pytest.mark.parametrize("repetitions", [3, 6])
def test_what_rises_is_told_with_its_size(repetitions: int) -> None:
    """Friction that falls as the joint warms up: another sign at every reversal."""
    made = recorded(0, repetitions)
    speed = np.gradient(made.q[:, 1], made.t)
    part = made.t / made.t[-1] - 0.5
    (one,) = drifts(with_torque(made, 0.6 * part * np.tanh(speed / 0.05)))
    assert one.joint == "elbow"
    # Behind the low-pass a part of the 0.05 N m is left.
    assert one.steady < 0.05 < 0.08 < one.noise < 0.3
    (said,) = drift_notes([one])
    assert f"N m at elbow ({one.steady:.2g} without)" in said


def test_nothing_is_said_of_what_does_not_drift() -> None:
    assert drift_notes(()) == ()


def test_a_fit_says_so_first() -> None:
    made = recorded(0, 6)
    speed = np.gradient(made.q[:, 1], made.t)
    part = made.t / made.t[-1] - 0.5
    warming = with_torque(made, 0.6 * part * np.tanh(speed / 0.05))
    assert di.fit(true_model(), Dataset((made,))).headline == ""
    said = di.fit(true_model(), Dataset((warming, recorded(1, 6)))).headline
    assert said.startswith("Repetitions differ the more, the longer they lie apart")
    assert "N m at elbow (" in said and "shoulder" not in said


def test_two_repetitions_do_not_tell_noise_from_what_drifts() -> None:
    rng = np.random.default_rng(0)
    every = np.ones((50, 2), dtype=bool)
    assert DriftSums.of(rng.normal(size=(2, 50, 2)), every) is None


def test_rows_that_do_not_count_say_nothing() -> None:
    """Those in which something rises are left out, at one joint and not at the other."""
    rng = np.random.default_rng(0)
    folded, counting = rng.normal(size=(4, 400, 2)), np.ones((400, 2), dtype=bool)
    folded[:, :200] += 3.0 * np.arange(4)[:, None, None]
    counting[:200, 0] = False
    sums = DriftSums.of(folded, counting)
    assert sums is not None
    (one,) = (sums + sums).drifts(("a", "b"), ("N m", "N m"))
    assert one.joint == "b"
    assert one.steady == pytest.approx(1.0, abs=0.1)
