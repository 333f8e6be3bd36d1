"""A noise that was stated from a standstill is told from one of a moving robot."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.nuisances.stated_noise import stated_noise_notes
from dynident.evidence.held_out import HeldOut
from dynident.model import Model
from dynident.recording import Dataset, Noise
from synthetic import arm, synthetic, true_values

MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
UNITS = MODEL.robot.torque_units


def noted(stated: tuple[float, float], ratio: tuple[float, float]) -> tuple[str, ...]:
    """Notes on a recording whose torques carry noise of 0.3 N m."""
    made = synthetic(MODEL, true_values(MODEL, **FRICTION), 0, rate_hz=250.0, torque_std=0.3)
    data = Dataset((made,), noise=Noise(np.full(2, 1e-5), np.array(stated)))
    found = np.array(ratio)
    judged = HeldOut(
        runs=(), noise_std=np.ones(2), ratio=found, least_ratio=found, inflation=np.ones(2)
    )
    return stated_noise_notes(judged, data, UNITS, 1.0)


def test_a_noise_far_below_that_in_motion_is_named_with_both() -> None:
    (note,) = noted((0.001, 0.3), (700.0, 5.0))
    assert "0.001 N m at shoulder, where 0.3" in note or "0.001 N m at shoulder, where 0.2" in note
    assert "elbow" not in note and "no floor of a moving robot" in note


@pytest.mark.parametrize("stated", [(0.3, 0.3), (0.25, 0.35)])
def test_of_a_noise_as_it_is_seen_nothing_is_said_but_when_it_would_be_no_floor(
    stated: tuple[float, float],
) -> None:
    (note,) = noted(stated, (700.0, 5.0))
    assert note.startswith("If the stated noise was measured at a standstill")


def test_a_model_that_leaves_nothing_asks_for_no_reason() -> None:
    assert noted((0.001, 0.001), (0.5, 0.5)) == ()
