"""Inertia ellipsoids: the right solids, and pictures of anything, impossible bodies included."""

from __future__ import annotations

import warnings
from dataclasses import replace
from io import BytesIO

import numpy as np
import pinocchio as pin
import pytest
from matplotlib.figure import Figure
from tests.synthetic import arm

from dynident.errors import DynidentError
from dynident.inertia import frame_change, from_com, to_com
from dynident.reporting.pictures.ellipsoids import inertia_ellipsoids, inertia_sections
from dynident.reporting.pictures.solids import poses, solid
from dynident.robot import Robot
from dynident.robot.formats.elements import from_rpy

R = from_rpy(np.array([0.4, -0.7, 1.1]))
P = np.array([0.3, -0.2, 0.5])
POSSIBLE = from_com(3.0, [0.1, 0.0, 0.02], np.diag([0.01, 0.02, 0.02]))
# What no body can be, and a word of what is said of it.
IMPOSSIBLE = {
    "a triangle": (from_com(2.0, [0.1, 0, 0], np.diag([0.01, 0.01, 0.03])), "mean square"),
    "a moment": (from_com(2.0, [0.1, 0, 0], np.diag([-0.01, 0.02, 0.02])), "mean square"),
    "three moments": (from_com(2.0, [0.1, 0, 0], np.diag([-0.1, -0.1, -0.1])), "mean square"),
    "the mass": (from_com(-1.2, [0.1, 0, 0], np.diag([0.01, 0.01, 0.01])), "mass −1.2 kg"),
    "no mass": (np.array([0.0, 0.1, 0, 0, 0.1, 0, 0.1, 0, 0, 0.1]), "no mass"),
    "a nan": (np.array([1.0, np.nan, 0, 0, 0.1, 0, 0.1, 0, 0, 0.1]), "not a number"),
    "infinity": (np.array([np.inf, 0, 0, 0, 0.1, 0, 0.1, 0, 0, 0.1]), "not a number"),
    "a far centre": (np.array([1e-200, 0.1, 0, 0, 0.1, 0, 0.1, 0, 0, 0.1]), ""),
}


def drawn(figure: Figure) -> bytes:
    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(buffer, format="png")
    return buffer.getvalue()


def with_body(phi: np.ndarray) -> Robot:
    """The two-link arm with a forearm of these parameters."""
    robot = arm()
    links = (replace(link, phi=phi) if link.name == "fore" else link for link in robot.links)
    return replace(robot, links=tuple(links))


def words(figure: Figure) -> str:
    found = [axes.get_title() for axes in figure.axes]
    found += [text.get_text() for axes in figure.axes for text in axes.texts]
    return " | ".join(found)


def test_a_uniform_ellipsoid_is_itself_in_any_frame() -> None:
    semi, mass, com = np.array([0.05, 0.1, 0.3]), 2.5, np.array([0.1, -0.05, 0.2])
    squares = semi**2
    here = from_com(mass, com, mass / 5.0 * np.diag(squares.sum() - squares))
    found = solid("body", frame_change(R, P) @ here)
    np.testing.assert_allclose(found.semi_axes, semi, rtol=1e-12)
    np.testing.assert_allclose(np.abs(R.T @ found.axes), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found.centre, R @ com + P, rtol=1e-12)
    assert found.fault == ""


def test_a_box_has_the_ellipsoid_of_its_mean_squares() -> None:
    sides, mass = np.array([0.1, 0.2, 0.4]), 7.0
    squares = sides**2
    inertia = mass / 12.0 * np.diag(squares.sum() - squares)
    found = solid("box", from_com(mass, [0, 0, 0.3], inertia))
    np.testing.assert_allclose(found.mean_square, squares / 12.0, rtol=1e-12)
    np.testing.assert_allclose(found.semi_axes, sides * np.sqrt(5.0 / 12.0), rtol=1e-12)


def test_a_flat_plate_and_a_point_are_possible() -> None:
    plate = solid("plate", from_com(1.0, [0.2, 0, 0], np.diag([1.0, 2.0, 3.0]) / 12.0))
    point = solid("point", from_com(1.0, [0.2, 0.1, 0], np.zeros((3, 3))))
    empty = solid("empty", np.zeros(10))
    assert (plate.fault, point.fault, empty.fault) == ("", "", "")
    assert plate.semi_axes[0] == pytest.approx(0.0, abs=1e-8)
    assert not np.any(plate.imaginary)
    assert not empty.drawable


def test_a_broken_triangle_is_a_disc_with_a_spike() -> None:
    inertia = np.diag([1.0, 1.0, 3.0])  # second moments 1.5, 1.5 and -0.5
    found = solid("body", from_com(2.0, [0.0, 0.0, 0.0], inertia))
    np.testing.assert_allclose(found.mean_square, [-0.25, 0.75, 0.75])
    np.testing.assert_allclose(found.imaginary, [np.sqrt(1.25), 0.0, 0.0])
    np.testing.assert_allclose(np.abs(found.axes[:, 0]), [0.0, 0.0, 1.0], atol=1e-12)
    assert found.fault == "mean square −0.25 m²"


@pytest.mark.parametrize("case", IMPOSSIBLE)
@pytest.mark.slow
def test_anything_can_be_drawn_and_is_named(case: str) -> None:
    phi, said = IMPOSSIBLE[case]
    robots = {"before": with_body(phi), "after": arm()}
    assert said in solid("fore", phi).fault
    whole, parts = inertia_ellipsoids(robots), inertia_sections(robots)
    assert drawn(whole)
    assert drawn(parts)
    if said:
        assert "before: 1 of 2 bodies impossible" in words(whole)
        assert "after: all bodies possible" in words(whole)
        assert said in words(parts)


def test_joint_frames_are_where_pinocchio_has_them() -> None:
    robot, q = arm(), np.array([0.7, -1.2])
    model = robot.pinocchio()
    data = model.createData()
    pin.forwardKinematics(model, data, q)  # pyright: ignore[reportAttributeAccessIssue]
    # Of many postures the second, among which none may take the place of another.
    rotations, origins = (one[1] for one in poses(robot, np.stack([-q, q, 0 * q])))
    for k, name in enumerate(robot.names):
        placement = data.oMi[model.getJointId(name)]
        np.testing.assert_allclose(rotations[k], placement.rotation, atol=1e-12)
        np.testing.assert_allclose(origins[k], placement.translation, atol=1e-12)


def test_a_sliding_joint_moves_along_its_axis() -> None:
    text = """<robot name="r"><link name="base"/>
      <link name="carriage"><inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
      <joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/>
        <origin xyz="0 0 0.2" rpy="0 0 0"/><axis xyz="1 0 0"/>
        <limit lower="0.1" upper="0.5" velocity="1" effort="1"/></joint></robot>"""
    robot = Robot.from_text(text)
    np.testing.assert_allclose(poses(robot, np.array([0.3]))[1], [[0.3, 0.0, 0.2]])
    two = poses(robot, np.array([[0.3], [0.4]]))[1]
    np.testing.assert_allclose(two, [[[0.3, 0.0, 0.2]], [[0.4, 0.0, 0.2]]])
    assert drawn(inertia_ellipsoids({"one": robot}))


def test_possible_robots_show_nothing_red() -> None:
    figure = inertia_ellipsoids({"given": with_body(POSSIBLE)}, q=[0.3, 0.5])
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert labels == ["possible body"]
    assert "upper" in words(figure) and "fore" in words(figure)


def test_names_are_no_mathematics() -> None:
    figure = inertia_sections({"$a": arm(), "b$": arm()})
    assert drawn(figure)


def test_what_cannot_be_compared_is_refused() -> None:
    robot = arm()
    other = Robot(robot.name, robot.joints[:1], robot.links[:2])
    for draw in (inertia_ellipsoids, inertia_sections):
        with pytest.raises(DynidentError, match="no robot"):
            draw({})
        with pytest.raises(DynidentError, match="'b' has other bodies"):
            draw({"a": robot, "b": other})
    with pytest.raises(DynidentError, match=r"q has shape \(1,\)"):
        inertia_ellipsoids({"a": robot}, q=[0.0])
    with pytest.raises(DynidentError, match="no plane 'xx'"):
        inertia_sections({"a": robot}, plane="xx")


def test_second_moments_come_back() -> None:
    found = solid("body", frame_change(R, P) @ POSSIBLE)
    inertia = to_com(frame_change(R, P) @ POSSIBLE).inertia_com
    second = 3.0 * found.axes @ np.diag(found.mean_square) @ found.axes.T
    np.testing.assert_allclose(np.trace(second) * np.eye(3) - second, inertia, atol=1e-12)
