"""Ripple along a rail: some frequency of the grid is near enough to any line to be refined."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.effects import Block, catalogue, effects_of
from dynident.robot import Robot
from synthetic import arm

RAIL = """<robot name="rail"><link name="base"/>
<link name="carriage"><inertial><mass value="5"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slider" type="prismatic"><parent link="base"/><child link="carriage"/>
<axis xyz="1 0 0"/><limit lower="0" upper="0.25" effort="1" velocity="1"/></joint></robot>
"""
TRAVEL = 0.25  # m


@pytest.mark.parametrize("seed", range(5))
def test_a_line_anywhere_in_the_range_shows_on_a_short_rail(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, phase = rng.uniform(30.0, 3000.0), rng.uniform(0.0, 2 * np.pi)
    q = np.linspace(0.0, TRAVEL, 4000)
    true = np.sin(k * q + phase)
    (shape,) = catalogue()["torque_ripple"]("slider").shape_parameters(Robot.from_text(RAIL))
    columns = [np.stack([np.sin(g * q), np.cos(g * q)], axis=1) for g in shape.grid]
    left = min(float(np.linalg.lstsq(one, true)[1][0]) for one in columns)
    assert left < 0.2 * float(true @ true)


def test_whole_numbers_of_ripples_are_those_of_sine_and_cosine() -> None:
    """They are made of powers, which are shared: whatever was asked before, to the bit."""
    q = np.random.default_rng(0).uniform(-30.0, 30.0, (200, 2))
    still = np.zeros_like(q)
    shared, robot = _block(q, still), arm()
    for k in (1.0, 2.0, 31.0, 47.0, 60.0, 63.0, 64.0, 2.5):
        (ripple,) = (one.shaped(k) for one in effects_of("torque_ripple@elbow", robot))
        found = ripple.acting_columns(shared)[:, 0]
        want = np.column_stack([np.sin(k * q[:, 1]), np.cos(k * q[:, 1])])
        # A digit of k q is one of its angle.
        np.testing.assert_allclose(found, want, atol=4 * np.finfo(float).eps * k * 30.0)
        np.testing.assert_array_equal(ripple.acting_columns(_block(q, still))[:, 0], found)


def _block(q: np.ndarray, still: np.ndarray) -> Block:
    return Block(np.arange(len(q)) / 100.0, q, still, still, names=("shoulder", "elbow"))
