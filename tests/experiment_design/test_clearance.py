"""Motions that stay clear of the robot itself, checked by spheres whose distance is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.errors import DesignError
from dynident.experiment_design import DesignTask, MotionLimits, design
from dynident.experiment_design.geometry.clearance import Clearance
from dynident.experiment_design.motion_program import FINER
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from folding_arm import MARGIN, RADIUS, folding
from synthetic import synthetic


def true_distance(q: np.ndarray) -> np.ndarray:
    """Between the balls, (T,) m: seen from the first link, by hand."""
    elbow, wrist = q[:, 1], q[:, 1] + q[:, 2]
    x = 0.3 + 0.3 * np.cos(elbow) + 0.3 * np.cos(wrist)
    z = -0.3 * np.sin(elbow) - 0.3 * np.sin(wrist)
    return np.hypot(x - 0.1, z) - 2 * RADIUS


@pytest.fixture(scope="module")
def robot() -> Robot:
    return folding()


def recorded(robot: Robot) -> tuple[Model, Dataset]:
    model = Model(robot)
    return model, Dataset((synthetic(model, model.given_values(), 1, torque_std=0.02),))


def test_distances_are_those_of_the_shapes(robot: Robot) -> None:
    clearance = Clearance.of(robot, MARGIN)
    q = np.random.default_rng(0).uniform(-2.6, 2.6, (300, 3))
    expected = np.minimum(true_distance(q), MARGIN + 0.1)
    assert (expected < MARGIN).any() and not clearance.ignored
    np.testing.assert_allclose(clearance.along(q), expected, atol=1e-6)


@pytest.mark.slow
def test_designed_motions_stay_clear_between_the_instants_that_were_looked_at(robot: Robot) -> None:
    model, data = recorded(robot)
    task = DesignTask(duration=6.0, repeat=1, harmonics=4, starts=1)
    t = np.linspace(0.0, 6.0, 10 * FINER * 110)
    bent = {"lower": 0.3, "upper": 2.5}
    limits = MotionLimits.of(robot).changed({"j1": bent, "j2": bent}, robot)
    free = design(model, data, task, limits=limits)
    assert true_distance(free.trajectory.at(t)[0]).min() < MARGIN  # else this shows nothing
    found = design(model, data, replace(task, clearance=MARGIN), limits=limits)
    least = true_distance(found.trajectory.at(t)[0]).min()
    assert least >= MARGIN - 1e-6
    assert found.least_distance == pytest.approx(min(least, MARGIN + 0.1), abs=1e-4)
    assert "mm or more from each other" in " ".join(map(str, found.tables()))
    # Nor is that bought by standing still: it tells more than many clear random motions.
    program = found.program
    some = (program.within(program.motions.random(300 + k)) for k in range(10))
    assert found.motion.loss < min(program.loss(one) for one in some if one is not None)


def test_where_no_motion_is_clear_it_is_said(robot: Robot) -> None:
    model, data = recorded(robot)
    folded = MotionLimits.of(robot).changed(
        {"j1": {"lower": 2.2, "upper": 2.3}, "j2": {"lower": 1.9, "upper": 2.0}}, robot
    )
    task = DesignTask(duration=6.0, harmonics=3, starts=1, clearance=MARGIN)
    with pytest.raises(DesignError, match=r"usual motion|0\.03 m clear"):
        design(model, data, task, limits=folded)


@pytest.mark.parametrize("margin", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_margins_are_refused(robot: Robot, margin: float) -> None:
    with pytest.raises(DesignError, match="clearance"):
        Clearance.of(robot, margin)


def test_robots_without_geometry_are_refused() -> None:
    from synthetic import arm

    with pytest.raises(DesignError, match="no collision geometry"):
        Clearance.of(arm(), MARGIN)
