"""Derivatives by one joint's motion, whichever way they are evaluated, are columns of all."""

import numpy as np
import pytest

from chains import chain
from dynident.robot import dynamics
from dynident.robot.joint_derivatives import JointDerivatives


@pytest.mark.parametrize("samples", [30, 3000])
@pytest.mark.parametrize("most", [1, 12], ids=["many joints", "few joints"])
def test_a_joints_derivatives_are_columns_of_all(samples, most, monkeypatch) -> None:
    monkeypatch.setattr(dynamics, "_FEW_JOINTS", most)
    robot = chain(3)
    motion = robot.random_motion(0, samples)
    wanted, found = robot.torque_derivatives(*motion), JointDerivatives(robot, *motion)
    written = robot.torque_derivatives_by(0, *motion) is not None
    assert written == (samples > 2500 and most > 3)
    for joint in (2, 0, 1, 2):
        one = found.by(joint)
        for name in ("by_q", "by_v", "by_a"):
            every = getattr(wanted, name)
            np.testing.assert_allclose(
                getattr(one, name), every[:, :, joint], atol=1e-13 * np.abs(every).max()
            )
    assert found.by(1) is found.by(1)
