"""Positions of linear axes in mm, or of the motor behind a screw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.wiring import check_wiring
from slides import gantry, recorded
from synthetic import synthetic, true_values

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


_LINK = """<link name="{0}"><inertial><origin xyz="{1}"/><mass value="{2}"/>
<inertia ixx="{3}" iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
_JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="{4}"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1000" velocity="5"/></joint>"""
SCARA = "".join(
    (
        '<robot name="scara"><link name="base"/>',
        _LINK.format("upper", "0.2 0 0", 9, 0.1),
        _LINK.format("fore", "0.15 0 0", 6, 0.05),
        _LINK.format("quill", "0.03 0 0", 3, 0.02),
        _LINK.format("tool", "0.03 0.01 -0.03", 0.6, 0.002),
        _JOINT.format("j1", "revolute", "base", "upper", "0 0 0.3"),
        _JOINT.format("j2", "revolute", "upper", "fore", "0.35 0 0"),
        _JOINT.format("j3", "prismatic", "fore", "quill", "0.3 0 0"),
        _JOINT.format("j4", "revolute", "quill", "tool", "0 0 -0.1"),
        "</robot>",
    )
)


def test_degrees_beside_mm_are_no_gears() -> None:
    """A slide goes too far whatever the angles are; gears take what friction at stops does."""
    model = Model(Robot.from_text(SCARA)) + "viscous_friction" + "coulomb_friction"
    values = true_values(model, Fv__j1=3.0, Fv__j2=1.5, Fv__j3=20.0, Fv__j4=0.04)
    units = np.array([180.0 / np.pi, 180.0 / np.pi, 1e3, 180.0 / np.pi])
    parts = [synthetic(model, values, k, rate_hz=250.0, torque_std=0.05) for k in (0, 1)]
    found = check_wiring(model, Dataset(tuple(_standing(one, units) for one in parts)))
    assert [(one.kind, one.joints) for one in found] == [
        ("degrees", ("j1", "j2", "j4")),
        ("millimetres", ("j3",)),
    ]


def _standing(one: Recording, units: np.ndarray) -> Recording:
    """The recording in other units, with friction at low speeds that no law of them gives."""
    v = np.gradient(one.q, one.t, axis=0)
    angle = np.arange(one.samples)[:, None] / 40 + np.arange(one.n)
    more = np.where(abs(v) < 0.25 * v.std(axis=0), np.sin(angle), 0.0)
    return one.replace(q=one.q * units, tau=one.tau + more * np.array([4.0, 2.5, 9.0, 0.25]))
