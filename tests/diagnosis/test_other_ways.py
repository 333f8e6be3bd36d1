"""What the first round takes for one effect may be two others: a residual that remains tells."""

from __future__ import annotations

import pytest

import dynident as di
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.extension import other_ways
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

SPRING, ROTOR, OFFSET = "joint_spring@elbow", "rotor_inertia@elbow", "torque_offset@elbow"


def found(stiffness: float, preload: float, rotor: float) -> Diagnosis:
    """What an elbow with a preloaded spring (N m/rad, N m) and a rotor (kg m^2) is said to lack."""
    given = di.Model(arm())
    for kind in ("viscous_friction", "coulomb_friction"):
        given = given + di.effects_of(kind, given.robot)
    true = given + SPRING + ROTOR
    values = true_values(true)
    values[true.slices[SPRING]] = stiffness, preload
    values[true.slices[ROTOR]] = rotor
    runs = [synthetic(true, values, seed, rate_hz=250.0, torque_std=0.02) for seed in range(3)]
    return di.diagnose(given, Dataset(tuple(runs[:2])), Dataset(tuple(runs[2:])), propose="never")


@pytest.mark.slow
@pytest.mark.parametrize(("stiffness", "preload", "rotor"), [(0.3, 0.3, 0.05), (0.2, 0.4, 0.05)])
def test_a_spring_and_a_rotor_are_found_though_an_offset_comes_first(
    stiffness: float, preload: float, rotor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = found(stiffness, preload, rotor)
    assert {step.effect.label for step in said.steps} == {SPRING, ROTOR}
    assert said.verdict == "explained"
    monkeypatch.setattr(other_ways, "_WAYS", 0)
    straight = found(stiffness, preload, rotor)
    assert straight.verdict == "unexplained"
    assert OFFSET in {step.effect.label for step in straight.steps}
