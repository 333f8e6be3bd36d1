"""The Drake plant takes what we set, physical or not, and refuses what it cannot hold."""

from typing import Any

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from random_trees import random_tree, urdf
from test_robot_dynamics import through_drake

from dynident.errors import RobotError
from dynident.robot import Robot
from dynident.robot.drake import add_to_plant


@pytest.mark.parametrize("seed", range(5))
def test_any_parameters_with_mass_give_the_same_torque(seed):
    robot = Robot.from_text(urdf(random_tree(seed)), gravity=(1.0, 2.0, -9.0))
    rng = np.random.default_rng(seed)
    theta = rng.normal(size=10 * robot.n)
    theta[::10] += np.sign(theta[::10])  # negative masses too
    theta[10:14] = 0.0  # massless with an inertia
    theta[20:30] = 0.0  # nothing at all
    changed = robot.with_theta(theta)
    motion = robot.random_motion(seed, 4)
    want = changed.inverse_dynamics(*motion)
    got = through_drake(changed, *motion)
    assert np.max(np.abs(got - want)) < 1e-9 * np.max(np.abs(want))


def test_order_names_and_simulation_of_a_non_physical_body():
    """A negative mass runs as long as the mass matrix is positive."""
    text = urdf(random_tree(3))
    names = Robot.from_text(text).names[::-1]
    robot = Robot.from_text(text, joints=names)
    theta = np.array(robot.theta)
    first = next(k for k, joint in enumerate(robot.joints) if joint.parent == -1)
    assert any(joint.parent == first for joint in robot.joints), "it carries others"
    theta[10 * first : 10 * first + 4] = [-0.01, 0.0, 0.0, 0.0]
    robot = robot.with_theta(theta)
    plant = MultibodyPlant(0.0)
    drake = add_to_plant(robot, plant)
    plant.Finalize()
    assert [joint.name() for joint in drake.joints] == list(names)
    assert [body.name() for body in drake.bodies] == list(robot.bodies)
    assert plant.num_velocities() == robot.n == plant.num_actuators()
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), robot.gravity)
    context = plant.CreateDefaultContext()
    q, v, a = robot.random_motion(0, 1)
    x: Any = np.zeros(robot.n)
    w: Any = np.zeros(robot.n)
    u: Any = np.zeros(robot.n)
    x[drake.position_indices()], w[drake.velocity_indices()] = q[0], v[0]
    u[drake.input_indices()] = robot.inverse_dynamics(q, v, a)[0]
    plant.SetPositions(context, x)
    plant.SetVelocities(context, w)
    assert np.linalg.eigvalsh(plant.CalcMassMatrix(context))[0] > 0
    plant.get_actuation_input_port().FixValue(context, u)
    forward = plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
    np.testing.assert_allclose(forward[drake.velocity_indices()], a[0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("entries", "message"),
    [({0: 0.0, 1: 1.0}, "first moment but no mass"), ({4: np.nan}, "not finite")],
)
def test_what_drake_cannot_hold_is_refused(entries, message):
    robot = Robot.from_text(urdf(random_tree(0)))
    theta = np.array(robot.theta)
    for index, value in entries.items():
        theta[index] = value
    plant = MultibodyPlant(0.0)
    with pytest.raises(RobotError, match=message):
        add_to_plant(robot.with_theta(theta), plant)
    assert plant.num_bodies() == 1, "nothing half added"
    with pytest.raises(RobotError, match=message):
        robot.with_theta(theta).pinocchio()
