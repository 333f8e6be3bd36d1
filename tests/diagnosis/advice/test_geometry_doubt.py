"""Where torque goes with another joint's motion and more remains, geometry may be at fault."""

from __future__ import annotations

import pytest

from dynident import diagnose as find
from dynident.diagnosis import Diagnosis
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

PLAIN = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def diagnosed(label: str, size: float, **changed: None) -> Diagnosis:
    full = PLAIN + label
    truth = true_values(full, **FRICTION)
    truth[full.slices[label]] = size
    made = (
        synthetic(full, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(2)
    )
    return find(PLAIN, Dataset(tuple(one.replace(**changed) for one in made)), propose="never")


def doubts(found: Diagnosis) -> list[str]:
    return [note for note in found.notes if "coupled_motors" in note]


@pytest.mark.slow
def test_a_coupling_without_a_noise_floor_may_be_geometry() -> None:
    found = diagnosed("joint_coupling@shoulder:elbow", 0.5, period=None)
    assert "joint_coupling" in {step.effect.name for step in found.steps}
    (note,) = doubts(found)
    assert "goes with" in note and "may differ from the robot" in note


@pytest.mark.slow
def test_a_coupling_that_explains_all_but_noise_is_one() -> None:
    found = diagnosed("joint_coupling@shoulder:elbow", 0.5)
    assert found.verdict == "explained" and not doubts(found)


@pytest.mark.slow
def test_without_evidence_nothing_is_said() -> None:
    assert not doubts(diagnosed("quadratic_drag@elbow", 0.5, period=None))
