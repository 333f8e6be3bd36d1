"""The same robot in URDF, SDF and MJCF is the same robot; what is special to each format."""

import numpy as np
import pytest
from random_trees import joint_names, mjcf, random_tree, sdf, urdf

from dynident.errors import RobotError
from dynident.inertia import from_com
from dynident.robot import Robot
from dynident.robot.formats.elements import from_rpy

WRITERS = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}


@pytest.mark.parametrize("valid", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_three_formats_one_robot(seed, valid, capfd):
    bodies = random_tree(seed, moving=4, valid=valid)
    names = joint_names(bodies)
    robots = {key: Robot.from_text(writer(bodies), joints=names) for key, writer in WRITERS.items()}
    want = robots["urdf"]
    motion = want.random_motion(0, 4)
    for key, robot in robots.items():
        assert robot.description is not None and robot.description.format == key
        assert robot.bodies == want.bodies and robot.kinds == want.kinds
        scale = np.max(np.abs(want.theta))
        np.testing.assert_allclose(robot.theta, want.theta, atol=1e-12 * scale)
        Y = want.regressor(*motion)
        np.testing.assert_allclose(robot.regressor(*motion), Y, atol=1e-11 * np.max(np.abs(Y)))
        for a, b in zip(robot.joints, want.joints, strict=True):
            assert (a.lower, a.upper, a.effort) == (b.lower, b.upper, b.effort)
            assert a.parent == b.parent and a.child == b.child
    err = capfd.readouterr()
    assert err.out == "" and err.err == ""


def test_links_keep_what_the_description_says():
    bodies = random_tree(1)
    for writer in WRITERS.values():
        robot = Robot.from_text(writer(bodies))
        by_name = {link.name: link for link in robot.links}
        for body in bodies:
            phi = from_com(body.mass, body.com, body.inertia)
            np.testing.assert_allclose(by_name[body.name].phi, phi, atol=1e-14)
            assert by_name[body.name].source == "inertial element"


@pytest.mark.parametrize("word", ["nan", "-1", "inf", "1e400"])
@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_broken_inertias_survive_into_the_link(writer, word):
    bodies = random_tree(1)
    text = writer(bodies)
    mass = f'"{bodies[2].mass!r}"' if writer is not sdf else f">{bodies[2].mass!r}<"
    assert text.count(mass) == 1
    robot = Robot.from_text(text.replace(mass, mass[0] + word + mass[-1]))
    link = next(link for link in robot.links if link.name == bodies[2].name)
    np.testing.assert_equal(link.phi[0], float(word))


def test_inertia_without_element_is_zero_and_absent():
    for text in (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic">'
        '<parent link="a"/><child link="b"/></joint></robot>',
        '<sdf version="1.9"><model name="r"><link name="a"/><link name="b"/>'
        '<joint name="j" type="prismatic"><parent>a</parent><child>b</child>'
        "<axis><xyz>1 0 0</xyz></axis></joint></model></sdf>",
        '<mujoco><worldbody><body name="a"><body name="b"><joint name="j" type="slide" '
        'axis="1 0 0"/></body></body></worldbody></mujoco>',
    ):
        robot = Robot.from_text(text)
        assert [link.source for link in robot.links] == ["absent", "absent"]
        assert not np.any(robot.theta)
        np.testing.assert_array_equal(robot.joints[0].axis, [1, 0, 0])
        still = np.zeros((2, 1))
        np.testing.assert_array_equal(robot.inverse_dynamics(still, still, still), still)


def test_locked_joints_stand_at_zero():
    bodies = random_tree(4, moving=5)
    names = joint_names(bodies)
    whole = Robot.from_text(urdf(bodies), joints=names)
    part = Robot.from_text(urdf(bodies), joints=[names[3], names[1]])
    assert part.locked == tuple(name for name in names if name not in part.names)
    q, v, a = (np.zeros((6, 5)) for _ in range(3))
    small = part.random_motion(0, 6)
    for full, own in zip((q, v, a), small, strict=True):
        full[:, [3, 1]] = own
    want = whole.inverse_dynamics(q, v, a)[:, [3, 1]]
    np.testing.assert_allclose(part.inverse_dynamics(*small), want, atol=1e-11)


def test_fixed_joints_merge():
    """A link welded on shows up shifted and turned in the moving body's parameters."""
    text = """<robot name="r"><link name="base"/><link name="arm"/><link name="tool"><inertial>
      <origin xyz="0 0 0.1"/><mass value="2"/>
      <inertia ixx="1" iyy="2" izz="2.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
      <axis xyz="0 1 0"/></joint>
    <joint name="f" type="fixed"><parent link="arm"/><child link="tool"/>
      <origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/></joint></robot>"""
    robot = Robot.from_text(text)
    assert robot.bodies == ("arm",) and robot.n == 1
    R = from_rpy(np.array([0, np.pi / 2, 0]))
    com = np.array([0.5, 0, 0]) + R @ [0, 0, 0.1]
    want = from_com(2.0, com, R @ np.diag([1, 2, 2.5]) @ R.T)
    np.testing.assert_allclose(robot.theta, want, atol=1e-14)


def test_sdf_joint_away_from_the_link_origin():
    """The joint frame lies on the axis; a joint pose moves it away from the link's frame."""
    text = """<sdf version="1.9"><world name="w"><gravity>0 -9 0</gravity><model name="m">
      <pose>0 0 0 0 0 1.5707963267948966</pose>
      <link name="a"/><link name="b"><pose>1 0 0 0 0 0</pose>
        <inertial><pose degrees="true">0.25 0 0 90 0 0</pose><mass>2</mass>
        <inertia><ixx>0</ixx><iyy>0</iyy><izz>3</izz></inertia></inertial></link>
      <joint name="j" type="revolute"><pose>-0.5 0 0 0 0 0</pose><parent>a</parent>
        <child>b</child><axis><xyz>0 0 1</xyz>
        <limit><lower>-1e16</lower><upper>1e16</upper></limit></axis></joint></model></world></sdf>"""
    robot = Robot.from_text(text)
    np.testing.assert_array_equal(robot.gravity, [0, -9, 0])
    assert robot.joints[0].lower == -np.inf and robot.joints[0].upper == np.inf
    np.testing.assert_allclose(robot.theta[:4], [2, 1.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(robot.theta[[4, 6, 9]], [0, 3 + 2 * 0.75**2, 2 * 0.75**2])
    # The model stands turned by 90 degrees about z: the arm points along world y.
    np.testing.assert_allclose(robot.joints[0].p, [0, 0.5, 0], atol=1e-15)
    tau = robot.inverse_dynamics(np.full((1, 1), 0.3), np.zeros((1, 1)), np.full((1, 1), 2.0))
    want = 2 * 2 * 0.75**2 + 9 * 2 * 0.75 * np.cos(0.3 + np.pi / 2)
    assert tau[0, 0] == pytest.approx(want, rel=1e-12)


def test_mjcf_several_joints_in_one_body():
    """x, then y, then a turn, in the axes of the *turned* body: checked by hand."""
    text = """<mujoco><option gravity="0 0 -10"/><compiler angle="degree"/>
      <default><joint range="-90 90"/><default class="slider"><joint type="slide" axis="0 1 0"
        range="-1 1"/></default></default>
      <worldbody><body name="a" pos="0 0 1" euler="90 0 0">
        <joint name="s" class="slider"/><joint name="h" pos="0.5 0 0" axis="0 0 1"/>
        <inertial pos="1 0 0" mass="3" diaginertia="0.1 0.2 0.3"/></body></worldbody></mujoco>"""
    robot = Robot.from_text(text)
    assert robot.names == ("s", "h") and robot.kinds == ("prismatic", "revolute")
    assert [link.source for link in robot.links] == ["inertial element", "absent"]
    assert (robot.joints[0].lower, robot.joints[0].upper) == (-1.0, 1.0)
    assert robot.joints[1].upper == pytest.approx(np.pi / 2)
    q, zero = np.array([[0.2, 0.4]]), np.zeros((1, 2))
    # The body's y axis is the world's z axis: the slider lifts the whole weight; about the hinge
    # the weight acts at 0.5 m.
    tau = robot.inverse_dynamics(q, zero, zero)
    np.testing.assert_allclose(tau, [[30.0, 30.0 * 0.5 * np.cos(0.4)]], rtol=1e-12)


@pytest.mark.parametrize(
    "orientation",
    [
        'quat="0.7071067811865476 0 0 0.7071067811865476"',
        'axisangle="0 0 2 90"',
        'xyaxes="0 1 0 -1 0.5 0"',
        'euler="0 0 90"',
    ],
)
def test_mjcf_inertial_orientations(orientation):
    text = f"""<mujoco><worldbody><body name="a"><joint name="j"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 2 3" {orientation}/>
      </body></worldbody></mujoco>"""
    np.testing.assert_allclose(
        Robot.from_text(text).theta, [1, 0, 0, 0, 2, 0, 1, 0, 0, 3], atol=1e-15
    )


def test_mjcf_geometry_gives_the_inertia_only_without_inertial():
    text = """<mujoco><default><geom density="500"/></default><asset><mesh name="m" file="m.obj"/>
      </asset><worldbody><geom type="plane" size="1 1 1"/><body name="a"><joint name="j"/>
      <geom type="box" size="0.1 0.2 0.3" pos="0 0 1"/><geom type="mesh" mesh="m" mass="0"/>
      <body name="b"><joint name="k"/><geom type="mesh" mesh="m"/>
      <inertial pos="0 0 0" mass="7" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
    robot = Robot.from_text(text)
    a, b = robot.links
    mass = 500 * 0.2 * 0.4 * 0.6
    assert (a.source, b.source) == ("geometry", "inertial element")
    box = np.diag([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2]) * mass / 3
    np.testing.assert_allclose(a.phi, from_com(mass, [0, 0, 1], box), rtol=1e-12, atol=1e-12)
    assert b.phi[0] == 7.0
    ignored = Robot.from_text(
        text.replace("<mujoco>", '<mujoco><compiler inertiafromgeom="false"/>')
    )
    assert ignored.links[0].source == "absent"


def test_names_world_and_order(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(random_tree(6)))
    robot = Robot.from_file(path)
    assert robot.names == tuple(joint_names(random_tree(6)))
    assert robot.parameter_names[:2] == (f"m.{robot.bodies[0]}", f"mx.{robot.bodies[0]}")
    assert len(robot.parameter_units) == 10 * robot.n
    with pytest.raises(RobotError, match=r"did you mean 'joint_1'"):
        Robot.from_file(path, joints=["jiont_1"])


def test_urdf_attached_to_a_world_link():
    text = """<robot name="r"><link name="world"/><link name="a"/><link name="b"/>
      <joint name="f" type="fixed"><parent link="world"/><child link="a"/>
        <origin xyz="0 0 1"/></joint>
      <joint name="j" type="continuous"><parent link="a"/><child link="b"/>
        <limit lower="-1" upper="1" effort="0" velocity="0"/></joint></robot>"""
    robot = Robot.from_text(text)
    np.testing.assert_array_equal(robot.joints[0].p, [0, 0, 1])
    joint = robot.joints[0]
    assert joint.upper == joint.velocity == joint.effort == np.inf
    assert joint.kind == "revolute"
    assert joint.continuous
    assert robot.stated_kinds == ("continuous",)
    # Of a joint that only has no limits it is not known.
    assert not Robot.from_text(text.replace("continuous", "revolute")).joints[0].continuous
