"""Bad descriptions: each one clear line, from us, and nothing on the terminal."""

import re

import numpy as np
import pytest

from dynident.errors import DynidentError, RobotError
from dynident.robot import Robot

MASS = '<mass value="1"/>'
INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
LINKS = f'<link name="a"/><link name="b"><inertial>{MASS}{INERTIA}</inertial></link>'
JOINT = (
    '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 1"/>'
    '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
)
GOOD = f'<robot name="r">{LINKS}{JOINT}</robot>'
SECOND = '<joint name="k" type="fixed"><parent link="a"/><child link="b"/></joint>'


def urdf(old="", new=""):
    assert old in GOOD
    return GOOD.replace(old, new)


URDF = {
    "empty": ("", "not well-formed XML: no element found"),
    "binary": ("\x00\x01\x02", "not well-formed XML"),
    "cut off": (GOOD[:-20], "not well-formed XML"),
    "another language": ("<html/>", "root element is <html>"),
    "billion laughs": (
        '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>',
        "declares a DOCTYPE",
    ),
    "absurdly deep": ("<robot>" + "<a>" * 5000 + "</a>" * 5000 + "</robot>", "nests more than"),
    "xacro": (urdf(LINKS, '<xacro:macro name="x"/>' + LINKS), "xacro.*expand it"),
    "no links": ('<robot name="r"/>', "has no links|no revolute"),
    "nothing moves": (urdf('type="revolute"', 'type="fixed"'), "no revolute or prismatic joint"),
    "mass is a word": (urdf('value="1"', 'value="heavy"'), "link 'b': mass value = 'heavy'"),
    "mass has no value": (urdf(MASS, "<mass/>"), "link 'b': mass has no 'value'"),
    "no mass": (urdf(MASS, ""), "link 'b': has an <inertial> without <mass>"),
    "no inertia": (urdf(INERTIA, ""), "link 'b': has an <inertial> without <inertia>"),
    "no moment": (urdf(' iyy="1"', ""), "link 'b': inertia has no 'iyy'"),
    "two masses": (urdf(MASS, MASS * 2), "link 'b': has 2 <mass> elements"),
    "short origin": (urdf("0 0 1", "0 1"), "joint 'j': origin xyz has 2 numbers where 3"),
    "nan origin": (urdf('xyz="0 0 1"/><a', 'xyz="0 nan 1"/><a'), "joint 'j': .*not finite"),
    "zero axis": (urdf('<axis xyz="0 0 1"', '<axis xyz="0 0 0"'), "joint 'j': has a zero axis"),
    "floating": (urdf("revolute", "floating"), "joint 'j': is of type 'floating'.*fix the base"),
    "planar": (urdf("revolute", "planar"), "joint 'j': is of type 'planar'"),
    "unknown type": (urdf("revolute", "rotary"), "joint 'j': is of unknown type 'rotary'"),
    "mimic": (urdf("<axis", '<mimic joint="k"/><axis'), "joint 'j': mimics another joint"),
    "closed chain": (urdf("</robot>", SECOND + "</robot>"), "link 'b': has a second parent"),
    "loop": (
        f'<robot name="r">{LINKS}{JOINT}<joint name="k" type="fixed"><parent link="b"/>'
        '<child link="a"/></joint></robot>',
        "is its own ancestor: closed chains",
    ),
    "several roots": (
        urdf('<link name="a"/>', '<link name="lost"/><link name="a"/>'),
        r"several roots \(lost, a\)",
    ),
    "unknown link": (urdf('child link="b"', 'child link="c"'), "joint 'j': names a child link 'c'"),
    "no child": (urdf('<child link="b"/>', ""), "joint 'j': has no <child>"),
    "twice the name": (urdf('name="b"', 'name="a"'), "two links named 'a'"),
    "nameless link": (urdf('<link name="a"/>', "<link/>"), "has a link without a name"),
    "limits crossed": (urdf('lower="-1"', 'lower="2"'), "joint 'j': has a lower limit above"),
    "limit is a word": (urdf('effort="1"', 'effort="big"'), "joint 'j': limit effort = 'big'"),
}

SDF_LINKS = '<link name="a"/><link name="b"><inertial><mass>1</mass></inertial></link>'.replace(
    "</mass>", "</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>"
)
SDF_JOINT = (
    '<joint name="j" type="revolute"><parent>a</parent><child>b</child>'
    "<axis><xyz>0 0 1</xyz></axis></joint>"
)
SDF_GOOD = f'<sdf version="1.9"><model name="m">{SDF_LINKS}{SDF_JOINT}</model></sdf>'


def sdf(old="", new=""):
    assert old in SDF_GOOD
    return SDF_GOOD.replace(old, new)


SDF = {
    "no model": ('<sdf version="1.9"/>', "has no <model>"),
    "no version": (sdf(' version="1.9"'), "has version ''"),
    "future version": (sdf("1.9", "77.0"), "cannot be understood"),
    "two models": (
        sdf("<model", '<model name="k"><link name="x"/></model><model'),
        r"models \(k, m",
    ),
    "nested": (sdf("<link", '<model name="k"><link name="x"/></model><link'), "nested model 'k'"),
    "include": (sdf("<link", "<include><uri>model://x</uri></include><link"), r"\(model://x\)"),
    "static": (sdf("<link", "<static>true</static><link"), "is static"),
    "ball": (sdf("revolute", "ball"), "joint 'j': is of type 'ball'"),
    "universal": (sdf("revolute", "universal"), "joint 'j': is of type 'universal'"),
    "screw": (sdf("revolute", "screw"), "joint 'j': is of type 'screw'"),
    "gearbox": (sdf("revolute", "gearbox"), "joint 'j': is of type 'gearbox'"),
    "no axis": (sdf("<axis><xyz>0 0 1</xyz></axis>", ""), "joint 'j': has no <axis>"),
    "bad axis": (sdf("0 0 1", "0 0 up"), "joint 'j': axis xyz = 'up' is not a number"),
    "unknown parent": (sdf("<parent>a", "<parent>zz"), "zz"),
    "closed": (sdf("</model>", SDF_JOINT.replace('"j"', '"k"') + "</model>"), "'[jk]'"),
    "floating": (
        sdf('<link name="a"/>', '<link name="x"/><link name="a"/>'),
        "several roots: nothing attaches",
    ),
    "no moment": (sdf("<iyy>1</iyy>", ""), "link 'b': inertia iyy has 0 numbers"),
    "automatic": (sdf("<inertial", '<inertial auto="true"'), "link 'b': asks for its inertia"),
    "weightless": (sdf('"b">', '"b"><gravity>false</gravity>'), "link 'b': is without gravity"),
    "mimic": (sdf("<axis>", '<axis><mimic joint="x"/>'), "joint 'j': mimics"),
}

MJCF_GOOD = (
    '<mujoco><worldbody><body name="a"><joint name="j" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>'
)


def mjcf(old="", new=""):
    assert old in MJCF_GOOD
    return MJCF_GOOD.replace(old, new)


def compiler(setting):
    return mjcf("<mujoco>", f"<mujoco><compiler {setting}/>")


MJCF = {
    "no bodies": ("<mujoco><worldbody/></mujoco>", "has no bodies"),
    "free joint": (mjcf("<joint", "<freejoint/><joint"), "body 'a': has a free joint"),
    "free type": (mjcf("<joint", '<joint type="free"/><joint'), "has a free joint"),
    "ball": (mjcf('axis="0 0 1"', 'type="ball"'), "joint 'j': is of type 'ball'"),
    "include": (mjcf("<worldbody>", '<include file="x"/><worldbody>'), "<include> element"),
    "equality": (
        mjcf("<worldbody>", '<equality><joint joint1="j"/></equality><worldbody>'),
        "equality constraint <joint>",
    ),
    "replicate": (mjcf("<body", '<replicate count="2"/><body'), "<replicate> element"),
    "zero axis": (mjcf("0 0 1", "0 0 0"), "joint 'j': has a zero axis"),
    "ref": (mjcf("axis", 'ref="0.1" axis'), "joint 'j': has ref"),
    "gravcomp": (mjcf('name="a"', 'name="a" gravcomp="1"'), "body 'a': has gravcomp"),
    "total mass": (compiler('settotalmass="3"'), "compiler settotalmass"),
    "balance": (compiler('balanceinertia="true"'), "compiler balanceinertia"),
    "global": (compiler('coordinate="global"'), "compiler coordinate"),
    "angle": (compiler('angle="grad"'), "compiler angle 'grad'"),
    "eulerseq": (compiler('eulerseq="abc"'), "compiler eulerseq 'abc'"),
    "no inertia": (mjcf(' diaginertia="1 1 1"', ""), "without diaginertia or fullinertia"),
    "both inertias": (mjcf("diag", 'fullinertia="1 1 1 0 0 0" diag'), "both diaginertia"),
    "turned full": (
        mjcf('diaginertia="1 1 1"', 'fullinertia="1 1 1 0 0 0" quat="1 0 0 0"'),
        "together with an orientation",
    ),
    "two orientations": (
        mjcf("<body", '<body quat="1 0 0 0" euler="0 0 0"'),
        "states its orientation twice",
    ),
    "no direction": (mjcf("<body", '<body quat="0 0 0 0"'), "has no direction"),
    "bad class": (mjcf("<joint", '<joint class="x"'), "unknown default class 'x'"),
    "mesh inertia": (
        re.sub("<inertial.*?/>", '<geom type="mesh" mesh="m"/>', MJCF_GOOD),
        "body 'a': has no <inertial>, and its inertia would come from a geom of type 'mesh'",
    ),
    "geom without size": (
        re.sub("<inertial.*?/>", '<geom size="0"/>', MJCF_GOOD),
        "geom without size",
    ),
    "two names": (mjcf("<joint", '<joint name="j"/><joint'), "two joints named 'j'"),
}

CASES = {
    f"{form} {name}": case
    for form, cases in (("urdf", URDF), ("sdf", SDF), ("mjcf", MJCF))
    for name, case in cases.items()
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_one_clear_line(case, tmp_path, capfd):
    text, message = case
    path = tmp_path / "bad.xml"
    path.write_text(text)
    with pytest.raises(RobotError) as caught:
        Robot.from_file(path)
    assert re.search(message, str(caught.value)), str(caught.value)
    assert str(caught.value).startswith(str(path)), str(caught.value)
    assert "\n" not in str(caught.value) and "<literal-string>" not in str(caught.value)
    out = capfd.readouterr()
    assert out.out == "" and out.err == ""


def test_the_good_ones_are_good():
    for text in (GOOD, SDF_GOOD, MJCF_GOOD):
        assert Robot.from_text(text).names == ("j",)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        (["jj"], r"no moving joint 'jj'.*did you mean 'j'"),
        (["j", "j"], "asked for twice"),
        ([], "no joints are asked for"),
    ],
)
def test_bad_choice_of_joints(joints, message):
    with pytest.raises(RobotError, match=message):
        Robot.from_text(GOOD, joints=joints)


def test_bad_files_and_arguments(tmp_path):
    with pytest.raises(DynidentError, match="no such file"):
        Robot.from_file(tmp_path / "none.urdf")
    with pytest.raises(DynidentError, match="folder"):
        Robot.from_file(tmp_path)
    (tmp_path / "latin.urdf").write_bytes(GOOD.replace('"r"', '"\xe9"').encode("latin-1"))
    with pytest.raises(DynidentError, match="not UTF-8"):
        Robot.from_file(tmp_path / "latin.urdf")
    with pytest.raises(RobotError, match="gravity"):
        Robot.from_text(GOOD, gravity=[0, 0])
    with pytest.raises(RobotError, match="gravity"):
        Robot.from_text(GOOD, gravity=[0, 0, np.nan])
    robot = Robot.from_text(GOOD)
    one, two = np.zeros((3, 1)), np.zeros((3, 2))
    for motion in ((one, one, two), (two, two, two), (one, one[:2], one), (one[0], one, one)):
        with pytest.raises(RobotError, match="has shape"):
            robot.regressor(*motion)
    with pytest.raises(RobotError, match="theta has shape"):
        robot.inverse_dynamics(one, one, one, theta=np.zeros(3))


def test_meshes_plugins_and_transmissions_are_never_resolved(capfd):
    text = urdf(
        '<link name="a"/>',
        '<link name="a"><visual><geometry><mesh filename="package://no/x.stl"/></geometry></visual>'
        '<collision><geometry><mesh filename="/no/y.obj"/></geometry></collision></link>'
        '<material name="m"/><transmission name="t"/><gazebo><plugin name="p"/></gazebo>'
        '<drake:joint name="undeclared prefix"/>',
    )
    assert Robot.from_text(text).names == ("j",)
    out = capfd.readouterr()
    assert out.out == "" and out.err == ""


HAND = (
    '<link name="f"/><joint name="finger" type="prismatic"><parent link="b"/><child link="f"/>'
    '<axis xyz="0 1 0"/></joint><link name="g"/><joint name="thumb" type="prismatic">'
    '<parent link="b"/><child link="g"/><axis xyz="0 -1 0"/><mimic joint="finger"/></joint></robot>'
)


def test_fingers_that_were_not_recorded_stand_still():
    """As those of a gripper do while an arm is identified: neither finger nor thumb moves."""
    text = urdf("</robot>", HAND)
    robot = Robot.from_text(text, joints=("j",))
    assert robot.names == ("j",)
    assert set(robot.locked) == {"finger", "thumb"}
    alone = Robot.from_text(GOOD)
    np.testing.assert_allclose(robot.theta, alone.theta)
    for joints in (None, ("j", "finger"), ("j", "thumb")):
        with pytest.raises(RobotError, match=r"joint 'thumb': mimics another joint.*--joints"):
            Robot.from_text(text, joints=joints)
