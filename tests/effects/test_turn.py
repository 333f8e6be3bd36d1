"""Turns of a joint or of the base: exact where they can be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dynident.effects import effects_of
from dynident.effects.bodies.turn import turn_about
from dynident.robot import Robot

ANGLES = np.linspace(-1.0, 1.0, 201)
ROBOT = Robot.from_text("""<robot name="axis"><link name="base"/><link name="bob"><inertial>
  <origin xyz="0.1 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="50"/></joint></robot>""")


@pytest.mark.parametrize("axis", np.eye(3), ids="xyz")
def test_a_turn_about_a_coordinate_axis_leaves_it_where_it_is(axis: np.ndarray) -> None:
    for angle in ANGLES:
        np.testing.assert_array_equal(turn_about(axis, angle) @ axis, axis)


@pytest.mark.parametrize("length", [1e-6, 1.0, 30.0])
def test_a_turn_is_a_rotation_about_an_axis_of_any_length(length: float) -> None:
    axis = np.array([0.36, -0.48, 0.8])
    for angle in ANGLES:
        expected = Rotation.from_rotvec(angle * axis).as_matrix()
        np.testing.assert_allclose(turn_about(length * axis, angle), expected, atol=2e-15)


def test_another_zero_leaves_the_axis_of_the_joint_where_it_is() -> None:
    (zero,) = effects_of("joint_zero@hinge", ROBOT)
    for angle in ANGLES:
        (moved,) = zero.simulated_robot((float(angle),), ROBOT).joints
        np.testing.assert_array_equal(moved.R @ moved.axis, moved.axis)


def test_no_tilt_is_the_robot_as_it_stands() -> None:
    (tilt,) = effects_of("base_tilt", ROBOT)
    (joint,) = tilt.simulated_robot((0.0, 0.0), ROBOT).joints
    np.testing.assert_array_equal(joint.R, ROBOT.joints[0].R)
