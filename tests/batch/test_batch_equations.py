"""Functions of many samples against Pinocchio's own, sample by sample."""

from typing import Any

import numpy as np
import pinocchio
import pytest
from random_trees import joint_names, random_tree, urdf

from chains import chain
from dynident.batch import (
    joint_space_tape,
    kernel,
    regressor_kernel,
    tape,
    torque_derivative_kernel,
    torque_kernel,
)
from dynident.robot import Robot, structural_base

pin: Any = pinocchio  # its bindings carry no types

GRAVITIES = [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (3.0, -9.0, 1.5)]


def robot_of(seed: int, gravity=GRAVITIES[2]) -> Robot:
    """A tree with branches, turning and sliding joints about any axis, and fixed links."""
    bodies = random_tree(seed, moving=6)
    order = np.random.default_rng(seed).permutation(joint_names(bodies))
    return Robot.from_text(urdf(bodies), joints=list(order), gravity=gravity)


def tree_of(robot: Robot):
    return robot.joint_tree


def through_pinocchio(robot: Robot, q, v, a) -> np.ndarray:
    model = robot.pinocchio()
    data = model.createData()
    index = np.array([model.joints[model.getJointId(name)].idx_v for name in robot.names])
    columns = (10 * index[:, None] + np.arange(10)).ravel()
    out = np.empty((len(q), robot.n, 10 * robot.n))
    for k in range(len(q)):
        x, w, d = np.zeros(robot.n), np.zeros(robot.n), np.zeros(robot.n)
        x[index], w[index], d[index] = q[k], v[k], a[k]
        Y = pin.computeJointTorqueRegressor(model, data, x, w, d)
        out[k] = Y[np.ix_(index, columns)]
    return out


@pytest.mark.parametrize("gravity", GRAVITIES)
@pytest.mark.parametrize("seed", range(6))
def test_regressor_and_torque_are_pinocchios(seed, gravity):
    robot = robot_of(seed, gravity)
    q, v, a = robot.random_motion(seed, 40)
    want = through_pinocchio(robot, q, v, a)
    got = regressor_kernel(tree_of(robot), tuple(range(10 * robot.n)))(q, v, a)
    assert np.abs(got - want).max() < 1e-14 * np.abs(want).max()
    torque = torque_kernel(tree_of(robot))(q, v, a, parameters=robot.theta.tolist())
    size = (np.abs(want) @ np.abs(robot.theta)).max()
    assert np.abs(torque - want @ robot.theta).max() < 1e-14 * size


@pytest.mark.parametrize("seed", range(6))
def test_joint_space_inertia_and_bias_are_pinocchios(seed):
    robot = robot_of(seed)
    n, tape = robot.n, joint_space_tape(tree_of(robot))
    q, v, _ = robot.random_motion(seed, 40)
    still = np.zeros(n)
    inputs = [*np.cos(q).T, *np.sin(q).T, *q.T, *v.T, *np.full((n, 40), np.nan), *robot.theta]
    results = list(np.empty((n * (n + 1) // 2 + n, 40)))
    tape.replay(inputs, results)
    torque = torque_kernel(tree_of(robot))(q, v, 0 * v, parameters=robot.theta.tolist())
    scale = np.abs(torque).max()
    np.testing.assert_allclose(np.array(results[-n:]).T, torque, rtol=0, atol=1e-14 * scale)
    model = robot.pinocchio()
    data = model.createData()
    index = np.array([model.joints[model.getJointId(name)].idx_v for name in robot.names])
    for k in range(40):
        x = still.copy()
        x[index] = q[k]
        upper = np.triu(pin.crba(model, data, x))
        M = (upper + upper.T - np.diag(np.diag(upper)))[np.ix_(index, index)]
        found = [row[k] for row in results[:-n]]
        np.testing.assert_allclose(found, M[np.tril_indices(n)], rtol=0, atol=1e-13 * M.max())


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_by_one_joint_are_pinocchios(seed):
    robot = robot_of(seed)
    motion = robot.random_motion(seed, 40)
    every = robot.torque_derivatives(*motion)
    wanted = np.stack([every.by_q, every.by_v, every.by_a], axis=1)
    scale = np.abs(wanted).max(axis=(0, 2, 3))
    for joint in range(robot.n):
        kernel = torque_derivative_kernel(tree_of(robot), joint)
        found = kernel(*motion, parameters=robot.theta.tolist())
        error = np.abs(found - wanted[..., joint]).max(axis=(0, 2))
        assert np.all(error < 1e-14 * scale)


def test_axes_against_the_frames_and_tidy_frames_are_as_exact():
    """Where a frame is turned by a right angle, and an axis points backwards."""
    placements = [("1.5707963267948966 0 0", "0 0 -1"), ("0 -1.5707963267948966 3.1", "0 1 0")]
    parts = ['<robot name="r"><link name="b"/>']
    for k, (rpy, axis) in enumerate(placements * 2):
        kind = "prismatic" if k == 2 else "revolute"
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/>'
            '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
            f'<joint name="j{k}" type="{kind}"><parent link="{f"l{k - 1}" if k else "b"}"/>'
            f'<child link="l{k}"/><origin xyz="0 0.4 0" rpy="{rpy}"/><axis xyz="{axis}"/>'
            '<limit lower="-2" upper="2" velocity="3" effort="9"/></joint>'
        )
    robot = Robot.from_text("".join(parts) + "</robot>")
    q, v, a = robot.random_motion(0, 40)
    want = through_pinocchio(robot, q, v, a)
    got = regressor_kernel(tree_of(robot), tuple(range(40)))(q, v, a)
    assert np.abs(got - want).max() < 1e-14 * np.abs(want).max()


def test_some_columns_are_those_of_all():
    robot = robot_of(1)
    motion = robot.random_motion(0, 20)
    every = regressor_kernel(tree_of(robot), tuple(range(10 * robot.n)))(*motion)
    some = structural_base(robot).independent
    np.testing.assert_array_equal(
        regressor_kernel(tree_of(robot), some)(*motion), every[:, :, list(some)]
    )


@pytest.mark.parametrize("samples", [0, 1, 63, 64, 65, 128, 150])
def test_a_sample_does_not_depend_on_its_block(samples, monkeypatch):
    monkeypatch.setattr(tape, "BLOCK", 64)
    robot = chain(3)
    kernel = regressor_kernel(tree_of(robot), tuple(range(30)))
    motion = [x.copy() for x in robot.random_motion(0, samples)]
    whole = kernel(*motion)
    assert whole.shape == (samples, 3, 30)
    for k in range(samples):
        np.testing.assert_array_equal(whole[k], kernel(*(x[k : k + 1] for x in motion))[0])


def test_a_function_belongs_to_the_joints_and_gravity_alone():
    robot = chain(3)
    heavier = robot.with_theta(2.0 * robot.theta)
    assert torque_kernel(tree_of(robot)) is torque_kernel(tree_of(heavier))
    assert tree_of(robot) != tree_of(robot.with_gravity([0, 0, 0]))


def test_many_samples_are_what_few_are():
    """Through the robot: at the number from which a function of many samples is made."""
    robot = chain(7)
    motion = robot.random_motion(0, 3000)
    few = [x[:50] for x in motion]
    columns = structural_base(robot).independent
    want, got = robot.regressor(*few), robot.regressor(*motion)[:50]
    scale = np.abs(want).max()
    assert np.any(want != got), "both were made alike"
    assert np.abs(want - got).max() < 1e-14 * scale
    kept = list(columns)
    np.testing.assert_array_equal(robot.regressor(*few, columns=columns), want[:, :, kept])
    np.testing.assert_array_equal(robot.regressor(*motion, columns=columns)[:50], got[:, :, kept])
    torque = robot.inverse_dynamics(*motion)[:50]
    assert np.abs(torque - robot.inverse_dynamics(*few)).max() < 1e-13 * np.abs(torque).max()


def test_many_samples_take_any_parameters():
    """Also a first moment without mass, and numbers that are none."""
    robot = chain(2)
    motion = robot.random_motion(0, 9000)
    theta = np.random.default_rng(0).normal(size=20)
    theta[[0, 10]] = 0.0
    want = robot.regressor(*motion) @ theta
    assert np.abs(robot.inverse_dynamics(*motion, theta) - want).max() < 1e-13 * abs(want).max()
    theta[3] = np.nan
    assert np.all(np.isnan(robot.inverse_dynamics(*motion, theta)))


def test_motions_met_before_are_as_those_that_are_new():
    """Cosines are kept: of joints that stand where they stood, and of arrays as they were then."""
    robot = chain(3)
    made = torque_kernel(robot.joint_tree)
    q, v, a = robot.random_motion(0, 300)
    elsewhere, at_the_end, reused = q.copy(), q.copy(), q.copy()
    elsewhere[:, 1] += 0.1
    at_the_end[-1, 0] += 0.1
    motions = (
        q,
        elsewhere,
        at_the_end,
        q[:200],
        q,
        *np.random.default_rng(0).normal(size=(4, 300, 3)),
    )

    def torques(positions):
        return made(
            positions, v[: len(positions)], a[: len(positions)], parameters=robot.theta.tolist()
        )

    wanted = []
    for one in motions:
        kernel._turned.clear()
        wanted.append(torques(one).copy())
    for _ in range(2):
        for one, want in zip(motions, wanted, strict=True):
            np.testing.assert_array_equal(torques(one), want)
            if len(one) == len(reused):
                reused[:] = one
                np.testing.assert_array_equal(torques(reused), want)
    assert len(kernel._turned) <= 4
