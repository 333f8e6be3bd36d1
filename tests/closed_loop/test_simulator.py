"""The simulator against analytic motions, and against the inverse dynamics of every effect."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.special import ellipk
from tests.synthetic import arm

from dynident.closed_loop import (
    Controller,
    Fourier,
    Mechanism,
    Rollout,
    Sensors,
    Task,
    TrueEffect,
    simulate,
)
from dynident.closed_loop.plant.point_force import PlainForce, TracedForce, point_force
from dynident.closed_loop.plant.side_by_side import Bodies
from dynident.effects import Effect, catalogue, effects_of
from dynident.errors import SimulationError
from dynident.model import Model
from dynident.robot import Robot

PENDULUM = """<robot name="pendulum"><link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="20" effort="50"/></joint></robot>"""
SLIDER = """<robot name="slider"><link name="base"/>
  <link name="mass"><inertial><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="mass"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="2" effort="50"/></joint></robot>"""
FREE: Any = {"kp": (0.0,), "kd": (0.0,)}


def still(position: float, period: float = 1.0) -> Fourier:
    return Fourier(period, np.array([position]), np.zeros((1, 1)), np.zeros((1, 1)))


def test_a_free_pendulum_keeps_its_energy_and_its_period() -> None:
    start = 2.0
    task = Task(Mechanism.of(Robot.from_text(PENDULUM)), still(start), 10.0)
    (run,) = simulate(
        [task], Controller(kind="pd", rate_hz=200.0, **FREE), lead_in=0.0, accuracy=1e-7
    )
    inertia, weight = 0.1 + 2 * 0.5**2, 2 * 9.81 * 0.5
    energy = inertia * run.v[:, 0] ** 2 / 2 - weight * np.cos(run.q[:, 0])
    np.testing.assert_allclose(energy, energy[0], atol=1e-4 * weight)
    period = 4 * ellipk(np.sin(start / 2) ** 2) * np.sqrt(inertia / weight)
    up = np.flatnonzero((run.v[:-1, 0] > 0) & (run.v[1:, 0] <= 0))
    turns = run.t[up] + run.v[up, 0] / (run.v[up, 0] - run.v[up + 1, 0]) / 200.0
    np.testing.assert_allclose(np.diff(turns), period, rtol=1e-4)


def test_a_damped_mass_under_sampled_pd_moves_as_the_exact_recursion() -> None:
    mass, damping, rate, kp, kd = 2.0, 3.0, 100.0, 300.0, 30.0
    robot = Robot.from_text(SLIDER)
    friction = TrueEffect.of("viscous_friction@slide", robot, [damping])
    trajectory = Fourier.random(robot, 2.0, 1)
    task = Task(Mechanism.of(robot, friction), trajectory, 4.0)
    (run,) = simulate(
        [task], Controller(kind="pd", rate_hz=rate, kp=(kp,), kd=(kd,)), lead_in=0.0, accuracy=1e-8
    )

    step = expm(np.array([[0, 1, 0], [0, -damping / mass, 1 / mass], [0, 0, 0]]) / rate)
    q_ref, v_ref, _ = (x[:, 0] for x in trajectory.at(np.arange(len(run.t)) / rate))
    before, state = q_ref[0] - v_ref[0] / rate, np.array([q_ref[0], v_ref[0]])
    for k in range(len(run.t)):
        np.testing.assert_allclose([run.q[k, 0], run.v[k, 0]], state, atol=1e-6)
        speed = (state[0] - before) * rate
        u = kp * (q_ref[k] - state[0]) + kd * (v_ref[k] - speed)
        assert run.u[k, 0] == pytest.approx(u, abs=1e-3)
        before, state = state[0], step[:2] @ np.array([*state, u])


def test_friction_stops_a_mass_where_the_law_says() -> None:
    """No control: a sliding mass under Coulomb friction, against a tight integration."""
    robot = Robot.from_text(SLIDER)
    truth = TrueEffect.of("coulomb_friction@slide", robot, [4.0])
    moving = Fourier(1.0, np.zeros(1), np.array([[0.5 / (2 * np.pi)]]), np.zeros((1, 1)))
    task = Task(Mechanism.of(robot, truth), moving, 0.5)
    (run,) = simulate([task], Controller(kind="pd", rate_hz=1000.0, **FREE), lead_in=0.0)
    exact = solve_ivp(
        lambda _, x: [x[1], -2.0 * np.tanh(x[1] / 0.01)],
        (0, 0.5),
        [0.0, 0.5],
        t_eval=run.t,
        rtol=1e-10,
        atol=1e-12,
        method="Radau",
    )
    np.testing.assert_allclose(run.q[:, 0], exact.y[0], atol=1e-5)
    np.testing.assert_allclose(run.v[:, 0], exact.y[1], atol=1e-3)


# --- against the inverse dynamics ---------------------------------------------------------------

WIDTH = 0.1
RATE = 2000.0
VALUES = {
    "asymmetric_friction": (0.3, 0.5),
    "drive_gain": (0.2,),
    "joint_coupling": (0.3, 0.4, 0.02, 0.5),
    "joint_spring": (3.0, 1.0),
    "payload": (0.8, 0.2, 0.03, 0.0, 0.01, 0.0, 0.1, 0.0, 0.0, 0.1),
    "torque_ripple": (0.5, -0.4),
}
PLACES = {"joint or robot": "@elbow", "joint": "@elbow", "pair": "@elbow:shoulder", "robot": ""}


def truth_of(name: str, robot: Robot) -> tuple[TrueEffect, ...]:
    """The effect at the elbow, of a size that is seen; effects to come get 0.5 for each value."""
    (effect,) = effects_of(name + PLACES[catalogue()[name].place], robot)
    values = VALUES.get(name, (0.5,) * len(effect.parameters(robot)))
    return (TrueEffect(effect, values),)


def followed(robot: Robot, truth: tuple[TrueEffect, ...], **settings: Any) -> Rollout:
    mechanism = Mechanism.of(robot, truth, WIDTH, carries_payload=True)
    controller = Controller(kind="pd", rate_hz=RATE, kp=(2000.0, 800.0), kd=(150.0, 40.0))
    task = Task(mechanism, Fourier.random(robot, 2.0, 5, harmonics=3, speed=2.0), 2.0)
    (run,) = simulate([task], controller, lead_in=0.1, **settings)
    return run


# What the past decides (transmissions, internal states), what a sensor does (a delay) and what
# happens once (a contact) have tests of their own.
OF_THE_INSTANT = [
    name
    for name, kind in catalogue().items()
    if not kind.memory
    and kind.found_by == "residual"
    and kind.simulated_transmission is Effect.simulated_transmission
    and kind.simulated_delay is Effect.simulated_delay
]


@pytest.mark.parametrize("name", OF_THE_INSTANT)
@pytest.mark.slow
def test_commands_are_the_torque_of_the_recorded_motion(name: str) -> None:
    """(u[k-1] + u[k])/2 is the model's torque at central differences, within 0.2 % of its rms."""
    robot = arm()
    (one,) = truth_of(name, robot)
    run = followed(robot, (one,))
    middle = slice(1, -1)
    v = (run.q[2:] - run.q[:-2]) * RATE / 2
    a = (run.q[2:] - 2 * run.q[1:-1] + run.q[:-2]) * RATE**2
    # The model of the regression, not the simulator's own: rigid body and columns.
    model = Model(robot, (one.effect.at(one.values),), WIDTH)
    values = model.given_values()
    values[model.slices[one.effect.label]] = one.values
    block = model.block(run.t[middle], run.q[middle], v, a, carries_payload=True)
    torque = model.torque(block, values)
    mean = (run.u[:-2] + run.u[1:-1]) / 2
    scale = np.sqrt(np.mean(mean**2, axis=0))
    np.testing.assert_allclose((mean - torque) / scale, 0.0, atol=2e-3)
    without = model.torque(block, model.given_values())
    assert np.abs(without - torque).max() > 0.02 * scale.min(), "the effect is not to be seen"


@pytest.mark.parametrize("name", catalogue())
def test_compiled_force_is_the_effects_force(name: str) -> None:
    """Also at values other than those it was compiled for."""
    robot = arm()
    (one,) = truth_of(name, robot)
    place, starts = np.array([1, 0, 3, 2]), (0.0, 5.0)

    def bodies(*factors: float) -> Bodies:
        scaled = [
            Mechanism(
                robot,
                (replace(one, values=tuple(f * x for x in one.values)),),
                friction_width=WIDTH,
            )
            for f in factors
        ]
        return Bodies(tuple(scaled), starts, place)

    force, plainly = point_force(bodies(0.0, 1.0)), PlainForce(bodies(1.0, 1.0))
    assert isinstance(force, TracedForce)
    then = bodies(-2.0, 3.0)
    rng = np.random.default_rng(1)
    kept = one.effect.memory
    for law in (force, plainly):
        law.set(then)
        for t in range(20):
            x, z = rng.normal(size=8), rng.uniform(-1.0, 1.0, 2 * kept)
            for k, (body, start) in enumerate(zip(then.mechanisms, starts, strict=True)):
                own, rows = place[2 * k : 2 * k + 2], slice(k * kept, (k + 1) * kept)
                instant = (np.array([t + start]), x[own][None], x[own + 4][None], z[rows][None])
                found, rate = law(t, x, z)[own], law.rate(t, x, z)[rows]
                np.testing.assert_allclose(found, -body.force(*instant)[0], rtol=1e-9, atol=1e-12)
                np.testing.assert_allclose(rate, body.memory_rate(*instant)[0], rtol=1e-9)


@pytest.mark.slow
def test_effects_that_do_not_run_on_symbols_are_simulated_all_the_same(monkeypatch) -> None:
    robot = arm()
    truth = truth_of("quadratic_drag", robot)
    compiled = followed(robot, truth)
    kind = catalogue()["quadratic_drag"]
    original = kind.simulated_force
    monkeypatch.setattr(
        kind,
        "simulated_force",
        lambda self, values, block: original(self, values, block) * float(block.q[0, 0] < 1e9),
    )
    np.testing.assert_allclose(followed(robot, truth).u, compiled.u, atol=1e-9)


def test_motions_side_by_side_are_those_alone() -> None:
    robot = arm()
    friction = TrueEffect.of("coulomb_friction", robot, [1.0])
    load = TrueEffect.of("payload", robot, VALUES["payload"])
    tasks = [
        Task(
            Mechanism.of(robot, (*friction, *load), carries_payload=seed == 2),
            Fourier.random(robot, 2.0, seed),
            1.0 + 0.1 * seed,
        )
        for seed in range(3)
    ]
    controller = Controller(kind="pd", rate_hz=500.0, kp=(800.0, 200.0), kd=(60.0, 12.0))
    together = simulate(tasks, controller, lead_in=0.2)
    for task, run in zip(tasks, together, strict=True):
        (alone,) = simulate([task], controller, lead_in=0.2)
        assert len(run.t) == round(task.duration * 500)
        np.testing.assert_allclose(run.q, alone.q, atol=1e-5)
        np.testing.assert_allclose(run.u, alone.u, atol=2e-2)


def test_joint_order_does_not_matter() -> None:
    robot = arm()
    turned = Robot.from_text(robot.description.text, joints=["elbow", "shoulder"])  # type: ignore
    trajectory = Fourier.random(robot, 2.0, 1)
    mirrored = Fourier(2.0, trajectory.centre[::-1], trajectory.sine[::-1], trajectory.cosine[::-1])
    coupling = ("joint_coupling@elbow:shoulder", VALUES["joint_coupling"])
    kp, kd = (800.0, 200.0), (60.0, 12.0)
    runs = []
    for body, reference, order in ((robot, trajectory, 1), (turned, mirrored, -1)):
        truth = TrueEffect.of(*coupling[:1], body, coupling[1])
        controller = Controller(kind="pd", rate_hz=500.0, kp=kp[::order], kd=kd[::order])
        runs += simulate([Task(Mechanism.of(body, truth), reference, 0.5)], controller, lead_in=0.1)
    np.testing.assert_allclose(runs[1].u[:, ::-1], runs[0].u, atol=1e-6)


@pytest.mark.slow
def test_accuracy_is_what_is_stated() -> None:
    robot = arm()
    truth = (
        *TrueEffect.of("coulomb_friction", robot, [1.0]),
        *TrueEffect.of("stribeck_friction@elbow", robot, [0.5], [0.1]),
    )
    task = Task(Mechanism.of(robot, truth), Fourier.random(robot, 4.0, 1), 1.0)
    controller = Controller(kind="pd", rate_hz=1000.0, kp=(800.0, 300.0), kd=(80.0, 20.0))
    (run,) = simulate([task], controller, lead_in=0.5)
    (tight,) = simulate([task], controller, lead_in=0.5, accuracy=1e-8)
    np.testing.assert_allclose(run.q, tight.q, atol=2e-6)
    assert np.sqrt(np.mean((run.u - tight.u) ** 2)) < 3e-5 * np.sqrt(np.mean(tight.u**2))


# --- what is refused ----------------------------------------------------------------------------


def test_a_diverging_loop_is_noticed_with_its_time() -> None:
    robot = arm()
    task = Task(Mechanism.of(robot), Fourier.random(robot, 2.0, 1), 20.0, name="run7.csv")
    with pytest.raises(SimulationError, match=r"run7\.csv, t = .* s: the loop .*lower the"):
        simulate(
            [task], Controller(kind="pd", rate_hz=100.0, kp=(5000.0, 5000.0), kd=(900.0, 900.0))
        )


def test_a_loop_that_chatters_at_its_limit_is_noticed() -> None:
    robot = arm()
    task = Task(Mechanism.of(robot), Fourier.random(robot, 2.0, 1), 5.0)
    controller = Controller(
        kind="pd", rate_hz=100.0, kp=(500.0, 500.0), kd=(99.0, 99.0), limit=(50.0, 50.0)
    )
    with pytest.raises(SimulationError, match="oscillates from sample to sample: joint 'elbow'"):
        simulate([task], controller)


def test_a_joint_that_only_holds_still_is_no_chatter() -> None:
    robot = arm()
    moving = Fourier.random(robot, 2.0, 1)
    still_elbow = Fourier(2.0, moving.centre, moving.sine * [[1], [0]], moving.cosine * [[1], [0]])
    task = Task(Mechanism.of(robot), still_elbow, 1.0, rng=np.random.default_rng(0))
    controller = Controller(kind="pd", rate_hz=500.0, kp=(800.0, 200.0), kd=(60.0, 12.0))
    simulate([task], controller, Sensors(position_std=2e-5))


@pytest.mark.parametrize("changes", [{"m.fore": -1.0}, {"Izz.fore": -1.0}])
def test_bodies_without_positive_inertia_are_refused(changes: dict[str, float]) -> None:
    robot = arm()
    theta = robot.theta.copy()
    for name, value in changes.items():
        theta[robot.parameter_names.index(name)] = value
    task = Task(Mechanism.of(robot.with_theta(theta)), Fourier.random(robot, 2.0, 1), 1.0)
    controller = Controller(kind="pd", rate_hz=500.0, kp=(8.0, 2.0), kd=(0.6, 0.1))
    with pytest.raises(SimulationError, match="joint-space inertia is not positive"):
        simulate([task], controller)


def test_a_coupling_inertia_that_makes_the_whole_singular_is_refused() -> None:
    robot = arm()
    truth = TrueEffect.of("joint_coupling@elbow:shoulder", robot, {"ca": 1e3})
    task = Task(Mechanism.of(robot, truth), Fourier.random(robot, 2.0, 1), 1.0)
    with pytest.raises(SimulationError, match="joint-space inertia is not positive"):
        simulate([task], Controller(kind="pd", rate_hz=500.0, kp=(8.0, 2.0), kd=(0.6, 0.1)))


def test_settings_that_do_not_fit_are_refused() -> None:
    robot = arm()
    trajectory = Fourier.random(robot, 2.0, 1)
    pd = Controller(kind="pd", rate_hz=500.0, kp=(8.0, 2.0), kd=(0.6, 0.1))
    fits = Task(Mechanism.of(robot), trajectory, 1.0)
    cases: list[tuple[Task, Controller, dict[str, Any], str]] = [
        (fits, Controller(kind="pd", rate_hz=500.0, kp=(8.0,), kd=(0.6,)), {}, "controller of 1"),
        (Task(Mechanism.of(robot), still(0.0), 1.0), pd, {}, "trajectory of 1 joints"),
        (Task(Mechanism.of(robot), trajectory, 0.0), pd, {}, "duration"),
        (Task(Mechanism.of(robot), trajectory, np.nan), pd, {}, "duration"),
        (fits, pd, {"lead_in": -1.0}, "lead_in"),
        (fits, pd, {"sensors": Sensors(position_std=-1.0)}, "position_std"),
        (fits, pd, {"sensors": Sensors(position_resolution=(1.0, 1.0, 1.0))}, "3 values for 2"),
    ]
    for task, controller, settings, words in cases:
        with pytest.raises(SimulationError, match=words):
            simulate([task], controller, **settings)
    broken = robot.with_theta(np.where(np.arange(20) == 4, np.nan, robot.theta))
    with pytest.raises(SimulationError, match="not finite"):
        simulate([Task(Mechanism.of(broken), trajectory, 1.0)], pd)
    assert simulate([], pd) == ()
