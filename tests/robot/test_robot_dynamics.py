"""Regressor and inverse dynamics against Pinocchio's and Drake's own, on random trees."""

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import Any

import numpy as np
import pinocchio
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from random_trees import joint_names, random_tree, urdf

from dynident.robot import Robot
from dynident.robot.drake import add_to_plant

pin: Any = pinocchio  # its bindings carry no types

GRAVITIES = [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (3.0, -9.0, 1.5)]
SEEDS = range(8)


def relative(a, b):
    return np.max(np.abs(a - b)) / max(1.0, np.max(np.abs(b)))


def through_drake(robot, q, v, a):
    plant = MultibodyPlant(0.0)
    names = add_to_plant(robot, plant)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    iq, iv = names.position_indices(), names.velocity_indices()
    return inverse_dynamics(plant, context, iq, iv, q, v, a)


def inverse_dynamics(plant, context, iq, iv, q, v, a):
    from pydrake.multibody.tree import MultibodyForces

    forces = MultibodyForces(plant)
    out = np.empty_like(q)
    for k in range(len(q)):
        x, w, d = np.zeros(plant.num_positions()), np.zeros(len(iv)), np.zeros(len(iv))
        x[iq], w[iv], d[iv] = q[k], v[k], a[k]
        plant.SetPositions(context, x)
        plant.SetVelocities(context, w)
        plant.CalcForceElementsContribution(context, forces)
        out[k] = plant.CalcInverseDynamics(context, d, forces)[iv]
    return out


@pytest.mark.parametrize("gravity", GRAVITIES)
@pytest.mark.parametrize("seed", SEEDS)
def test_regressor_pinocchio_and_drake_agree(seed, gravity):
    robot = Robot.from_text(urdf(random_tree(seed)), gravity=gravity)
    q, v, a = robot.random_motion(seed, 5)
    tau = robot.regressor(q, v, a) @ robot.theta
    assert tau.shape == (5, robot.n)
    assert relative(robot.inverse_dynamics(q, v, a), tau) < 1e-12
    assert relative(through_drake(robot, q, v, a), tau) < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_agrees_with_the_parsers_where_inertias_are_valid(seed):
    """Kinematics, merging and gravity against models that we had no hand in."""
    source = urdf(random_tree(seed, moving=5))
    robot = Robot.from_text(source)
    q, v, a = robot.random_motion(seed, 5)
    tau = robot.inverse_dynamics(q, v, a)

    model = pin.buildModelFromXML(source)
    data = model.createData()
    index = [model.joints[model.getJointId(name)].idx_v for name in robot.names]
    got = np.empty_like(q)
    for k in range(len(q)):
        x, w, d = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)
        x[index], w[index], d[index] = q[k], v[k], a[k]
        got[k] = pin.rnea(model, data, x, w, d)[index]
    assert relative(got, tau) < 1e-10

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(source, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link_0"))
    plant.Finalize()
    joints = [plant.GetJointByName(name) for name in robot.names]
    iq, iv = [j.position_start() for j in joints], [j.velocity_start() for j in joints]
    context = plant.CreateDefaultContext()
    assert relative(inverse_dynamics(plant, context, iq, iv, q, v, a), tau) < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_broken_inertias_and_massless_links_have_exact_torques(seed):
    robot = Robot.from_text(urdf(random_tree(seed, moving=5, valid=False)))
    q, v, a = robot.random_motion(seed, 5)
    tau = robot.regressor(q, v, a) @ robot.theta
    assert relative(robot.inverse_dynamics(q, v, a), tau) < 1e-10


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_inverse_dynamics_takes_any_parameters(scale):
    """Also a first moment without mass, which no engine can represent as a body."""
    robot = Robot.from_text(urdf(random_tree(3)))
    rng = np.random.default_rng(0)
    q, v, a = robot.random_motion(1, 20)
    for zeros in ([], [0], [0, 10, 20, 30], [*range(10)]):
        theta = scale * rng.normal(size=10 * robot.n)
        theta[zeros] = 0.0
        want = robot.regressor(q, v, a) @ theta
        got = robot.inverse_dynamics(q, v, a, theta)
        assert np.max(np.abs(got - want)) < 1e-10 * np.max(np.abs(want))
    tiny = np.array(robot.theta)
    tiny[::10] = 1e-14
    want = robot.regressor(q, v, a) @ tiny
    assert relative(robot.inverse_dynamics(q, v, a, tiny), want) < 1e-10


def test_nan_parameters_give_nan_torques_and_leave_the_evaluator_sound():
    robot = Robot.from_text(urdf(random_tree(0)))
    motion = robot.random_motion(0, 3)
    before = robot.inverse_dynamics(*motion)
    assert np.all(np.isnan(robot.inverse_dynamics(*motion, np.full(10 * robot.n, np.nan))))
    np.testing.assert_array_equal(robot.inverse_dynamics(*motion), before)


def test_threads_may_share_a_robot():
    robot = Robot.from_text(urdf(random_tree(0)))
    motion = robot.random_motion(0, 200)
    thetas = [scale * robot.theta for scale in (1.0, 2.0)]
    alone = [robot.inverse_dynamics(*motion, theta) for theta in thetas]
    together = Barrier(2)

    def often(theta):
        together.wait()
        return [robot.inverse_dynamics(*motion, theta) for _ in range(100)]

    held = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)  # they meet within a call
    try:
        with ThreadPoolExecutor(2) as threads:
            found = list(threads.map(often, thetas))
    finally:
        sys.setswitchinterval(held)
    for each, torque in zip(found, alone, strict=True):
        assert all(np.array_equal(one, torque) for one in each)


def test_columns_follow_the_order_asked_for():
    bodies = random_tree(5, moving=5)
    names = joint_names(bodies)
    robot = Robot.from_text(urdf(bodies), joints=names)
    order = [3, 0, 4, 2, 1]
    shuffled = Robot.from_text(urdf(bodies), joints=[names[i] for i in order])
    q, v, a = robot.random_motion(0, 4)
    Y = robot.regressor(q, v, a)
    other = shuffled.regressor(q[:, order], v[:, order], a[:, order])
    columns = (10 * np.array(order)[:, None] + np.arange(10)).ravel()
    np.testing.assert_allclose(other, Y[:, order][:, :, columns], atol=1e-12)
    np.testing.assert_allclose(shuffled.theta, robot.theta[columns], atol=1e-12)
    assert shuffled.parameter_names[0] == f"m.{robot.bodies[3]}"
    motion = [x[:, order] for x in (q, v, a)]
    assert relative(through_drake(shuffled, *motion), shuffled.inverse_dynamics(*motion)) < 1e-9


def test_gravity_is_the_torque_at_rest():
    robot = Robot.from_text(urdf(random_tree(2)))
    still = np.zeros((1, robot.n))
    assert np.any(robot.inverse_dynamics(still, still, still))
    floating = robot.with_gravity([0, 0, 0])
    assert not np.any(np.abs(floating.inverse_dynamics(still, still, still)) > 1e-12)


def test_pinocchio_model_is_the_robot():
    robot = Robot.from_text(urdf(random_tree(1)))
    theta = np.array(robot.theta)
    theta[10:14] = 0.0  # an inertia without mass is fine
    robot = robot.with_theta(theta)
    q, v, a = robot.random_motion(0, 1)
    model = robot.pinocchio()
    index = [model.joints[model.getJointId(name)].idx_v for name in robot.names]
    x, w, d = np.zeros(robot.n), np.zeros(robot.n), np.zeros(robot.n)
    x[index], w[index], d[index] = q[0], v[0], a[0]
    tau = pin.rnea(model, model.createData(), x, w, d)[index]
    np.testing.assert_allclose(tau, robot.inverse_dynamics(q, v, a)[0], atol=1e-12)
