"""A seven-joint arm with encoders of three kinds: instruments against least squares."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import dynident as di
from dynident.fitting.history import Ending
from dynident.inertia import margins
from problem_scripts import PROBLEMS, script

PROBLEM = PROBLEMS / "iiwa"
table = script("iiwa", "table")
PUBLISHED = table.PUBLISHED
DURATION = 10.0
"""s: half of what is recorded for the table."""
LEVELS = [
    pytest.param(std, marks=() if std == 1e-4 else pytest.mark.slow)
    for std in PUBLISHED["position_std"]
]


@cache
def arm(position_std: float) -> Any:
    return table.arm(position_std, 1, DURATION)


@cache
def estimates(position_std: float) -> dict[str, di.Estimate]:
    return table.errors(arm(position_std))


@pytest.mark.parametrize("position_std", LEVELS)
@pytest.mark.slow
def test_instruments_beat_unfiltered_least_squares_and_cost_nothing_filtered(
    position_std: float,
) -> None:
    one = arm(position_std)
    found = {name: one.error(e) for name, e in estimates(position_std).items()}
    least = PUBLISHED["least_ratio"]
    assert found["least squares, unfiltered"] > least * found["instruments, unfiltered"]
    most = PUBLISHED["largest_loss"]
    assert found["instruments, filtered"] < (1.0 + most) * found["least squares, filtered"]
    for name in ("instruments, unfiltered", "instruments, filtered"):
        history = estimates(position_std)[name].history
        assert history is not None
        assert history.ending is Ending.CONVERGED
        assert len(history.rounds) <= 3


def test_the_arm_is_consistent_and_has_the_published_lengths() -> None:
    robot = di.load(PROBLEM / "study.toml").robot
    assert all(margins(phi).consistent for phi in robot.theta.reshape(-1, 10))
    heights = np.array([joint.p[2] for joint in robot.joints])
    lengths = [heights[:2].sum(), heights[2:4].sum(), heights[4:6].sum()]
    assert lengths == pytest.approx([0.36, 0.42, 0.40])


def test_gains_are_those_of_the_stated_poles() -> None:
    study = di.load(PROBLEM / "study.toml")
    assert study.controller is not None
    assert (
        study.controller == di.closed_loop.load_experiment(PROBLEM / "experiment.toml").controller
    )
    w = 2 * np.pi * np.array(PUBLISHED["natural_frequency_hz"])
    kp, kd = np.array(study.controller.kp), np.array(study.controller.kd)
    np.testing.assert_allclose(kd * w / (2 * kp), 1.0, rtol=0.05)  # damping 1


def test_recordings_are_those_of_the_experiment() -> None:
    experiment = di.closed_loop.load_experiment(PROBLEM / "experiment.toml")
    short = tuple(replace(run, duration=0.5) for run in experiment.runs)
    study = di.load(PROBLEM / "study.toml")
    kept = (*study.train.recordings, *study.test.recordings)
    for found, whole in zip(replace(experiment, runs=short).run(), kept, strict=True):
        one = whole.cut(0.0, 0.499)
        assert found.q_ref is not None and one.q_ref is not None
        np.testing.assert_allclose(found.q_ref, one.q_ref, atol=1e-9)
        np.testing.assert_allclose(found.q, one.q, atol=2e-4)


@pytest.mark.slow
def test_the_closing_table_ranks_estimators_as_the_readme_says() -> None:
    """One draw of three: known noise takes half of the error off, instruments nearly all."""
    rivals = script("iiwa", "rivals")
    found = rivals.rivals(1e-4, 1)
    torque = {name: one.torque for name, one in found.items()}
    assert 0.012 < torque["OLS"] < 0.018 and 0.012 < torque["ridge"] < 0.018
    assert torque["corrected LS, noise from the encoders"] < 0.5 * torque["OLS"]
    assert torque["corrected LS, noise from repetitions"] < 0.7 * torque["OLS"]
    assert torque["IV, simulated loop"] < 0.1 * torque["OLS"]
