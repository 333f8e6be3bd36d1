"""Positions of linear axes in mm, or of the motor behind a screw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.recording import Dataset, Recording
from dynident.wiring import check_wiring
from slides import gantry, recorded

TRUE = recorded()


def changed(q: np.ndarray, tau: np.ndarray) -> Dataset:
    def one(recording: Recording) -> Recording:
        return recording.replace(q=recording.q * q, tau=recording.tau * tau)

    return Dataset(tuple(one(each) for each in TRUE.recordings))


def test_lengths_in_m_are_no_fault() -> None:
    assert check_wiring(gantry(), TRUE) == ()


def test_a_slide_beyond_narrow_limits_is_in_m_where_its_mass_says_so() -> None:
    model, robot = gantry(), gantry().robot
    joints = (replace(robot.joints[0], lower=-0.5, upper=0.6), *robot.joints[1:])
    narrow = replace(model, robot=replace(robot, joints=joints))
    assert check_wiring(narrow, TRUE) == ()


@pytest.mark.parametrize("joints", [("x", "y"), ("x",), ("y",)])
def test_lengths_in_mm_are_named_with_their_line_and_forces_left_alone(
    joints: tuple[str, ...],
) -> None:
    scale = np.array([1e3 if name in joints else 1.0 for name in ("x", "y")])
    (fault,) = check_wiring(gantry(), changed(scale, np.ones(2)))
    assert (fault.kind, fault.joints) == ("millimetres", joints)
    lines = tuple(f'"q.{name}" = {{ name = "q.{name}", scale = 0.001 }}' for name in joints)
    assert fault.mend == lines
    assert "in mm, not m" in fault.sentence


def test_of_a_screw_no_ratio_is_proposed() -> None:
    """Another mass makes up for another lead: the line would be one of many that fit alike."""
    ratio = 2 * np.pi / 0.02
    found = check_wiring(gantry(), changed(np.array([1.0, ratio]), np.array([1.0, 1 / ratio])))
    assert found and found[0].joints == ("y",) and found[0].kind != "millimetres"
    assert "screw" in found[0].what and found[0].mend == ()
    assert "take it from the drive's data" in found[0].sentence


def test_a_motor_s_radians_with_the_force_of_the_slide_are_no_mm() -> None:
    (fault,) = check_wiring(gantry(), changed(np.array([1.0, 2 * np.pi / 0.02]), np.ones(2)))
    assert fault.kind != "millimetres" and fault.mend == ()
