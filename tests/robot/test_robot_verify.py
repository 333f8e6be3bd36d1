"""Written robots are read back, loaded and moved by others before they replace anything."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from random_trees import mjcf, random_tree, sdf, urdf

from dynident import files
from dynident.errors import FileError, RobotError
from dynident.inertia import from_com, margins
from dynident.robot import Robot
from dynident.robot.verify import write_verified
from synthetic import ARM, arm

WRITERS = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}
FLAT = from_com(2.0, [0.1, 0, 0], np.diag([0.01, 0.01, 0.05]))
"""Mass and moments are positive, the triangle inequality is broken."""


def others(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_drake_and_pinocchio_load_and_move_what_was_written(writer, seed, tmp_path):
    robot = Robot.from_text(writer(random_tree(seed, moving=4)))
    changed = robot.with_theta(robot.theta * 1.1)
    found = write_verified(changed, tmp_path / "out.xml")
    assert found.difference < 1e-10 and found.simulated > 0 and not found.unchanged
    assert found.notion == "full" and found.links == len(robot.links)
    assert found.drake == "own parser"
    assert found.pinocchio == ("own parser" if writer is urdf else "our tree")
    reloaded = Robot.from_file(tmp_path / "out.xml", robot.names)
    np.testing.assert_allclose(reloaded.theta, changed.theta, rtol=1e-11, atol=1e-13)
    assert others(tmp_path) == ["out.xml"]


def test_joints_of_any_order_and_locked_ones(tmp_path):
    text = urdf(random_tree(3, moving=5)).replace('type="revolute"', 'type="continuous"')
    names = Robot.from_text(text).names
    for joints in (names[::-1], names[1:]):
        robot = Robot.from_text(text, joints=joints, gravity=(1.0, 2.0, -3.0))
        found = write_verified(robot.with_theta(robot.theta * 1.1), tmp_path / "a.urdf")
        assert found.pinocchio == "own parser"


INERTIAL = ARM[ARM.index("<inertial>") : ARM.index("</inertial>")] + "</inertial>"


@pytest.mark.parametrize(
    "world", ["", '<link name="world"/>', f'<link name="world">{INERTIAL}</link>']
)
def test_a_link_named_world(tmp_path, world):
    text = ARM.replace('<link name="base"/>', world).replace('link="base"', 'link="world"')
    robot = Robot.from_text(text)
    found = write_verified(robot.with_theta(robot.theta * 1.1), tmp_path / "a.urdf")
    assert (found.drake, found.pinocchio) == ("own parser", "own parser")


def test_what_others_cannot_read_of_a_file_does_not_matter(tmp_path):
    """Meshes that are not there, dampings that abort Drake, limits that are not stated."""
    mesh = '<visual><geometry><mesh filename="package://none/a.stl"/></geometry></visual>'
    text = (
        ARM.replace("<inertial>", mesh + "<inertial>")
        .replace("<axis", '<dynamics damping="-1" friction="nan"/><axis')
        .replace('<limit lower="-2.5" upper="2.5" velocity="6" effort="200"/>', "")
    )
    robot = Robot.from_text(text)
    found = write_verified(robot.with_theta(robot.theta * 1.1), tmp_path / "a.urdf")
    assert (found.drake, found.pinocchio) == ("own parser", "own parser")
    assert (tmp_path / "a.urdf").read_text().count(mesh) == 2


@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_what_need_not_change_stays_to_the_byte(tmp_path, start, newline):
    data = start + ARM.replace("\n", newline).encode()
    path = tmp_path / "arm.urdf"
    path.write_bytes(data)
    for out in (tmp_path / "copy.urdf", path):
        found = write_verified(Robot.from_file(path), out, source=path)
        assert found.unchanged and out.read_bytes() == data
        assert "unchanged, to the byte" in found.sentences[0]


def fails(robot, tmp_path, message, consistency: Literal["full", "semi"] = "full"):
    path = tmp_path / "old.urdf"
    path.write_text("<old/>")
    with pytest.raises(RobotError, match=message) as caught:
        write_verified(robot, path, consistency)
    assert "Nothing was written" in str(caught.value)
    assert path.read_text() == "<old/>" and others(tmp_path) == ["old.urdf"]


def test_impossible_links_are_not_written(tmp_path, capfd):
    fails(arm().with_links({"fore": -arm().links[2].phi}), tmp_path, r"link 'fore': .*(mass|not)")
    robot = arm().with_links({"upper": FLAT})
    fails(robot, tmp_path, r"old.urdf: link 'upper': .*is not consistent \(triangle -0.03\)")
    fails(
        arm().with_links({"fore": [1, 0, 0, 0, -1, 0, 1, 0, 0, 1]}),
        tmp_path,
        "inertia_com_min_eig",
        "semi",
    )
    assert capfd.readouterr().err == ""


def test_semi_consistent_links_are_told_and_kept_from_drakes_parser(tmp_path, capfd):
    robot = arm().with_links({"upper": FLAT})
    found = write_verified(robot, tmp_path / "a.urdf", "semi")
    assert found.notion == "semi" and found.semi_only == ("upper",)
    assert found.drake == "our tree" and found.simulated > 0
    assert "triangle inequality" in " ".join(found.sentences)
    assert not margins(Robot.from_file(tmp_path / "a.urdf").links[1].phi).consistent
    assert capfd.readouterr().err == ""


def test_a_chain_that_ends_without_mass_cannot_move(tmp_path):
    fails(arm().with_links({"fore": np.zeros(10)}), tmp_path, r"(Drake cannot simulate|singular)")


def test_links_to_which_a_format_gives_a_default_mass(tmp_path):
    """An SDF link without inertial element weighs 1 kg, in Drake as in the format's definition."""
    text = """<sdf version="1.9"><model name="m"><link name="base"/>
      <link name="a"><pose relative_to="base">0 0 1 0 0 0</pose>
      <inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
      </link><link name="tool"><pose relative_to="a">0 0 1 0 0 0</pose></link>
      <joint name="j" type="revolute"><parent>base</parent><child>a</child>
      <axis><xyz>0 1 0</xyz></axis></joint>
      <joint name="f" type="fixed"><parent>a</parent><child>tool</child></joint></model></sdf>"""
    robot = Robot.from_text(text)
    with pytest.raises(RobotError, match=r"link 'tool': .*default of 1 kg.* state its inertia"):
        write_verified(robot, tmp_path / "m.sdf")
    stated = robot.with_links({"tool": from_com(0.1, [0, 0, 0], 0.01 * np.eye(3))})
    assert write_verified(stated, tmp_path / "m.sdf").drake == "own parser"


def test_mjcf_bodies_of_several_joints_and_of_shapes(tmp_path):
    text = """<mujoco><worldbody><body name="a"><joint name="s" type="slide"/><joint name="h"/>
      <geom size="0.1"/><body name="b" pos="1 0 0"><joint name="k" axis="0 1 0"/>
      <inertial pos="1 0 0" mass="1" diaginertia="1 1 1.5" euler="30 0 0"/></body></body>
      </worldbody></mujoco>"""
    robot = Robot.from_text(text)
    (phi,) = (link.phi for link in robot.links if link.name == "b")
    changed = robot.with_links({"b": phi * 1.1})
    assert write_verified(changed, tmp_path / "m.xml").drake == "own parser"
    assert 'geom size="0.1"' in (tmp_path / "m.xml").read_text()


def test_mjcf_cannot_state_a_mass_of_zero(tmp_path):
    text = """<mujoco><worldbody><body name="a"><joint name="s" type="slide"/>
      <inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/><body name="b"><joint name="k"/>
      <inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
    with pytest.raises(RobotError, match=r"link 'a': .*states a mass of zero.* give it a mass"):
        write_verified(Robot.from_text(text), tmp_path / "m.xml")


def test_another_format_is_refused_by_its_name(tmp_path):
    with pytest.raises(FileError, match=r"arm.sdf: the description is of the format URDF"):
        write_verified(arm(), tmp_path / "arm.sdf")
    (tmp_path / "run.csv").write_text("t,q.shoulder")
    with pytest.raises(FileError, match=r"run.csv: is not a robot description. write to another"):
        write_verified(arm(), tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text() == "t,q.shoulder"


def test_an_interrupt_leaves_the_old_file(tmp_path):
    def interrupted(_):
        raise KeyboardInterrupt

    path = tmp_path / "old.urdf"
    path.write_text("<old/>")
    with pytest.raises(KeyboardInterrupt):
        files.write_bytes(path, b"new", interrupted)
    assert path.read_text() == "<old/>" and others(tmp_path) == ["old.urdf"]


def test_a_robot_prints_in_one_line():
    assert repr(arm()) == "Robot('arm': 2 joints, 3 links, from urdf 'robot description')"
    assert "\n" not in repr(Robot("by hand", arm().joints, arm().links))
