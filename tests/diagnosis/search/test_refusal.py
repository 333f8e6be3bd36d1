"""What no robot can have: no step makes it, and no model that has it is complete."""

from __future__ import annotations

from dynident import diagnose as find
from dynident.diagnosis import Diagnosis
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FULL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def diagnosed(**changed: float) -> Diagnosis:
    truth = true_values(FULL, **{**FRICTION, **changed})
    each = tuple(
        synthetic(FULL, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(3)
    )
    return find(FULL, Dataset(each[:2]), Dataset(each[2:]))


def test_a_model_without_residual_whose_friction_drives_a_joint_is_not_complete() -> None:
    found = diagnosed(Fv__elbow=-1.0, Fc__elbow=0.2)
    assert not found.steps and not found.wiring
    assert found.verdict == "unexplained"
    (clause,) = found.impossible
    assert clause.startswith("the friction at elbow (-0.2")
    assert "no robot can have what the fit says, the friction at elbow" in found.sentence
    assert found.to_dict()["impossible"] == [clause]
    assert found.detection_limits == ()


def test_the_same_model_of_a_robot_that_can_be_is_complete() -> None:
    """One negative coefficient is no fault where friction as a whole takes power."""
    found = diagnosed(Fv__elbow=-0.1, Fc__elbow=1.5)
    assert found.verdict == "nothing_missing" and found.impossible == ()
