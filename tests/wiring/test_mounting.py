"""A gravity that the study has wrong: told from columns, tilts and zeros, with its line."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import dynident as di
from chains import chain
from dynident.effects import effects_of
from dynident.recording import Dataset
from dynident.wiring import Fault, check_wiring
from synthetic import arm, synthetic, true_values
from wiring_faults import broken

STATED = (0.0, 0.0, -9.81)
WALL, CEILING, SLOPE = (0.0, -9.81, 0.0), (0.0, 0.0, 9.81), (-8.74, 0.0, -4.45)
FREE_FALL = (0.0, 0.0, 0.0)


def model(gravity: tuple[float, ...] = STATED, joints: int = 3) -> di.Model:
    robot = chain(joints, 1).with_gravity(gravity)
    names = ("viscous_friction", "coulomb_friction")
    return di.Model(robot, tuple(e for name in names for e in effects_of(name, robot)))


@cache
def data(gravity: tuple[float, ...], joints: int = 3) -> Dataset:
    """Of a robot under a gravity, and told nothing of it."""
    true = model(gravity, joints)
    friction = {f"F{of}__{name}": 0.3 for name in true.robot.names for of in "vc"}
    values = true_values(true, **friction)
    return Dataset(
        tuple(synthetic(true, values, seed, rate_hz=250.0, torque_std=0.05) for seed in (0, 1))
    )


def stated(found: tuple[Fault, ...]) -> np.ndarray:
    """The gravity that a study is to state."""
    (fault,) = found
    assert fault.kind == "gravity" and fault.joints == ()
    (line,) = fault.mend
    key, _, numbers = line.partition(" = ")
    assert key == "gravity"
    return np.array([float(x) for x in numbers.strip("[]").split(",")])


@pytest.mark.parametrize("gravity", [WALL, CEILING, FREE_FALL])
@pytest.mark.parametrize("joints", [3, 5])
@pytest.mark.slow
def test_a_gravity_along_an_axis_or_none_is_named_exactly(
    gravity: tuple[float, ...], joints: int
) -> None:
    found = check_wiring(model(STATED, joints), data(gravity, joints))
    np.testing.assert_array_equal(stated(found), gravity)


def test_another_gravity_is_named_to_half_a_degree() -> None:
    found = check_wiring(model(), data(SLOPE))
    off = np.linalg.norm(stated(found) - SLOPE) / 9.81
    assert off < np.deg2rad(0.5)
    assert "about" in found[0].what


def test_what_the_study_states_is_no_fault_whatever_it_is() -> None:
    for gravity in (STATED, WALL, SLOPE, FREE_FALL):
        assert check_wiring(model(gravity), data(gravity)) == ()


def test_a_tilted_base_is_a_physical_effect() -> None:
    tilt = np.deg2rad(15.0)
    tilted = (9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt))
    assert check_wiring(model(), data(tilted)) == ()


@pytest.mark.slow
def test_a_wrong_sign_beside_it_is_named_too() -> None:
    def change(one: di.Recording) -> di.Recording:
        return one.replace(tau=one.tau * np.array([1.0, -1.0, 1.0]))

    found = check_wiring(model(), broken(data(WALL), change))
    assert [fault.kind for fault in found] == ["gravity", "torque_sign"]
    assert found[1].joints == (model().robot.names[1],)


def turntable(gravity: tuple[float, ...]) -> di.Model:
    """A load beside a vertical axis."""
    text = (
        '<robot name="turntable"><link name="base"/><link name="table"><inertial>'
        '<mass value="20"/><origin xyz="0.2 0.05 0"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="turn" type="revolute"><axis xyz="0 0 1"/><parent link="base"/>'
        '<child link="table"/><limit lower="-3" upper="3" velocity="9" effort="99"/></joint>'
        "</robot>"
    )
    robot = di.Robot.from_text(text).with_gravity(gravity)
    return di.Model(robot) + "viscous_friction"


@pytest.mark.parametrize("degrees", [5.0, 10.0, 20.0])
def test_of_a_vertical_axis_a_small_tilt_is_no_other_mounting(degrees: float) -> None:
    """Lying on its side would do as well, with a lighter table."""
    tilt = np.deg2rad(degrees)
    true = turntable((9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt)))
    recording = synthetic(true, true_values(true, Fv__turn=1.0), 0, torque_std=0.05)
    assert check_wiring(turntable(STATED), Dataset((recording,))) == ()


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_balancing_springs_of_a_planar_arm_are_no_other_mounting(share: float) -> None:
    """They make smaller what gravity does, as turning it out of the plane would."""
    heavy = di.Model(arm()) + "viscous_friction"
    light = replace(heavy, robot=arm().with_gravity((0.0, 0.0, -9.81 * (1.0 - share))))
    recording = synthetic(light, true_values(light), 0, torque_std=0.05)
    assert check_wiring(heavy, Dataset((recording,))) == ()


def test_a_planar_arm_without_gravity_is_not_said_to_lie_on_its_side() -> None:
    heavy = di.Model(arm()) + "viscous_friction"
    free = replace(heavy, robot=arm().with_gravity(FREE_FALL))
    recording = synthetic(free, true_values(free), 0, torque_std=0.05)
    found = check_wiring(heavy, Dataset((recording,)))
    np.testing.assert_array_equal(stated(found), FREE_FALL)
    assert "balanced" in found[0].what


@pytest.mark.parametrize("joints", [["shoulder", "elbow"], ["elbow", "shoulder"]])
def test_a_planar_arm_may_have_its_first_zero_elsewhere(joints: list[str]) -> None:
    """Both joints turn about y: gravity along -x is a quarter turn of the first."""
    robot = di.Robot.from_text(arm().description.text, joints=joints)  # type: ignore[union-attr]
    upright = di.Model(robot) + "viscous_friction"
    on_its_side = replace(upright, robot=robot.with_gravity((-9.81, 0.0, 0.0)))
    recording = synthetic(on_its_side, true_values(on_its_side), 0, torque_std=0.05)
    (fault,) = check_wiring(upright, Dataset((recording,)))
    assert fault.kind == "gravity"
    assert "a zero of q.shoulder that is off by 90 deg is alike" in fault.evidence
