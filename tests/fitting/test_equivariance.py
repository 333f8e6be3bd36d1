"""Projection does not depend on units, nor on the order of joints and links, nor on axes."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chains import (
    chain_text,
    estimated,
    links,
    pseudo,
    recorded,
)
from dynident.constraints import Within
from dynident.fitting import Prior, project
from dynident.inertia import frame_change
from dynident.recording import Recording
from dynident.robot import Robot
from dynident.robot.formats.elements import from_rpy

# --- what it does not depend on ------------------------------------------------------------------


def in_other_units(text: str) -> str:
    """A chain in mm and g: attributes by their dimension."""

    def scaled(name: str, factor: float):
        def change(match: re.Match[str]) -> str:
            numbers = " ".join(repr(float(x) * factor) for x in match.group(1).split())
            return f'{name}="{numbers}"'

        return change

    for name, factor in (("xyz", 1e3), ("value", 1e3)):
        text = re.sub(rf'\b{name}="([^"]*)"', scaled(name, factor), text)
    text = text.replace('<axis xyz="0.0 0.0 1000.0"/>', '<axis xyz="0 0 1"/>')
    for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        text = re.sub(rf'\b{name}="([^"]*)"', scaled(name, 1e9), text)
    return text


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize("consistency", ["full", "semi"])
def test_units_do_not_matter(consistency, distance) -> None:
    """The same robot in kg, m and in g, mm (torques in g mm^2/s^2)."""
    text = chain_text(3)
    robot = Robot.from_text(text)
    other = Robot.from_text(in_other_units(text), gravity=(0.0, 0.0, -9810.0))
    recording = recorded(robot)
    small = Recording(
        recording.t, recording.q, 1e9 * recording.tau, robot.names, period=recording.period
    )
    found = [
        project(estimated(r, data), Prior(r, distance), within=Within(consistency))
        for r, data in ((robot, recording), (other, small))
    ]
    factor = np.array([1e3, *[1e6] * 3, *[1e9] * 6])
    for name, phi in links(found[0].robot).items():
        size = np.sqrt(np.diag(pseudo(links(robot)[name])))
        there = pseudo(links(found[1].robot)[name] / factor)
        np.testing.assert_allclose(
            there / np.outer(size, size), pseudo(phi) / np.outer(size, size), atol=1e-7
        )
    assert not np.allclose(found[0].x, found[0].x_before), "something moved"
    friction = [one.estimate.effect_values("viscous_friction@j1") for one in found]
    np.testing.assert_allclose(friction[1], 1e9 * friction[0], rtol=1e-7)


def test_the_order_of_joints_does_not_matter() -> None:
    text = chain_text(3)
    found = []
    for names in (("j0", "j1", "j2"), ("j2", "j0", "j1")):
        robot = Robot.from_text(text, joints=names)
        order = [int(name[1]) for name in names]
        data = recorded(Robot.from_text(text))
        data = Recording(data.t, data.q[:, order], data.tau[:, order], names, period=4.0)
        found.append(project(estimated(robot, data)))
    assert found[0].certificate.objective > 0.1
    for name, phi in links(found[0].robot).items():
        np.testing.assert_allclose(links(found[1].robot)[name], phi, rtol=1e-6, atol=1e-8)


def test_the_order_of_links_does_not_matter() -> None:
    """The same elements of the description, the last first."""
    text = chain_text(3)
    robot = Robot.from_text(text)
    root = ET.fromstring(text)
    root[:] = list(root)[::-1]
    whole = Robot.from_text(ET.tostring(root, encoding="unicode"), joints=robot.names)
    data = recorded(robot)
    found = [project(estimated(r, data)) for r in (robot, whole)]
    assert found[0].space.bodies != found[1].space.bodies, "another order"
    for name, phi in links(found[0].robot).items():
        np.testing.assert_allclose(links(found[1].robot)[name], phi, rtol=1e-6, atol=1e-8)


def turned(text: str, link: str, R: np.ndarray) -> str:
    """A chain with the frame of one link turned: its mass, joint axis and child follow."""

    def put(element: ET.Element, xyz: np.ndarray, turn: np.ndarray) -> None:
        element.set("xyz", " ".join(map(repr, map(float, xyz))))
        element.set(
            "rpy", " ".join(map(repr, map(float, Rotation.from_matrix(turn).as_euler("xyz"))))
        )

    def get(element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
        numbers = [np.array(element.get(k, "0 0 0").split(), dtype=float) for k in ("xyz", "rpy")]
        return numbers[0], from_rpy(numbers[1])

    root = ET.fromstring(text)
    for one in root:
        if one.tag == "link" and one.get("name") == link:
            origin = one.find("inertial/origin")
            assert origin is not None
            xyz, turn = get(origin)
            put(origin, R.T @ xyz, R.T @ turn)
        if one.tag == "joint":
            origin, axis, child = one.find("origin"), one.find("axis"), one.find("child")
            parent = one.find("parent")
            assert origin is not None and axis is not None
            assert child is not None and parent is not None
            xyz, turn = get(origin)
            if child.get("link") == link:
                put(origin, xyz, turn @ R)
                direction = R.T @ np.array(axis.get("xyz", "").split(), dtype=float)
                axis.set("xyz", " ".join(map(repr, map(float, direction))))
            elif parent.get("link") == link:
                put(origin, R.T @ xyz, R.T @ turn)
    return ET.tostring(root, encoding="unicode")


def test_the_axes_of_a_link_do_not_matter() -> None:
    R = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    R = R * np.linalg.det(R)
    text = chain_text(3)
    robot, other = Robot.from_text(text), Robot.from_text(turned(text, "l1", R))
    data = recorded(robot)
    motion = robot.random_motion(0, 3)
    np.testing.assert_allclose(
        other.inverse_dynamics(*motion), robot.inverse_dynamics(*motion), atol=1e-9
    )
    found = [project(estimated(r, data)) for r in (robot, other)]
    back = frame_change(R, np.zeros(3))
    for name, phi in links(found[0].robot).items():
        there = links(found[1].robot)[name]
        there = back @ there if name == "l1" else there
        np.testing.assert_allclose(there, phi, rtol=1e-6, atol=1e-7)
    assert np.linalg.norm(found[0].robot.links[2].phi - robot.links[2].phi) > 1e-3
