"""What can be checked: joints, estimates, files of all kinds, trees that are not supported."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

import dynident as di
from broken_robots import WRITERS, Fore, mjcf, sdf, urdf
from dynident.errors import ConsistencyError, DynidentError, RobotError
from dynident.robot import Robot
from synthetic import arm, synthetic, true_values

DYNAMICS = {
    "urdf": (
        '<dynamics damping="{0}" friction="{1}"/>',
        '<transmission><joint name="elbow"/><actuator><drake:rotor_inertia value="{2}"/>'
        "</actuator></transmission>",
    ),
    "sdf": ("<dynamics><damping>{0}</damping><friction>{1}</friction></dynamics>", ""),
    "mjcf": (
        'class="motor"',
        '<default><default class="motor"><joint damping="{0}" frictionloss="{1}" armature="{2}"/>'
        "</default></default>",
    ),
}


@pytest.mark.parametrize("name", WRITERS)
def test_joint_dynamics_of_descriptions(name):
    joint, rest = DYNAMICS[name]

    def check(*values):
        fore = Fore(joint=joint.format(*values), rest=rest.format(*values))
        return di.check(Robot.from_text(WRITERS[name](fore)))

    found = check(0.5, 0, 1e-4)
    stated = {one.quantity: (one.name, one.value, one.unit) for one in found.joints}
    assert stated["damping"] == ("elbow", 0.5, "N m s/rad")
    assert stated["friction"] == ("elbow", 0.0, "N m")
    if name != "sdf":
        assert stated["rotor inertia"] == ("elbow", 1e-4, "kg m^2")
    assert found.consistent and all(one.relative >= 0 for one in found.joints)
    for place, words in enumerate(("damping", "friction", "rotor inertia")[: len(stated)]):
        values: list[object] = [0.5, 0.5, 0.5]
        values[place] = -0.2
        found = check(*values)
        assert not found.consistent and not found.broken
        assert found.joints[0].words.startswith(f"{words} is negative: -0.2 ")
        assert "NOT consistent: joint 'elbow'" in found.sentence
        with pytest.raises(ConsistencyError, match=f"elbow: {words} is negative"):
            found.require()
        values[place] = "nan"
        assert "is not a usable number" in check(*values).joints[0].words


def test_a_damping_that_is_no_number_is_an_error():
    with pytest.raises(RobotError, match="joint 'elbow': damping = 'soft' is not a number"):
        di.check(Robot.from_text(urdf(Fore(joint='<dynamics damping="soft"/>'))))


@pytest.fixture(scope="module")
def estimate():
    model = di.Model(arm()) + "viscous_friction" + "coulomb_friction"
    values = true_values(model, Fv__shoulder=1.0, Fv__elbow=0.5, Fc__shoulder=2.0, Fc__elbow=1e-3)
    return di.fit(model, synthetic(model, values, torque_std=0.3, duration=8.0, period=None))


def test_an_estimate_is_checked_with_its_effects(estimate, tmp_path):
    good = di.check(estimate)
    assert good.source == "estimate"
    assert {one.name for one in good.joints} == {
        "Fv@shoulder",
        "Fv@elbow",
        "Fc@shoulder",
        "Fc@elbow",
    }
    index = estimate.names.index("Fc@elbow")
    values = np.array(estimate.values)
    values[index] = -0.5 * estimate.sigma[index]
    found = di.check(replace(estimate, values=values))
    assert found.joints[0].name == "Fc@elbow" and found.joints[0].broken
    assert found.joints[0].sigma == pytest.approx(-0.5)
    assert "0.5 standard deviations: zero is within its uncertainty" in found.joints[0].words
    values[index] = -40 * estimate.sigma[index]
    path = replace(estimate, values=values).save(tmp_path / "estimate.json")
    found = di.check(path)
    assert "40 standard deviations: more than its uncertainty" in found.joints[0].words
    assert found.name == str(path) and found.source == "estimate"
    assert any("another share may be consistent" in note for note in found.notes)


def test_an_impossible_estimate(estimate):
    """Base parameters that no bodies have: told, as `inconsistent_links` tells it."""
    values = np.array(estimate.values)
    values[: len(estimate.model.base.independent)] *= -1.0
    wrong = replace(estimate, values=values)
    found = di.check(wrong)
    assert {one.name for one in found.broken} == set(wrong.inconsistent_links()) != set()


@dataclass
class Holder:
    robot: object
    estimate: object = None


def test_anything_with_a_robot(estimate):
    robot = Robot.from_text(urdf())
    assert di.check(Holder(robot)).to_dict()["links"] == di.check(robot).to_dict()["links"]
    found = di.check(Holder(estimate.robot, estimate))
    assert {one.name for one in found.joints} == {one.name for one in di.check(estimate).joints}
    for nothing in (Holder(None), 3, None, [robot]):
        with pytest.raises(RobotError, match="has no robot to check"):
            di.check(nothing)


def test_numbers_set_since_are_what_is_checked():
    robot = Robot.from_text(urdf(Fore(mass="nan")))
    assert not di.check(robot).consistent
    theta = np.array(Robot.from_text(urdf()).theta)
    assert di.check(robot.with_theta(theta)).consistent
    theta[10] = np.nan
    (broken,) = di.check(Robot.from_text(urdf()).with_theta(theta)).broken
    assert "m = nan" in broken.worst.words


MIMIC = '<mimic joint="shoulder"/>'
BALL = '<body name="ball"><joint type="ball"/>{}</body></worldbody>'
UNSUPPORTED = {
    "mimic": (urdf(Fore(joint=MIMIC, mass=-1)), "joint 'elbow' mimics another joint"),
    "floating": (
        urdf(Fore(mass=-1)).replace('type="revolute"', 'type="floating"', 1),
        "joint 'shoulder' is of type 'floating'",
    ),
    "no joint": (
        urdf(Fore(mass=-1)).replace('"revolute"', '"fixed"'),
        "the description has no revolute or prismatic joint",
    ),
    "loop": (
        urdf(
            Fore(
                mass=-1,
                rest='<joint name="k" type="fixed"><parent link="base"/>'
                '<child link="fore"/></joint>',
            )
        ),
        "link 'fore' has a second parent",
    ),
    "sdf ball": (
        sdf(Fore(mass=-1)).replace('"elbow" type="revolute"', '"elbow" type="ball"'),
        "joint 'elbow' is of type 'ball'",
    ),
    "sdf free": (
        sdf(Fore(mass=-1)).replace('<link name="upper">', '<link name="free"/><link name="upper">'),
        "has several roots",
    ),
    "mjcf ball": (
        mjcf(Fore(mass=-1, joint='type="ball"')),
        "joint 'elbow' is of type 'ball'",
    ),
    "mjcf free": (
        mjcf(Fore(mass=-1)).replace('<joint name="shoulder" axis="0 0 1"/>', "<freejoint/>"),
        "body 'upper' has a free joint",
    ),
    "mjcf equality": (
        mjcf(Fore(mass=-1, rest='<equality><connect body1="fore" anchor="0 0 0"/></equality>')),
        "the description has an equality constraint <connect>",
    ),
}


@pytest.mark.parametrize(("text", "words"), UNSUPPORTED.values(), ids=UNSUPPORTED)
def test_links_are_checked_where_the_tree_is_not_supported(text, words, tmp_path):
    path = tmp_path / "robot"
    path.write_text(text)
    found = di.check(path)
    assert [one.name for one in found.broken] == ["fore"]
    assert {one.name for one in found.links} >= {"upper", "fore"} and not found.bodies
    (note,) = (note for note in found.notes if words in note)
    assert note.startswith("Links were checked one by one") and str(path) not in note
    fore = next(one for one in found.links if one.name == "fore")
    assert fore.length_from == "geometry"


def test_a_description_that_says_nothing():
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    found = di.check(Robot.from_text(text))
    assert found.links == () and not found.consistent
    assert "states no inertia of any link" in found.notes[0]


FILES = {
    "empty": ("", "is empty"),
    "a table": ("t,q.a\n0,1\n", "neither a robot description nor a saved estimate"),
    "JSON of something else": ('{"a": 1}', "is not a dynident estimate"),
    "a list": ("[1, 2]", "neither a robot description nor a saved estimate"),
    "cut off": (urdf()[:300], "not well-formed XML"),
    "a page": ("<html/>", "root element is <html>"),
    "xacro": (urdf(Fore(rest='<xacro:macro name="x"/>')), "expand it first"),
    "a broken tree": (urdf().replace('child link="fore"', 'child link="five"'), "'five'"),
    "a word for a mass": (urdf(Fore(mass="heavy")), "link 'fore': mass value = 'heavy'"),
}


@pytest.mark.parametrize(("text", "words"), FILES.values(), ids=FILES)
def test_files_that_are_something_else(text, words, tmp_path):
    path = tmp_path / "file"
    path.write_text(text)
    with pytest.raises(DynidentError, match=words) as told:
        di.check(path)
    assert str(path) in str(told.value)


def test_the_dictionary_is_json():
    for fore in (Fore(), Fore(mass="nan"), Fore(mass=-1), Fore(com="1 1 1")):
        found = di.check(Robot.from_text(urdf(fore))).to_dict()
        assert json.loads(json.dumps(found, allow_nan=False)) == found
