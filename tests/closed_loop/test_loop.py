"""The reusable loop: one diagram for many robots, effects in C++, delays, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from tests.synthetic import arm

from dynident.closed_loop import (
    ClosedLoop,
    Controller,
    Fourier,
    Mechanism,
    SampledReference,
    Task,
    TrueEffect,
    simulate,
)
from dynident.effects import catalogue, effects_of
from dynident.errors import SimulationError
from dynident.model import Model
from dynident.robot import Robot

SLIDER = """<robot name="slider"><link name="base"/>
  <link name="mass"><inertial><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="mass"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="2" effort="50"/></joint></robot>"""
PD = Controller(kind="pd", rate_hz=500.0, kp=(800.0, 200.0), kd=(60.0, 12.0))
NATIVE = ("viscous_friction", "coulomb_friction", "asymmetric_friction", "joint_spring")
PLACES = {"joint or robot": "", "joint": "@elbow", "pair": "@elbow:shoulder", "robot": ""}


def task(mechanism: Mechanism, seed: int = 1, duration: float = 0.3, **settings: Any) -> Task:
    return Task(mechanism, Fourier.random(mechanism.robot, 2.0, seed), duration, **settings)


def iterate(model: Model, seed: int, **settings: Any) -> Mechanism:
    """A mechanism as an estimator tries them: links at random, friction of either sign."""
    rng = np.random.default_rng(seed)
    values = model.given_values()
    values[len(model.base.independent) :] = 0.3 * rng.normal(size=values.size - model.base.rank)
    for label, own in model.slices.items():
        if label.startswith("rotor_inertia"):
            values[own] = rng.uniform(-0.02, 0.1)
        if label == "payload":
            values[own] = rng.uniform(0.1, 0.5) * np.array([1, 0.2, 0, 0, 0.05, 0, 0.1, 0, 0, 0.1])
    theta = model.robot.theta * np.repeat(rng.uniform(0.8, 1.2, size=2), 10)
    return Mechanism.of_model(model, values, theta, **settings)


# --- one diagram --------------------------------------------------------------------------------


def test_other_parameters_need_no_other_diagram_and_move_as_on_a_fresh_one() -> None:
    model = Model(arm())
    for name in ("rotor_inertia", "viscous_friction", "coulomb_friction", "asymmetric_friction"):
        model = model + name
    model = model + "stribeck_friction@elbow" + "payload"
    loop = ClosedLoop(integrator="drake")
    for seed in range(6):
        body = iterate(model, seed, carries_payload=True)
        tasks = [task(body, seed), task(body, seed + 1, start=3.0 * seed)]
        scale = np.array([1.0, 0.5 + 0.1 * seed])
        found = loop.simulate(tasks, PD, lead_in=0.05, feedback_scale=scale)
        fresh = ClosedLoop(integrator="drake").simulate(
            tasks, PD, lead_in=0.05, feedback_scale=scale
        )
        for one, other in zip(found, fresh, strict=True):
            np.testing.assert_allclose(one.q, other.q, rtol=0, atol=1e-12)
            np.testing.assert_allclose(one.u, other.u, rtol=0, atol=1e-9)
    assert loop.builds == 1


def test_what_has_another_structure_is_built_once_each() -> None:
    robot, loop = arm(), ClosedLoop(integrator="drake")
    assert (loop.builds, loop.notes) == (0, ())
    plain = Mechanism.of(robot, TrueEffect.of("viscous_friction", robot, [0.5]))
    coupled, ripple = (
        Mechanism.of(robot, (*plain.effects, *TrueEffect.of(label, robot, values)))
        for label, values in (
            ("joint_coupling@elbow:shoulder", {"ca": 0.01}),
            ("torque_ripple@elbow", {"As": 0.1}),
        )
    )
    for _ in range(2):
        for body in (plain, coupled, ripple):
            loop.simulate([task(body, duration=0.02)], PD, lead_in=0.0)
    loop.simulate([task(plain, duration=0.02)] * 2, PD, lead_in=0.0)
    assert loop.builds == 4
    slow = ("joint_coupling@elbow:shoulder", "torque_ripple@elbow")
    assert len(loop.notes) == 2
    for label, note in zip(slow, loop.notes, strict=True):
        assert label in note and "slower" in note


def test_many_motions_are_simulated_a_plant_at_a_time() -> None:
    body = Mechanism.of(arm())
    told: list[tuple[float, float]] = []
    tasks = [task(body, seed, 0.05, name=str(seed)) for seed in range(10)]
    loop = ClosedLoop(integrator="drake")
    together = loop.simulate(tasks, PD, lead_in=0.0, progress=lambda *step: told.append(step))
    assert loop.builds == 2, "8 motions and 2"
    assert told[-1] == pytest.approx((0.1, 0.1))
    (alone,) = loop.simulate(tasks[9:], PD, lead_in=0.0)
    np.testing.assert_allclose(together[9].q, alone.q, atol=1e-6)


# --- effects in C++ -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", catalogue())
def test_terms_are_the_force(name: str) -> None:
    """Native terms, of any sign, in a plant of two robots, to the last digits."""
    from dynident.closed_loop.plant.layers import Terms
    from dynident.closed_loop.plant.side_by_side import Bodies

    robot, rng = arm(), np.random.default_rng(0)
    (effect,) = effects_of(name + PLACES[catalogue()[name].place], robot)
    values = tuple(rng.normal(size=len(effect.parameters(robot))))
    if effect.simulated_terms(values, robot) is None:
        assert name not in NATIVE
        return
    body = Mechanism(robot, (TrueEffect(effect, values),), friction_width=0.1)
    other = Mechanism(
        robot, (TrueEffect(effect, tuple(-2.0 * x for x in values)),), friction_width=0.2
    )
    bodies = Bodies((body, other), (0.0, 0.0), np.array([2, 0, 1, 3]))
    found = evaluated(Terms.of(bodies), states := rng.normal(size=(20, 8)) * [[0.1]])
    for k, one in enumerate(bodies.mechanisms):
        own = bodies.place[2 * k : 2 * k + 2]
        expected = one.force(np.zeros(20), states[:, own], states[:, own + 4])
        np.testing.assert_allclose(found[:, own], -expected, rtol=1e-12, atol=1e-13)


def evaluated(terms: Any, states: np.ndarray) -> np.ndarray:
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import ConstantVectorSource, PassThrough

    from dynident.closed_loop.plant.layers import Layers, summed

    builder: Any = DiagramBuilder()
    state = builder.AddSystem(PassThrough(states.shape[1]))
    builder.ExportInput(state.get_input_port(), "state")
    layers = Layers(builder, state.get_output_port(), terms)
    outputs = layers.outputs
    if not outputs:
        nothing: Any = np.zeros(terms.size)
        outputs = [builder.AddSystem(ConstantVectorSource(nothing)).get_output_port()]
    builder.ExportOutput(summed(builder, outputs, terms.size), "force")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    layers.set(context, terms)
    found = []
    for one in states:
        diagram.get_input_port().FixValue(context, one)
        found.append(diagram.get_output_port().Eval(context))
    return np.array(found)


def test_a_negative_motor_inertia_takes_from_the_links() -> None:
    """The first joint turns about the vertical axis of its link: rotor and link are one."""
    robot = arm()
    izz = robot.parameter_names.index("Izz.upper")
    lighter = robot.theta.copy()
    lighter[izz] -= 0.1
    model = Model(robot) + "rotor_inertia@shoulder"
    values = model.given_values()
    values[model.slices["rotor_inertia@shoulder"]] = -0.1
    (one,) = simulate([task(Mechanism.of_model(model, values))], PD, lead_in=0.0)
    (other,) = simulate([task(Mechanism.of(robot.with_theta(lighter)))], PD, lead_in=0.0)
    np.testing.assert_allclose(one.q, other.q, atol=1e-9)
    np.testing.assert_allclose(one.a, other.a, atol=1e-6)


# --- controllers --------------------------------------------------------------------------------


@pytest.mark.parametrize("late", [0.0, 0.3, 1.0, 2.6])
def test_a_delayed_command_acts_when_it_arrives(late: float) -> None:
    """A mass under sampled PD with a delay of any length, against the exact recursion."""
    mass, rate, kp, kd, limit = 2.0, 100.0, 100.0, 20.0, 4.0
    reference = Fourier.random(Robot.from_text(SLIDER), 2.0, 1)
    controller = Controller(
        kind="pd", rate_hz=rate, kp=(kp,), kd=(kd,), limit=(limit,), delay_s=late / rate
    )
    body = Mechanism.of(Robot.from_text(SLIDER))
    loop = ClosedLoop(accuracy=1e-8)
    (run,) = loop.simulate([Task(body, reference, 1.0)], controller, lead_in=0.0)

    def moved(state: np.ndarray, force: float, share: float) -> np.ndarray:
        A = np.array([[0, 1, 0], [0, 0, 1 / mass], [0, 0, 0]]) * share / rate
        return expm(A)[:2] @ np.array([*state, force])

    q_ref, v_ref, _ = (x[:, 0] for x in reference.at(run.t))
    state, before = np.array([q_ref[0], v_ref[0]]), q_ref[0] - v_ref[0] / rate
    whole, rest = int(late), late - int(late)
    u: list[float] = []
    for k in range(len(run.t)):
        np.testing.assert_allclose([run.q[k, 0], run.v[k, 0]], state, atol=1e-9)
        speed = (state[0] - before) * rate
        before = state[0]
        u.append(np.clip(kp * (q_ref[k] - state[0]) + kd * (v_ref[k] - speed), -limit, limit))
        older, newer = u[max(k - whole - 1, 0)], u[max(k - whole, 0)]
        assert run.a[k, 0] == pytest.approx((older if rest else newer) / mass, abs=1e-6)
        state = moved(moved(state, older, rest), newer, 1.0 - rest)
    np.testing.assert_allclose(run.u[:, 0], u, atol=1e-6)
    assert run.saturated[0] == np.mean(np.abs(run.u[:, 0]) >= limit) > 0
    acting = np.array([rest * u[max(k - 1, 0)] + (1 - rest) * u[k] for k in range(len(u))])
    late_by = np.concatenate([np.full(whole, u[0]), acting[: len(u) - whole]])
    np.testing.assert_allclose(run.torque[1:, 0], (late_by[1:] + late_by[:-1]) / 2, atol=1e-6)


@pytest.mark.slow
def test_a_right_model_makes_the_loop_follow_and_a_wrong_one_less() -> None:
    robot = arm()
    heavy = robot.with_theta(1.5 * robot.theta)
    motion = task(Mechanism.of(robot), duration=1.0)
    gains: Any = {"kp": (400.0, 400.0), "kd": (40.0, 40.0)}
    computed = Controller(kind="computed_torque", rate_hz=1000.0, **gains)
    plain = Controller(kind="pd", rate_hz=1000.0, kp=(200.0, 60.0), kd=(20.0, 6.0))
    errors = {}
    for name, controller, nominal in (
        ("right", computed, None),
        ("wrong", computed, heavy),
        ("plain", plain, None),
        ("fed", replace(plain, feedforward=True), robot),
        ("fed wrong", replace(plain, feedforward=True), heavy),
    ):
        (run,) = simulate([replace(motion, nominal=nominal)], controller, lead_in=0.5)
        errors[name] = np.abs(run.q - run.q_ref).max()
    assert errors["right"] < 0.02 * errors["plain"]
    assert errors["fed"] < 0.02 * errors["plain"]
    assert errors["wrong"] > 20 * errors["right"]
    assert errors["fed wrong"] > 20 * errors["fed"]


def test_a_loop_with_an_integral_begins_where_it_would_have_settled() -> None:
    """An arm under gravity that is to stand still does so from the first sample on."""
    robot = arm()
    load = TrueEffect.of("joint_spring", robot, [3.0, 1.0])
    still = SampledReference(np.array([0.0, 1.0]), np.full((2, 2), [0.3, 0.2]))
    pid = Controller(
        kind="pid", rate_hz=500.0, kp=(400.0, 100.0), kd=(30.0, 6.0), ki=(100.0, 100.0)
    )
    (run,) = simulate([Task(Mechanism.of(robot, load), still, 0.5)], pid, lead_in=0.0)
    np.testing.assert_allclose(run.q, run.q_ref, atol=1e-6)


# --- iterates of a fit --------------------------------------------------------------------------


def test_a_mechanism_of_a_model_has_its_torque() -> None:
    model = Model(arm())
    for label in ("viscous_friction", "coulomb_friction", "payload", "drive_gain@elbow"):
        model = model + label
    rng = np.random.default_rng(1)
    values = model.given_values() * rng.uniform(0.8, 1.2, model.size)
    values[model.base.rank :] = rng.uniform(-0.5, 0.5, model.size - model.base.rank)
    q, v, a = model.robot.random_motion(1, 20)
    t = np.arange(20.0)
    for carries in (False, True):
        body = Mechanism.of_model(model, values, carries_payload=carries)
        block = model.block(t, q, v, a, carries_payload=carries)
        np.testing.assert_allclose(body.command(t, q, v, a), model.torque(block, values))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"m.fore": -1.0}, "inertia"),
        ({"Izz.fore": -1.0}, "inertia"),
        ({"m.fore": 0.0}, "massless"),
        ({"m.fore": np.nan}, "setting"),
    ],
)
def test_links_that_cannot_move_are_refused_with_a_reason(changes, reason: str) -> None:
    robot = arm()
    theta = robot.theta.copy()
    for name, value in changes.items():
        theta[robot.parameter_names.index(name)] = value
    loop = ClosedLoop()
    for first in (True, False):
        if not first:  # the same on a diagram that already is there
            loop.simulate([task(Mechanism.of(robot))], PD, lead_in=0.0)
        with pytest.raises(SimulationError) as caught:
            loop.simulate(
                [task(Mechanism.of_model(Model(robot), np.zeros(8)[: Model(robot).size], theta))],
                PD,
            )
        assert caught.value.reason == reason
        assert "\n" not in str(caught.value)


def test_an_inertia_that_is_lost_on_the_way_is_noticed() -> None:
    """The reference stays where M(q) is positive; gravity pulls the arm to where it is not."""
    robot = arm()
    theta = robot.theta.copy()
    theta[robot.parameter_names.index("Izz.upper")] = -0.22
    still = SampledReference(np.array([0.0, 5.0]), np.full((2, 2), [0.0, np.pi / 2]))
    free = Controller(kind="pd", rate_hz=500.0, kp=(0.0, 0.0), kd=(0.0, 0.0))
    lost = Task(Mechanism.of(robot.with_theta(theta)), still, 4.0)
    with pytest.raises(
        SimulationError, match=r"t = .* not positive where the motion went"
    ) as caught:
        simulate([lost], free, lead_in=0.0)
    assert caught.value.reason == "inertia"


def test_unstable_loops_say_so() -> None:
    wild = Controller(kind="pd", rate_hz=100.0, kp=(5000.0, 5000.0), kd=(900.0, 900.0))
    with pytest.raises(SimulationError, match=r"diverges|integrated") as caught:
        simulate([task(Mechanism.of(arm()), duration=5.0)], wild, lead_in=0.0)
    assert caught.value.reason == "unstable"


@pytest.mark.slow
def test_nothing_that_is_tried_ends_the_process() -> None:
    """Random links, effects and gains, of any size: a motion, or one clear line."""
    done = subprocess.run(
        [sys.executable, "-c", FUZZ], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    moved, refused = (int(word) for word in done.stdout.split())
    assert moved > 5 and refused > 50


FUZZ = """
import numpy as np
from tests.synthetic import arm
from dynident.closed_loop import ClosedLoop, Controller, Fourier, Mechanism, Task
from dynident.errors import SimulationError
from dynident.model import Model

robot, loop, moved, refused = arm(), ClosedLoop(), 0, 0
simple = Model(robot)
for name in ("rotor_inertia", "viscous_friction", "coulomb_friction", "torque_offset"):
    simple = simple + name
rich = simple + "joint_coupling@elbow:shoulder" + "stribeck_friction" + "drive_gain"
for seed in range(150):
    rng = np.random.default_rng(seed)
    model = rich if seed % 3 == 0 else simple
    values = rng.normal(size=model.size) * 10.0 ** rng.uniform(-3, 3)
    theta = robot.theta * np.exp(rng.normal(size=20) * rng.choice([0.1, 1.0, 5.0]))
    case = seed % 8
    if case == 1:
        theta[rng.integers(20)] = rng.choice([np.nan, np.inf])
    if case in (2, 4):
        theta = [np.zeros(20), -theta][case // 4]
    if case == 3:
        theta = theta * 10.0 ** rng.uniform(-300, 300)
    if case == 5:
        theta[10 * rng.integers(2)] = 0.0
    if case == 6:
        values[rng.integers(model.size)] = rng.choice([np.nan, np.inf, 1e300, -1e-300])
    gains = 10.0 ** rng.uniform(-6, 12, 4)
    kind = str(rng.choice(["pd", "computed_torque"]))
    delay = 0.0013 * (seed % 2)
    controller = Controller(
        kind=kind, rate_hz=500.0, kp=gains[:2], kd=gains[2:], delay_s=delay
    )
    try:
        body = Mechanism.of_model(model, values, theta)
        reference = Fourier.random(robot, 2.0, seed)
        (run,) = loop.simulate([Task(body, reference, 0.05)], controller, lead_in=0.0)
        assert all(np.isfinite(x).all() for x in (run.q, run.v, run.a, run.u))
        moved += 1
    except SimulationError as error:
        assert "\\n" not in str(error), error
        refused += 1
print(moved, refused)
"""


def test_settings_that_cannot_be_are_refused() -> None:
    robot = arm()
    body = Mechanism.of(robot)
    settings: dict[str, Any]
    for settings, words in (
        ({"feedback_scale": np.ones(3)}, "feedback_scale"),
        ({"feedback_scale": np.array([1.0, np.nan])}, "feedback_scale"),
        ({"feedback_scale": np.array([1.0, -1.0])}, "feedback_scale"),
    ):
        with pytest.raises(SimulationError, match=words):
            ClosedLoop().simulate([task(body)], PD, **settings)
    with pytest.raises(SimulationError, match="accuracy"):
        ClosedLoop(accuracy=0.0)
    with pytest.raises(SimulationError, match="rate is not stated") as caught:
        simulate([task(body)], replace(PD, rate_hz=None))
    assert caught.value.reason == "clock"
    slider = Robot.from_text(SLIDER)
    with pytest.raises(SimulationError, match="nominal robot of 1 joints"):
        simulate([task(body, nominal=slider)], PD)

    class Wild:
        n = 2

        def at(self, t: np.ndarray):
            x = np.full((len(t), 2), np.nan)
            return x, x, x

    with pytest.raises(SimulationError, match="position is not finite") as caught:
        simulate([Task(body, Wild(), 1.0)], PD)
    assert caught.value.reason == "reference"
