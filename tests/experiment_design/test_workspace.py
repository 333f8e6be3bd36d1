"""Boxes to stay in and obstacles: kept between the instants that were looked at, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.errors import DesignError, DynidentError
from dynident.experiment_design import DesignTask, MotionLimits, design
from dynident.experiment_design.geometry.clearance import Clearance
from dynident.experiment_design.geometry.robot_shapes import RobotShapes
from dynident.experiment_design.geometry.surroundings import BoxEntry, Obstacle, StayBox
from dynident.experiment_design.motion_program import FINER
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from folding_arm import MARGIN, RADIUS, folding
from synthetic import synthetic

TIP = '[[boxes]]\njoint = "j2"\npoint = [0.3, 0.0, 0.0]\nlower = [0.2, -0.1, {low}]\nupper = {up}\n'


def tip(q: np.ndarray) -> np.ndarray:
    """Where the third link ends, (T, 3) m: seen from the base, by hand."""
    angles = np.cumsum(q, axis=1)
    x, z = 0.3 * np.cos(angles).sum(axis=1), -0.3 * np.sin(angles).sum(axis=1)
    return np.stack([x, np.zeros(len(q)), z], axis=1)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return folding()


@pytest.fixture(scope="module")
def data(robot: Robot) -> Dataset:
    model = Model(robot)
    return Dataset((synthetic(model, model.given_values(), 1, torque_std=0.02),))


def limits(robot: Robot, folder: Path, text: str) -> MotionLimits:
    path = folder / "limits.toml"
    path.write_text(text)
    return MotionLimits.from_file(path, robot)


def test_points_of_a_robot_are_where_geometry_has_them(robot: Robot, tmp_path: Path) -> None:
    (box,) = limits(robot, tmp_path, TIP.format(low=-0.4, up="[0.9, 0.1, 0.4]")).boxes
    q = np.random.default_rng(0).uniform(-2.6, 2.6, (50, 3))
    np.testing.assert_allclose(box.places(q), tip(q), atol=1e-12)
    inside = np.all((tip(q) >= box.lower) & (tip(q) <= box.upper), axis=1)
    np.testing.assert_array_equal(box.room(q) >= 0, inside)


def test_places_agree_with_drake_on_an_arm_in_space() -> None:
    path = Path(__file__).parents[2] / "problems" / "iiwa" / "iiwa.urdf"
    arm = Robot.from_file(path)
    point = [0.1, -0.2, 0.05]
    entry = BoxEntry(joint=arm.names[-1], point=point, lower=[-1.0] * 3, upper=[1.0] * 3)
    q = arm.random_motion(0, 5)[0]
    shapes = RobotShapes.of(arm)
    plant, context = shapes.plant, shapes.plant.CreateDefaultContext()
    body = plant.GetJointByName(arm.names[-1]).child_body()
    for one, place in zip(q, StayBox.of(entry, arm, "").places(q), strict=True):
        plant.SetPositions(context, shapes.positions(one, plant.GetPositions(context)))
        expected = plant.EvalBodyPoseInWorld(context, body).multiply(np.array(point))
        np.testing.assert_allclose(place, expected, atol=1e-12)


@pytest.mark.slow
def test_a_designed_motion_stays_in_its_box(robot: Robot, data: Dataset, tmp_path: Path) -> None:
    task = DesignTask(duration=6.0, repeat=1, harmonics=4, starts=1)
    t = np.linspace(0.0, 6.0, 10 * FINER * 110)
    bounds = limits(robot, tmp_path, TIP.format(low=-0.3, up="[0.95, 0.1, 0.3]"))
    free = design(Model(robot), data, task, limits=MotionLimits.of(robot))
    (box,) = bounds.boxes
    assert box.room(free.trajectory.at(t)[0]).min() < -0.05  # else this shows nothing
    found = design(Model(robot), data, task, limits=bounds)
    places = tip(found.trajectory.at(t)[0])
    assert np.all(places >= box.lower) and np.all(places <= box.upper)
    assert np.ptp(places[:, 2]) > 0.1  # it moves all the same


def test_an_obstacle_counts_as_a_link_does(robot: Robot) -> None:
    centre = np.array([0.5, 0.0, 0.4])
    ball = Obstacle(centre, np.array([0.1]))
    clearance = Clearance.of(robot, MARGIN, (ball,))
    q = np.random.default_rng(0).uniform(-2.6, 2.6, (300, 3))
    without = Clearance.of(robot, MARGIN).along(q)
    # The balls of the robot: in its first link, and at its tip.
    first = np.stack([0.1 * np.cos(q[:, 0]), 0 * q[:, 0], -0.1 * np.sin(q[:, 0])], axis=1)
    gaps = [np.linalg.norm(one - centre, axis=1) - RADIUS - 0.1 for one in (first, tip(q))]
    expected = np.min([without, *gaps], axis=0)
    assert (expected < without - 0.01).any()
    np.testing.assert_allclose(clearance.along(q), expected, atol=1e-6)


def test_an_obstacle_around_the_robot_is_refused(robot: Robot) -> None:
    around = Obstacle(np.zeros(3), np.array([3.0, 3.0, 3.0]))
    with pytest.raises(DesignError, match="wherever the robot stands"):
        Clearance.of(robot, MARGIN, (around,))


def test_obstacles_are_never_passed_over(robot: Robot, data: Dataset, tmp_path: Path) -> None:
    text = "[[obstacles]]\ncentre = [0.5, 0.0, 0.4]\nradius = 0.1\n"
    with pytest.raises(DesignError, match="clearance"):
        design(Model(robot), data, limits=limits(robot, tmp_path, text))


def test_a_box_out_of_reach_is_said(robot: Robot, data: Dataset, tmp_path: Path) -> None:
    bounds = limits(robot, tmp_path, TIP.format(low=2.0, up="[0.9, 0.1, 2.5]"))
    task = DesignTask(duration=6.0, harmonics=3, starts=1)
    with pytest.raises(DesignError, match="stays in its boxes"):
        design(Model(robot), data, task, limits=bounds)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TIP.format(low=-0.3, up="[0.9, 0.1, -0.4]"), "no inside"),
        (TIP.format(low=-0.3, up="[0.9, 0.1]"), "upper"),
        (TIP.format(low="nan", up="[0.9, 0.1, 1.0]"), "lower"),
        (TIP.format(low=0, up="[1.0, 1.0, 1.0]").replace("j2", "j3"), "no joint 'j3'"),
        ("[[obstacles]]\ncentre = [0.0, 0.0, 0.0]\n", "radius"),
        ("[[obstacles]]\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\nradius = 1\n", "radius"),
        ("[[obstacles]]\ncentre = [0, 0, 0]\nradius = -1\n", "radius"),
        ("[[obstacles]]\ncentre = [0, 0, 0]\nsize = [1, 0, 1]\n", "size"),
        ("[[obstacle]]\ncentre = [0, 0, 0]\nradius = 1\n", "obstacle"),
        ("[joints.j0]\nlower = 1.0\nupper = 1.0\n", "lower below upper"),
        ("[joints.j0]\nspeed = 0.0\n", "speed"),
        ("[joints.j9]\nspeed = 1.0\n", "no joint 'j9'"),
        ("joints = 3\n", "joints"),
        ("[[boxes]", "TOML"),
    ],
)
def test_bad_limits_are_one_line(robot: Robot, tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DynidentError, match=said) as caught:
        limits(robot, tmp_path, text)
    assert "\n" not in str(caught.value) and "limits.toml" in str(caught.value)
