"""Which effects a diagnosis asks for, beside those that a model has."""

from __future__ import annotations

from pathlib import Path

from dynident.diagnosis.search.ranking import candidates
from dynident.model import Model
from dynident.robot import Robot
from synthetic import arm

HEAD = Path(__file__).resolve().parents[3] / "problems" / "vision_head" / "robot.urdf"


def asked(model: Model, name: str) -> set[str]:
    return {one.label for one in candidates(model) if one.name == name}


def test_each_place_without_the_effect_is_asked_for() -> None:
    model = Model(arm()) + "viscous_friction@shoulder"
    assert asked(model, "viscous_friction") == {"viscous_friction@elbow"}


def test_a_delay_common_to_all_joints_and_those_of_all_but_one_leave_nothing_to_ask() -> None:
    plain = Model(arm())
    every = {"torque_delay", "torque_delay@shoulder", "torque_delay@elbow"}
    assert asked(plain, "torque_delay") == every
    for label in every:
        assert asked(plain + label, "torque_delay") == every - {label}
        for other in every - {label}:
            assert asked(plain + label + other, "torque_delay") == set()


def test_an_unbalance_is_asked_for_beside_a_tilt_at_vertical_axes_alone() -> None:
    head = Model(Robot.from_file(HEAD))
    assert asked(head, "unbalance") == asked(Model(arm()) + "base_tilt", "unbalance") == set()
    upright = [one.name for one in head.robot.joints if one.parent == -1]
    assert asked(head + "base_tilt", "unbalance") == {f"unbalance@{one}" for one in upright}


def test_a_joint_with_a_gap_is_asked_for_no_elasticity() -> None:
    gap = Model(arm()) + "backlash@shoulder"
    assert asked(gap, "joint_elasticity") == {"joint_elasticity@elbow"}
    spring = Model(arm()) + "joint_elasticity@shoulder"
    assert asked(spring, "backlash") == {"backlash@shoulder", "backlash@elbow"}
