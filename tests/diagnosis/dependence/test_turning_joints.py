"""What is left at a joint that turns on and on: whole turns tell nothing of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.diagnosis.dependence.joint_inputs import joint_inputs
from dynident.diagnosis.dependence.motion_blocks import motion_blocks
from dynident.diagnosis.dependence.residual_record import (
    FittedBody,
    ResidualRecord,
    joints_turning_round,
)
from dynident.robot import Robot
from residuals import record, rough_friction, shares_of
from synthetic import ARM, arm

ROUND = FittedBody(Robot.from_text(ARM.replace('"revolute"', '"continuous"')), np.zeros(2))


def turning(seed: int) -> ResidualRecord:
    """Joint 0 turns up to fifty times either way, with friction that depends on its angle."""
    one = record(seed, {})
    w = 2 * np.pi / 30.0
    way, speed = 60.0 * np.sin(w * one.t), 60.0 * w * np.cos(w * one.t)
    q, v = one.q + np.outer(way, [1.0, 0.0]), one.v + np.outer(speed, [1.0, 0.0])
    law = rough_friction(one.t, q, v / 10.0, one.a)
    residual = one.residual + np.outer(law, [2.0, 0.0])
    return replace(one, q=q, v=v, load=one.a, residual=residual, body=ROUND)


@pytest.mark.slow
def test_a_law_of_the_angle_is_found() -> None:
    one = turning(1)
    assert joints_turning_round((one,)).tolist() == [True, False]
    share = shares_of(one).by["position and velocity"]
    assert share.told
    blind = shares_of(replace(one, body=FittedBody(arm(), np.zeros(2))))
    assert share.value > blind.by["position and velocity"].value + 0.2


def test_inputs_are_the_same_after_a_turn() -> None:
    one = turning(1)
    on = replace(one, q=one.q + np.array([2 * np.pi, 0.0]))
    for joint in (0, 1):
        first, second = joint_inputs((one,), joint), joint_inputs((on,), joint)
        np.testing.assert_allclose(first.position, second.position, atol=1e-9)
        np.testing.assert_allclose(first.others[0], second.others[0], atol=1e-9)


def test_a_motion_that_comes_again_some_turns_on_is_a_repetition() -> None:
    one = turning(2)
    again = replace(one, source="again", q=one.q + np.array([20 * np.pi, 0.0]))
    blocks = motion_blocks((one, again), [0])
    first, second = np.split(blocks.unit, 2)
    assert np.mean(first == second) > 0.99
