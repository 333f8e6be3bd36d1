"""A test recording that is not as the training ones is named; one with another motion is not."""

from __future__ import annotations

import pytest

from dynident.diagnosis.nuisances.unlike_recordings import unlike_notes
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.recording import Dataset, Recording
from study_files import true_model
from synthetic import synthetic, true_values


def recorded(seed: int, load: float = 0.0, period: float | None = 8.0) -> Recording:
    model = true_model() + "payload"
    values = true_values(
        model,
        Fv__shoulder=2.0,
        Fv__elbow=1.0,
        Fc__elbow=1.5,
        **{"payload.mass": load, "payload.mx": 0.1 * load, "payload.Izz": 0.02 * load},
    )
    return synthetic(
        model,
        values,
        seed,
        rate_hz=100.0,
        position_std=1e-5,
        torque_std=0.05,
        payload=bool(load),
        period=period,
    )


def told(train: tuple[Recording, ...], test: tuple[Recording, ...]) -> tuple[str, ...]:
    evidence = Evidence(true_model(), gather(Dataset(train)))
    held = Evidence(true_model(), gather(Dataset(test)))
    return unlike_notes(evidence, held, fit_evidence(evidence, evidence.model))


@pytest.mark.parametrize("period", [8.0, None])
def test_a_load_in_one_test_recording_alone_is_no_residual_of_the_robot(
    period: float | None,
) -> None:
    train = tuple(recorded(seed, period=period) for seed in (0, 1))
    test = recorded(2, period=period), recorded(3, load=1.0, period=period)
    (note,) = told(train, test)
    assert "synthetic 3 (" in note and "synthetic 2 (" not in note
    assert "payload = true" in note


@pytest.mark.parametrize("period", [8.0, None])
def test_other_motions_of_the_same_robot_are_as_expected(period: float | None) -> None:
    train = tuple(recorded(seed, period=period) for seed in (0, 1))
    for seed in range(2, 8):
        assert told(train, (recorded(seed, period=period),)) == ()


@pytest.mark.parametrize("seconds", [2.2, 2.6, 3.0])
def test_what_a_short_recording_leaves_open_is_no_other_circumstance(seconds: float) -> None:
    """Its parameters are uncertain, and so is what they predict of another motion."""
    short = recorded(0, period=None).cut(0.0, seconds)
    assert told((short,), (recorded(1, period=None),)) == ()
