"""Writing a robot: a patched copy whose reload behaves the same."""

import numpy as np
import pytest
from random_trees import mjcf, random_tree, sdf, urdf

from dynident.errors import FileError, RobotError
from dynident.robot import Robot, structural_base
from dynident.robot.patching import patched, write

WRITERS = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}

ARM = """<?xml version="1.0"?>
<!-- an arm, by hand -->
<robot name="arm" xmlns:x="y">
  <link name="base"/>
  <link name="upper">
    <visual><geometry><mesh filename="package://nowhere/upper.stl"/></geometry></visual>
    <inertial>  <!-- measured -->
      <mass   value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="lower" />
  <link name="tool"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="f" type="fixed"><parent link="lower"/><child link="tool"/>
    <origin xyz="0 0 0.25" rpy="0.3 0 0"/></joint>
  <gazebo reference="a > b"/>
</robot>
"""


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_reload_gives_the_same_inverse_dynamics(writer, seed, tmp_path):
    robot = Robot.from_text(writer(random_tree(seed, moving=4)))
    rng = np.random.default_rng(seed)
    changed = robot.with_theta(robot.theta + 0.05 * rng.normal(size=10 * robot.n))
    path = write(changed, tmp_path / "out.xml")
    reloaded = Robot.from_file(path, joints=robot.names)
    motion = robot.random_motion(1, 20)
    want = changed.inverse_dynamics(*motion)
    got = reloaded.inverse_dynamics(*motion)
    assert np.max(np.abs(got - want)) < 1e-10 * np.max(np.abs(want))
    assert np.max(np.abs(want - robot.inverse_dynamics(*motion))) > 1e-3


def test_unchanged_is_byte_for_byte_the_same():
    for text in (ARM, ARM.replace("\n", "\r\n")):
        assert patched(Robot.from_text(text)) == text
    robot = Robot.from_text(ARM)
    assert patched(robot.with_theta(robot.theta)) == ARM


def test_only_the_changed_inertial_elements_are_touched():
    robot = Robot.from_text(ARM)
    theta = np.array(robot.theta)
    theta[10:] += [0.5, 0.01, 0, 0.1, 0.3, 0, 0.3, 0, 0, 0.1]
    text = patched(robot.with_theta(theta))
    start = ARM.index('  <link name="lower" />')
    assert text.startswith(ARM[:start]) and text.endswith(ARM[ARM.index('  <link name="tool">') :])
    assert text[start:].startswith('  <link name="lower">\n    <inertial>\n      <origin xyz="')
    links = {link.name: link for link in Robot.from_text(text).links}
    np.testing.assert_array_equal(links["tool"].phi, robot.links[-1].phi)
    np.testing.assert_allclose(
        links["lower"].phi, [0.5, 0.01, 0, 0.1, 0.3, 0, 0.3, 0, 0, 0.1], atol=1e-14
    )


def test_replaced_element_keeps_its_place():
    robot = Robot.from_text(ARM)
    theta = np.array(robot.theta)
    theta[0] = 3.0
    text = patched(robot.with_theta(theta))
    begin, end = (
        ARM.index("    <inertial>  <!-- measured"),
        ARM.index('  </link>\n  <link name="lo'),
    )
    assert text[:begin] == ARM[:begin] and text.endswith(ARM[end:])
    assert text[begin:].startswith(
        '    <inertial>\n      <origin xyz="0.0 0.0 0.0" rpy="0 0 0"/>\n      <mass value="3.0"/>\n'
    )


def test_lifted_base_parameters_can_be_written(tmp_path):
    robot = Robot.from_text(ARM)
    base = structural_base(robot)
    values = base.coordinates(robot.theta) * 1.1
    lifted = robot.with_theta(base.lift(values, robot.theta))
    reloaded = Robot.from_file(write(lifted, tmp_path / "arm.urdf"))
    np.testing.assert_allclose(base.coordinates(reloaded.theta), values, rtol=1e-12, atol=1e-13)


def test_locked_joints_do_not_matter(tmp_path):
    robot = Robot.from_text(ARM, joints=["j1"])
    changed = robot.with_theta(robot.theta * 1.2)
    reloaded = Robot.from_file(write(changed, tmp_path / "arm.urdf"), joints=["j1"])
    np.testing.assert_allclose(reloaded.theta, changed.theta, rtol=1e-12, atol=1e-15)


def test_what_cannot_be_written_is_refused(tmp_path):
    robot = Robot.from_text(ARM)
    path = tmp_path / "arm.urdf"
    massless = np.array(robot.theta)
    massless[10] = 1.0  # the tool's mass: the driven link is left with none
    with pytest.raises(RobotError, match="link 'lower': has a first moment but no mass"):
        theta = np.array(massless)
        theta[11] += 1.0
        write(robot.with_theta(theta), path)
    with pytest.raises(RobotError, match="not finite"):
        write(robot.with_theta(np.full(20, np.nan)), path)
    with pytest.raises(RobotError, match="too little mass"):
        theta = np.array(robot.theta)
        theta[:10] = [1e-12, 1.0, 2.0, 3.0, *np.full(6, 1 / 3)]
        write(robot.with_theta(theta), path)
    with pytest.raises(RobotError, match="not read from a description"):
        write(Robot("by hand", robot.joints, robot.links), path)
    assert not path.exists()
    with pytest.raises(FileError):
        write(robot, tmp_path / "no" / "such" / "folder.urdf")


def test_mjcf_bodies_of_several_joints_or_geometry():
    text = """<mujoco><worldbody><body name="a"><joint name="s" type="slide"/><joint name="h"/>
      <geom size="0.1"/></body></worldbody></mujoco>"""
    robot = Robot.from_text(text)
    theta = np.array(robot.theta)
    theta[10] += 1.0
    reloaded = Robot.from_text(patched(robot.with_theta(theta)))
    assert reloaded.links[0].source == "inertial element"
    np.testing.assert_allclose(reloaded.theta, theta, atol=1e-13)
    theta[0] += 1.0
    with pytest.raises(RobotError, match="stands for no element"):
        patched(robot.with_theta(theta))
    forced = text.replace("<mujoco>", '<mujoco><compiler inertiafromgeom="true"/>')
    with pytest.raises(RobotError, match="inertiafromgeom"):
        patched(Robot.from_text(forced).with_theta(np.where(np.arange(20) == 10, 1, robot.theta)))


def test_with_theta_mends_nan_and_refuses_what_it_cannot():
    broken = Robot.from_text(ARM.replace('value="2"', 'value="nan"'))
    assert not np.all(np.isfinite(broken.theta))
    theta = np.ones(20)
    np.testing.assert_allclose(broken.with_theta(theta).theta, theta, atol=1e-14)
    tool = Robot.from_text(ARM.replace('<mass value="1"/>', '<mass value="nan"/>'))
    with pytest.raises(RobotError, match="link 'tool'"):
        tool.with_theta(theta)
    with pytest.raises(RobotError, match="shape"):
        broken.with_theta(np.ones(3))
    changed = broken.with_theta(theta)
    assert {link.source for link in changed.links} == {"absent", "set", "inertial element"}
