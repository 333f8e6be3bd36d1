"""A study that says that a joint has play, which has none."""

from __future__ import annotations

import pytest

from dynident.diagnosis import diagnose
from dynident.effects import effects_of
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values


@pytest.mark.slow
def test_a_gap_that_is_not_there_is_no_crash() -> None:
    """A study may say that a joint has one: its response is then taken at a gap that has closed."""
    given = Model(arm())
    for kind in ("viscous_friction", "coulomb_friction"):
        given = given + effects_of(kind, given.robot)
    run = synthetic(given, true_values(given, Fv__elbow=0.5), rate_hz=250.0, torque_std=0.05)
    said = diagnose(given + "backlash@elbow", Dataset((run,)), propose="never", most=0)
    assert said.verdict == "nothing_missing"
