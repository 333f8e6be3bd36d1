"""Ripple along a rail: some frequency of the grid is near enough to any line to be refined."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.effects import catalogue
from dynident.robot import Robot

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
