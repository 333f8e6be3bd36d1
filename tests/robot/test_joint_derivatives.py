"""Derivatives by one joint's motion, whichever way they are evaluated, are columns of all."""

import numpy as np
import pytest
from random_trees import joint_names, random_tree, urdf

from chains import chain
from dynident.robot import Robot, dynamics
from dynident.robot.joint_derivatives import JointDerivatives


@pytest.mark.parametrize("samples", [30, 3000])
@pytest.mark.parametrize("most", [1, 12], ids=["many joints", "few joints"])
def test_a_joints_derivatives_are_columns_of_all(samples, most, monkeypatch) -> None:
    monkeypatch.setattr(dynamics, "_FEW_JOINTS", most)
    robot = chain(3)
    motion = robot.random_motion(0, samples)
    found = JointDerivatives(robot, *motion)
    written = robot.torque_derivatives_by(0, *motion) is not None
    assert written == (samples >= dynamics._MANY and most > 3)
    # Of so few samples through Pinocchio.
    parts = [
        robot.torque_derivatives(*part)
        for part in zip(*(np.split(x, 10) for x in motion), strict=True)
    ]
    for joint in (2, 0, 1, 2):
        one = found.by(joint)
        for name in ("by_q", "by_v", "by_a"):
            every = np.concatenate([getattr(part, name) for part in parts])
            np.testing.assert_allclose(
                getattr(one, name), every[:, :, joint], atol=1e-13 * np.abs(every).max()
            )
    assert found.by(1) is found.by(1)


@pytest.mark.parametrize("seed", range(1, 5))
def test_derivatives_by_all_joints_are_those_of_few_samples(seed, monkeypatch) -> None:
    """Of three joints, on branches and in any order, which are functions of many samples."""
    bodies = random_tree(seed, moving=3)
    order = np.random.default_rng(seed).permutation(joint_names(bodies))
    robot = Robot.from_text(urdf(bodies), joints=list(order))
    motion = robot.random_motion(seed, dynamics._MANY)
    asked, kernel = [], dynamics.torque_derivative_kernel
    monkeypatch.setattr(
        dynamics,
        "torque_derivative_kernel",
        lambda tree, joint: asked.append(joint) or kernel(tree, joint),
    )
    found = robot.torque_derivatives(*motion)
    assert asked == [0, 1, 2]
    wanted = robot.torque_derivatives(*(x[:30] for x in motion))
    # Where joints only slide, those by speeds are rounding errors of the others.
    size = max(np.abs(x).max() for x in (wanted.by_q, wanted.by_v, wanted.by_a))
    for name in ("by_q", "by_v", "by_a"):
        few = getattr(wanted, name)
        np.testing.assert_allclose(getattr(found, name)[:30], few, rtol=1e-12, atol=1e-14 * size)
