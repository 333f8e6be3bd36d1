"""The two branching robots: estimate, project, control."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import dynident as di
from dynident.closed_loop import Mechanism
from dynident.fitting import Metric
from dynident.inertia import margins
from problem_scripts import PROBLEMS, script

tracking = script(".", "tracking")

ROBOTS = {"vision_head": (7, "head", 2), "anthropomorphic_arm": (10, "hand", 3)}
SHORT = 3.0
"""s that a loop is followed for."""


def experiment(problem: str) -> di.closed_loop.Experiment:
    return di.closed_loop.load_experiment(PROBLEMS / problem / "experiment.toml")


@pytest.fixture(scope="module")
def head() -> Any:
    return tracking.setting(PROBLEMS / "vision_head", 420 * 20)


@pytest.mark.parametrize("problem", ROBOTS)
def test_robots_branch_and_can_exist(problem: str) -> None:
    joints, fork, branches = ROBOTS[problem]
    one = experiment(problem)
    assert one.nominal is not None
    for robot in (one.robot, one.nominal):
        assert robot.n == joints
        at = robot.bodies.index(fork)
        assert [joint.parent for joint in robot.joints].count(at) == branches
        assert all(margins(phi).consistent for phi in robot.theta.reshape(-1, 10))
    assert not np.allclose(one.robot.theta, one.nominal.theta)


def test_the_model_lacks_what_is_hidden(
    head: Any,
) -> None:
    # Ten inertial parameters and a friction each, less those that no motion tells.
    assert head.model.size == head.model.base.rank + head.experiment.robot.n
    assert {effect.name for effect in head.model.effects} == {"viscous_friction"}
    assert any(one.hidden for one in head.experiment.effects)
    assert sum(recording.samples for recording in head.dataset.recordings) == 420 * 20


def test_motions_stay_within_the_joints(head: Any) -> None:
    robot = head.experiment.robot
    t = np.linspace(0.0, head.published["period"], 2000)
    for seed in range(5):
        q, v, _ = tracking.sinusoids(robot, seed, head.published).at(t)
        assert np.all(np.abs(q) <= [joint.upper for joint in robot.joints])
        assert np.all(np.abs(v) <= [joint.velocity for joint in robot.joints])


@pytest.mark.slow
def test_a_true_model_follows_best_and_a_wrong_one_is_lost(head: Any) -> None:
    truth = head.experiment.mechanism()
    metric = Metric.of_data(head.model, head.dataset)
    estimate = di.project(di.fit(head.model, head.dataset), metric=metric).estimate
    (best,) = tracking.tracked(head, truth, 1, SHORT)
    (found,) = tracking.tracked(head, tracking.believed(estimate), 1, SHORT)
    assert best.position < found.position < 0.1
    # Friction believed ten times too strong is drive instead of damping.
    values = np.array(estimate.values)
    friction = [k for k, name in enumerate(estimate.model.names) if name.startswith("Fv@")]
    values[friction] *= 10.0
    wrong = Mechanism.of_model(estimate.model, values, estimate.robot.theta)
    assert tracking.tracked(head, wrong, 1, SHORT) == ()


def test_a_controller_that_cannot_be_is_no_failure_of_an_estimate(head: Any) -> None:
    settings = {**head.published["controller"], "damping": -1.0}
    wrong = replace(head, published={**head.published, "controller": settings})
    with pytest.raises(di.errors.SimulationError, match=r"controller\.kd"):
        tracking.tracked(wrong, head.experiment.mechanism(), 1, SHORT)


@pytest.mark.slow
def test_adding_the_missing_friction_is_worth_more_than_any_regression() -> None:
    """Every method, projected, in the loop; one of them in the arm, too."""
    found = tracking.trial(PROBLEMS / "vision_head", 420 * 20, 1, 1)
    assert tuple(found) == tracking.EVERY
    assert not any(isinstance(one, str) or not one for one in found.values())
    off = {name: one.position for name, (one,) in found.items()}
    best = min(off[name] for name in tracking.METHODS)
    assert all(off[name] < 0.7 * best for name in tracking.ADDED)
    assert off["dry friction added"] < 0.5 * off["least squares"]
    ((name, arm),) = tracking.trial(
        PROBLEMS / "anthropomorphic_arm", 480 * 20, 1, 1, ["dry friction added"]
    ).items()
    assert name == "dry friction added" and arm[0].position < 0.1


def test_the_table_tells_means_over_training_sets_and_failures() -> None:
    sound = tracking.Tracking(0.02, 0.2, 0.4)
    worse = replace(sound, position=0.03)
    trials = [
        {"a": (sound, sound), "b": (sound, worse), "c": (), "d": "no robot"},
        {"a": (sound, sound), "b": (worse, worse), "c": (sound, sound), "d": "no robot"},
    ]
    a, b, c, d = tracking.table(trials, {"b": [1, 2, 3]}).rows
    assert a == ("a", "0.02 +- 0", "0.2 +- 0", "0.4 +- 0", "", "", "")
    # 0.025 and 0.03: 25 and 50 % more.
    assert b[1] == "0.0275 +- 0.002" and b[4:] == ("+37.5 +- 12.5 %", "1 / 2 / 3", "")
    assert c[1:5] == ("FAILURE in 1 of 2",) * 3 + ("",)
    assert d[1:] == ("FAILURE in 2 of 2",) * 3 + ("", "", "no robot")
    (alone,) = tracking.table([{"a": ()}], {}).rows
    assert alone[1:4] == ("FAILURE",) * 3
