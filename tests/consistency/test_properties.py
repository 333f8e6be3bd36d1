"""What every check keeps: no false alarm, mends that mend, margins that know no units."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_trees import random_tree
from random_trees import urdf as tree_urdf

import dynident as di
from broken_robots import Fore, text, urdf
from dynident.inertia import from_com, margins
from dynident.robot import Robot
from dynident.robot.formats.elements import from_rpy

SEEDS = st.integers(0, 2**32 - 1)


def fore_of(found: di.consistency.Check):
    return next(one for one in found.links if one.name == "fore")


def points_in_a_box(rng) -> tuple[np.ndarray, np.ndarray, str]:
    """Masses (k,) and places (k, 3) inside a random box, and the box in URDF words."""
    size = 10.0 ** rng.uniform(-2, 0.5, 3)
    rpy, middle = rng.uniform(-3, 3, 3), rng.normal(size=3)
    count = rng.integers(1, 9)
    # Some of them in corners, where the bounds are met exactly.
    places = rng.uniform(-0.5, 0.5, (count, 3))
    places[rng.random(count) < 0.5] = rng.choice([-0.5, 0.5], 3)
    places = (places * size) @ from_rpy(rpy).T + middle
    shape = (
        f'<visual><origin xyz="{text(middle)}" rpy="{text(rpy)}"/><geometry>'
        f'<box size="{text(size)}"/></geometry></visual>'
    )
    return 10.0 ** rng.uniform(-3, 2, count), places, shape


def body(masses: np.ndarray, places: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    mass = float(masses.sum())
    com = masses @ places / mass
    about = places - com
    spread = (masses[:, None] * about).T @ about
    return mass, com, np.trace(spread) * np.eye(3) - spread


def fore(mass, com, inertia, shape) -> Fore:
    moments = tuple(repr(float(x)) for x in np.diag(inertia))
    products = tuple(repr(float(inertia[i, j])) for i, j in ((0, 1), (0, 2), (1, 2)))
    return Fore(repr(mass), text(com), moments, products, shape)


@settings(max_examples=60)
@given(SEEDS)
def test_masses_inside_a_box_are_never_flagged(seed):
    masses, places, shape = points_in_a_box(np.random.default_rng(seed))
    found = fore_of(di.check(Robot.from_text(urdf(fore(*body(masses, places), shape)))))
    assert not found.broken, found
    assert not any(rule.doubtful for rule in found.rules), found


@settings(max_examples=60)
@given(SEEDS)
@pytest.mark.slow
def test_masses_out_of_the_box_are_seen(seed):
    """All of the mass beyond one face: its centre is outside."""
    rng = np.random.default_rng(seed)
    masses, places, _ = points_in_a_box(rng)
    away = rng.normal(size=3)
    away *= (np.ptp(places, axis=0).sum() + 10.0) / np.linalg.norm(away)
    shape = '<visual><geometry><sphere radius="1"/></geometry></visual>'
    places = places - places.mean(axis=0) + away
    found = fore_of(di.check(Robot.from_text(urdf(fore(*body(masses, places), shape)))))
    assert "centre_of_mass" in {one.rule for one in found.broken}


@settings(max_examples=60)
@given(SEEDS)
@pytest.mark.slow
def test_mended_links_are_whole(seed):
    """With the numbers that the mend states, every rule holds; and a whole link needs no mend."""
    rng = np.random.default_rng(seed)
    mass = float(rng.choice([-1.0, 0.0, 1.0, 5.0]))
    inertia = 10.0 ** rng.uniform(-4, -1) * rng.normal(size=(3, 3))
    shape = None if rng.random() < 0.5 else ""
    # A link without mass has no centre of mass either, whatever the file says.
    com = rng.normal(size=3) * 0.1 * (mass != 0.0)
    broken = fore_of(di.check(Robot.from_text(urdf(fore(mass, com, inertia + inertia.T, shape)))))
    if not broken.broken:
        assert broken.remedy == ()
        return
    assert broken.remedy
    new = {change.name: change.after for change in broken.remedy}
    old = dict(zip(("com x", "com y", "com z"), com, strict=True))
    old |= {
        f"i{'xyz'[i]}{'xyz'[j]}": (inertia + inertia.T)[i, j] for i in range(3) for j in range(i, 3)
    }
    value = {"mass": mass, **old, **new}
    com = np.array([value[f"com {axis}"] for axis in "xyz"])
    inertia = np.array([[value[f"i{min(a, b)}{max(a, b)}"] for a in "xyz"] for b in "xyz"])
    mended = fore(value["mass"], com, inertia, shape)
    again = fore_of(di.check(Robot.from_text(urdf(mended))))
    # What is left out of the mend are changes of 1e-5.
    for rule in again.rules:
        assert not rule.broken or rule.relative > -1e-4, rule
    for change in broken.remedy:
        assert change.before != change.after


@pytest.mark.parametrize("seed", range(6))
def test_margins_agree_with_the_verdict_on_ten_parameters(seed):
    robot = Robot.from_text(tree_urdf(random_tree(seed, valid=False)))
    found = {one.name: one for one in di.check(robot).links}
    for link in robot.links:
        rules = {one.rule: one for one in found[link.name].rules}
        told = not any(one.broken for one in rules.values())
        assert told == (margins(link.phi).consistent and link.phi[0] != 0.0), link.name
        assert rules["mass"].value == link.phi[0]
    broken = [one.broken != () for one in di.check(robot).links]
    assert broken == sorted(broken, reverse=True)
    relative = [one.worst.relative for one in di.check(robot).links if not one.broken]
    assert relative == sorted(relative)


@settings(max_examples=60)
@given(SEEDS, st.sampled_from([1e-3, 1e3]), st.sampled_from([1e-2, 30.0]))
@pytest.mark.slow
def test_relative_margins_know_no_units(seed, length, mass):
    """The same robot in mm, or made of lead, is as near to impossible."""
    rng = np.random.default_rng(seed)
    masses, places, _ = points_in_a_box(rng)
    links = []
    for heavier, longer in ((1.0, 1.0), (mass, length)):
        own = body(heavier * masses, longer * places)
        links.append(from_com(*own))
    one, other = (
        {rule.rule: rule.relative for rule in found.links[0].rules}
        for found in (
            di.check(_lone(phi, size)) for phi, size in zip(links, (1.0, length), strict=True)
        )
    )
    assert one == pytest.approx(other, rel=1e-6, abs=1e-9)


def _lone(phi: np.ndarray, length: float) -> Robot:
    """A robot of one link with these parameters, whose next joint is 0.5 l away."""
    robot = Robot.from_text(
        '<robot name="r"><link name="base"/><link name="a"/><link name="b"/>'
        '<joint name="j" type="revolute"><parent link="base"/><child link="a"/></joint>'
        '<joint name="k" type="revolute"><parent link="a"/><child link="b"/>'
        f'<origin xyz="{0.5 * length} 0 0"/></joint></robot>'
    )
    return robot.with_theta(np.concatenate([phi, np.zeros(10)]))


def test_the_verdict_of_a_link_in_a_merged_body():
    """A tool of negative mass hides in the link that it is welded to: both are told."""
    rest = (
        '<link name="tool"><inertial><mass value="-0.1"/><inertia ixx="1e-5" ixy="0" ixz="0" '
        'iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link><joint name="f" type="fixed">'
        '<parent link="fore"/><child link="tool"/><origin xyz="0.15 0 0"/></joint>'
    )
    found = di.check(Robot.from_text(urdf(Fore(rest=rest))))
    assert [one.name for one in found.broken] == ["tool"]
    (whole,) = found.bodies
    assert whole.parts == ("fore", "tool") and not whole.broken
    assert any(
        "as a whole (fore, tool) is consistent all the same" in str(p) for p in found.tables()
    )
    # Heavier, it breaks the whole.
    found = di.check(Robot.from_text(urdf(Fore(rest=rest.replace("-0.1", "-5")))))
    assert {one.kind for one in found.broken} == {"link", "moving body"}


ROTOR = '<transmission><joint name="elbow"/><actuator><drake:rotor_inertia value="0.1"/>'


def test_a_joint_that_moves_nothing():
    """No mass beyond a joint: the mass matrix is singular, unless a rotor turns."""
    nothing = Fore(mass=0, moments=(0, 0, 0))
    found = di.check(Robot.from_text(urdf(nothing)))
    assert [one.title for one in found.broken] == ["moving body 'fore'"]
    assert "no simulation can accelerate it" in found.broken[0].worst.words
    rotor = Fore(mass=0, moments=(0, 0, 0), rest=ROTOR + "</actuator></transmission>")
    assert di.check(Robot.from_text(urdf(rotor))).consistent
    # A massless link between others is a common way of writing several axes in one point.
    light = urdf().replace('<mass value="4"/>', '<mass value="0"/>')
    for number in ("0.0066", "0.0566"):
        light = light.replace(f'"{number}"', '"0"')
    found = di.check(Robot.from_text(light))
    assert found.consistent
    assert [one.hints for one in found.links if one.hints] == [("its mass is stated as zero",)]
