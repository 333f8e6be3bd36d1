"""Motors and links with something soft between them, states of effects, losses: the physics."""

from __future__ import annotations

import numpy as np
import pytest
from tests.synthetic import arm

from dynident.closed_loop import ClosedLoop, Controller, Fourier, Mechanism, Task, TrueEffect
from dynident.closed_loop.rollout import Rollout
from dynident.effects.transmissions.along import mean_inertia
from dynident.errors import SimulationError
from dynident.robot import Robot

PENDULUM = """<robot name="pendulum"><link name="base"/>
  <link name="bob"><inertial><origin xyz="0.3 0 0"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="5" effort="50"/></joint></robot>"""
INERTIA = 0.02 + 1.5 * 0.3**2
FLAT, RAISED = (0.0, 0.0, -9.81), (0.0, -9.81, 0.0)


def pendulum(gravity=FLAT) -> Robot:
    return Robot.from_text(PENDULUM, gravity=gravity)


def elastic(robot: Robot, resonance: float, damping: float, joint: str, rotor: float) -> Mechanism:
    """One joint gives way; `rotor` on its motor's side."""
    inertia = mean_inertia(robot, robot.names.index(joint))
    compliance = 1.0 / (inertia * (2.0 * np.pi * resonance) ** 2)
    shape = {"resonance": resonance, "damping": damping}
    soft = TrueEffect.of(f"joint_elasticity@{joint}", robot, [compliance], shape)
    motor = TrueEffect.of(f"rotor_inertia@{joint}", robot, [rotor])
    return Mechanism.of(robot, [*motor, *soft])


def swung(mechanism: Mechanism, link: float, seconds: float) -> np.ndarray:
    """Position of the one link, let go at `link` rad while a controller holds the motor at 0."""
    from dynident.closed_loop.plant.diagram import Plant

    plant = Plant([mechanism])
    plant.set([mechanism], [0.0])
    zero = np.zeros(1)
    state = plant.start(zero, zero, zero)
    state[0] += link
    plant.diagram.get_input_port().FixValue(plant.context, zero)
    plant.context.SetContinuousState(state)
    from pydrake.systems.analysis import Simulator

    simulator = Simulator(plant.diagram, plant.context)
    simulator.get_mutable_integrator().set_target_accuracy(1e-6)
    vector = plant.context.get_continuous_state_vector()
    found = []
    for t in np.arange(0.0, seconds, 1e-3):
        simulator.AdvanceTo(t)
        found.append(vector.CopyToVector())
    return np.array(found)


def test_a_link_rings_at_its_resonance_behind_a_motor_that_stands() -> None:
    """A motor of a ton stands by itself: half periods of the link are those of the spring."""
    heavy = elastic(pendulum(), 12.0, 0.02, "hinge", 1e4 * INERTIA)
    states = swung(heavy, 0.05, 0.6)
    link = states[:, 0] - states[:, 2]
    crossings = np.flatnonzero(np.diff(np.sign(link)))
    at = crossings - link[crossings] / (link[crossings + 1] - link[crossings])
    found = 1e3 / (2.0 * np.mean(np.diff(at)))
    assert found == pytest.approx(12.0 * np.sqrt(1.0 - 0.02**2), rel=0.002)
    peaks = np.abs(link[1:-1])[(np.diff(np.abs(link[1:])) < 0) & (np.diff(np.abs(link[:-1])) > 0)]
    decrement = np.log(peaks[0] / peaks[8]) / 8
    assert decrement == pytest.approx(np.pi * 0.02, rel=0.03)


def test_energy_and_momentum_of_two_free_masses_are_kept() -> None:
    rotor = 0.5 * INERTIA
    soft = elastic(pendulum(), 5.0, 0.002, "hinge", rotor)
    states = swung(soft, 0.1, 0.5)
    momentum = INERTIA * states[:, 1] + rotor * states[:, 3]
    assert np.abs(momentum).max() < 1e-4 * np.abs(INERTIA * states[:, 1]).max()
    (gear,) = soft.transmissions
    bent = states[:, 2] - states[:, 0]
    energy = 0.5 * (
        INERTIA * states[:, 1] ** 2 + rotor * states[:, 3] ** 2 + gear.stiffness * bent**2
    )
    slip = states[:, 3] - states[:, 1]
    lost = np.concatenate([[0.0], np.cumsum(gear.damping * (slip[1:] ** 2 + slip[:-1] ** 2) / 2e3)])
    np.testing.assert_allclose(energy + lost, energy[0], rtol=2e-3)


def test_a_link_in_a_gap_flies_freely_and_starts_where_the_load_leans() -> None:
    robot = pendulum(RAISED)
    effects = TrueEffect.of("backlash@hinge", robot, [0.02], {"resonance": 30.0})
    free = Mechanism.of(pendulum(), effects)
    states = swung(free, -0.01, 0.01)
    np.testing.assert_allclose(states[:, 1], states[0, 1], atol=1e-6)
    from dynident.closed_loop.plant.diagram import Plant

    hanging = Mechanism.of(robot, effects)
    plant = Plant([hanging])
    plant.set([hanging], [0.0])
    zero = np.zeros(1)
    state = plant.start(zero, zero, zero)
    (gear,) = hanging.transmissions
    load = robot.inverse_dynamics(state[None, :1], zero[None], zero[None])[0, 0]
    assert load > 0
    assert state[2] - state[0] == pytest.approx(0.01 + load / gear.stiffness, rel=1e-6)


def run(mechanism: Mechanism, controller: Controller, duration: float = 0.5) -> Rollout:
    trajectory = Fourier.random(mechanism.robot, 2.0, 3)
    task = Task(mechanism, trajectory, duration)
    (found,) = ClosedLoop(accuracy=1e-4).simulate([task], controller, lead_in=0.2)
    return found


PD = Controller(
    kind="pd", rate_hz=1000.0, kp=(800.0, 200.0), kd=(60.0, 12.0), derivative_cutoff_hz=80.0
)


def test_a_stiff_transmission_is_the_rigid_robot() -> None:
    robot = arm()
    friction = TrueEffect.of("viscous_friction", robot, [1.0])
    rigid, stiff = (
        Mechanism.of(robot, [*elastic(robot, 90.0, 0.3, "elbow", 0.05).effects[:last], *friction])
        for last in (1, 2)
    )
    one, other = run(rigid, PD), run(stiff, PD)
    assert np.abs(one.q - other.q).max() < 2e-4
    assert np.abs(one.u - other.u).max() < 0.02 * np.abs(one.u).max()


def test_acceleration_is_the_motors() -> None:
    soft = elastic(arm(), 10.0, 0.1, "elbow", 0.05)
    found = run(soft, PD)
    mean = np.diff(found.v, axis=0) * 1000.0
    # Just after a sample, and the mean until the next one, differ by half a sample's jerk.
    error = (mean - found.a[:-1]).std(axis=0)
    assert (error < 0.05 * found.a.std(axis=0)).all()


def test_what_depends_on_the_past_is_no_function_of_the_motion() -> None:
    robot = arm()
    still = np.zeros((1, 2))
    for label in ("joint_elasticity@elbow", "backlash@elbow", "presliding@elbow"):
        for value, kept in ((0.0, True), (1e-3, False)):
            made = Mechanism.of(robot, TrueEffect.of(label, robot, [value]))
            if kept:
                assert np.isfinite(made.command(np.zeros(1), still, still, still)).all()
                continue
            with pytest.raises(SimulationError, match=label):
                made.command(np.zeros(1), still, still, still)
            with pytest.raises(SimulationError, match=label):
                made.acceleration(np.zeros(1), still, still, still)


def test_an_integral_starts_although_something_gives_way() -> None:
    pid = Controller(
        kind="pid",
        rate_hz=1000.0,
        kp=(800.0, 200.0),
        kd=(60.0, 12.0),
        ki=(500.0, 100.0),
        derivative_cutoff_hz=80.0,
    )
    found = run(elastic(arm(), 15.0, 0.1, "elbow", 0.05), pid, 0.2)
    assert np.abs(found.q - found.q_ref).max() < 0.1


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ((("joint_elasticity@elbow", 1e-3), ("backlash@elbow", 1e-2)), "two transmissions"),
        ((("joint_elasticity@elbow", 1e-13), ("rotor_inertia@elbow", 0.05)), "too stiff"),
    ],
)
def test_what_cannot_be_simulated_is_refused(effects, said: str) -> None:
    robot = arm()
    made = [one for label, x in effects for one in TrueEffect.of(label, robot, [x])]
    with pytest.raises(SimulationError, match=said):
        run(Mechanism.of(robot, made), PD, 0.1)


def test_a_coupled_motor_before_a_spring_is_refused() -> None:
    robot = arm()
    coupled = TrueEffect.of("joint_coupling@elbow:shoulder", robot, {"ca": 0.01})
    made = Mechanism.of(robot, [*elastic(robot, 10.0, 0.1, "elbow", 0.05).effects, *coupled])
    with pytest.raises(SimulationError, match="coupled"):
        run(made, PD, 0.1)


def test_loss_takes_its_share_of_the_torque() -> None:
    robot = arm()
    made = Mechanism.of(robot, TrueEffect.of("load_friction@shoulder", robot, [0.1]))
    found = run(made, PD)
    mean = np.gradient(found.v, found.t, axis=0)
    needed = made.command(found.t, found.q, found.v, mean)
    rigid = robot.inverse_dynamics(found.q, found.v, mean)
    error = (found.torque - needed)[5:-5, 0]
    moving = np.abs(found.v[5:-5, 0]) > 0.1  # a sample's mean says nothing of a reversal
    assert error[moving].std() < 0.002 * (needed - rigid)[:, 0].std()
    np.testing.assert_allclose(
        made.acceleration(found.t, found.q, found.v, needed), mean, rtol=1e-6, atol=1e-6
    )


def test_what_runs_in_python_is_said() -> None:
    loop, soft = ClosedLoop(), elastic(arm(), 10.0, 0.1, "elbow", 0.05)
    loop.simulate([Task(soft, Fourier.random(arm(), 2.0, 3), 0.01)], PD, lead_in=0.0)
    assert [note for note in loop.notes if "joint_elasticity@elbow" in note]


def test_an_acceleration_just_after_a_sample_is_the_diagrams_own() -> None:
    from dynident.closed_loop.plant.diagram import Plant

    robot, rng = arm(), np.random.default_rng(3)
    effects = [
        *elastic(robot, 10.0, 0.1, "elbow", 0.05).effects,
        *TrueEffect.of("presliding@shoulder", robot, [0.5]),
        *TrueEffect.of("coulomb_friction", robot, [0.5]),
        *TrueEffect.of("load_friction@elbow", robot, [0.1]),
    ]
    made = Mechanism.of(robot, effects)
    plant = Plant([made, made])
    plant.set([made, made], [0.0, 0.0])
    state, u = rng.normal(size=plant.context.num_continuous_states()), rng.normal(size=4)
    state[-2:] = 0.3, -0.7
    plant.context.SetContinuousState(state)
    plant.diagram.get_input_port().FixValue(plant.context, u[np.argsort(plant.inputs)])
    rates = plant.diagram.EvalTimeDerivatives(plant.context).CopyToVector()[plant.speeds]
    past = plant.past(state[None])
    for k in range(2):
        own, kept = slice(2 * k, 2 * k + 2), slice(k, k + 1)
        motion = (state[None, plant.positions[own]], state[None, plant.speeds[own]])
        found = made.acceleration(
            np.zeros(1), *motion, u[None, own], past.of(slice(0, 1), own, kept)
        )
        np.testing.assert_allclose(found[0], rates[own], rtol=1e-9)
