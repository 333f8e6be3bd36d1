"""The compiled loop: Drake's on the same steps, and as near to its answer as it promises."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.synthetic import arm

from dynident.batch import compiler
from dynident.closed_loop import (
    ClosedLoop,
    Controller,
    Fourier,
    Mechanism,
    Rollout,
    Sensors,
    Task,
    TrueEffect,
    loop_evaluations,
)
from dynident.closed_loop.compiled.loop_function import CompiledLoop, compiled_loop
from dynident.closed_loop.compiled.many_rollouts import loop_input
from dynident.closed_loop.motion_plan import Plan, PlanSettings, Stacked
from dynident.errors import DynidentError, SimulationError
from dynident.robot import Robot

needs_compiler = pytest.mark.skipif(compiler.compiler() is None, reason="no C compiler")
PD = Controller(kind="pd", rate_hz=500.0, kp=(800.0, 200.0), kd=(60.0, 12.0))
LIMITED = replace(PD, limit=(25.0, 6.0), derivative_cutoff_hz=60.0, delay_s=0.0031)
PID = Controller(kind="pid", rate_hz=400.0, kp=(800.0, 200.0), kd=(60.0, 12.0), ki=(900.0, 300.0))
CASCADE = Controller(
    kind="cascade", rate_hz=1000.0, kp=(12.0, 15.0), kv=(9.0, 2.0), drive_gain=(6.0, 5.0)
)
COMPUTED = Controller(kind="computed_torque", rate_hz=500.0, kp=(400.0, 300.0), kd=(40.0, 30.0))
AHEAD = replace(PD, feedforward=True, delay_s=0.002, velocity_reference=False)
CONTROLLERS = {
    "pd": PD,
    "limited": LIMITED,
    "pid": replace(PID, limit=(40.0, 9.0)),
    "cascade": CASCADE,
    "computed torque": COMPUTED,
    "feed-forward": AHEAD,
}
FRICTION = {"viscous_friction": [0.4], "coulomb_friction": [0.6], "rotor_inertia": [0.02]}
RICH = FRICTION | {
    "stribeck_friction@elbow": [0.3],
    "quadratic_drag@shoulder": [0.1],
    "joint_spring@elbow": [0.4, 0.3],
    "torque_offset@shoulder": [0.2],
    "asymmetric_friction@elbow": [0.05, 0.1],
    "torque_ripple@elbow": {"As": 0.1},
    "drive_gain@elbow": [0.1],
    "load_friction@shoulder": [0.05],
    "presliding@shoulder": [0.2],
    "thermal_friction@elbow": [0.1, 0.2],
    "torque_drift@elbow": [0.01],
    "base_tilt": [0.02, -0.01],
    "joint_coupling@elbow:shoulder": {"ca": 0.01, "cv": 0.1},
}
SLIDING = """<robot name="crane"><link name="base"/>
  <link name="jib"><inertial><origin xyz="0.4 0.1 0"/><mass value="3"/>
    <inertia ixx="0.1" ixy="0.02" ixz="0" iyy="0.5" iyz="0.01" izz="0.5"/></inertial></link>
  <link name="trolley"><inertial><origin xyz="0 0.05 -0.1"/><mass value="2"/>
    <inertia ixx="0.05" ixy="0" ixz="0.01" iyy="0.06" iyz="0" izz="0.03"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="jib"/>
    <origin rpy="1.2 0.1 0.3" xyz="0 0 0.5"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-1.5" upper="1.5" velocity="2" effort="50"/></joint>
  <joint name="elbow" type="prismatic"><parent link="jib"/><child link="trolley"/>
    <origin rpy="0.2 0 0.4" xyz="0.3 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.4" upper="0.4" velocity="1" effort="50"/></joint></robot>"""


@pytest.fixture
def always(monkeypatch) -> None:
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")


def mechanism(robot: Robot, effects: dict[str, Any], **settings: Any) -> Mechanism:
    found = [one for label, x in effects.items() for one in TrueEffect.of(label, robot, x)]
    return Mechanism.of(robot, found, **settings)


def task(body: Mechanism, seed: int = 1, duration: float = 0.4, **settings: Any) -> Task:
    return Task(body, Fourier.random(body.robot, 2.0, seed), duration, **settings)


def settings_of(controller: Controller, sensors: Sensors, accuracy: float = 1e-3) -> PlanSettings:
    noise = sensors.each("position_std", 2), sensors.each("position_resolution", 2)
    return PlanSettings(
        controller=controller,
        position_std=noise[0],
        resolution=noise[1],
        scale=np.array([0.9, 1.1]),
        before=10,
        accuracy=accuracy,
    )


def by_drake_on_steps(plan: Plan, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and commands, by the classical Runge-Kutta rule over Drake's diagram."""
    from dynident.closed_loop.plant.diagram import Plant
    from dynident.closed_loop.stepped_motion import Hold

    plant, stacked, rate = Plant([plan.task.mechanism]), Stacked.of([plan]), plan.run.rate
    plant.set([plan.task.mechanism], [plan.task.start])
    context, first = plant.context, stacked.reference
    held = plant.diagram.get_input_port().FixValue(context, np.zeros(2))
    y = plant.start(first.q[0], first.v[0], first.a[0])
    hold, order = Hold.of(plan.run.controller.delay_s, rate), np.argsort(plant.inputs)

    def slope(t: float, at: np.ndarray) -> np.ndarray:
        context.SetTime(t)
        context.SetContinuousState(at)
        return plant.diagram.EvalTimeDerivatives(context).CopyToVector()

    def stretch(t: float, length: float, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        held.GetMutableData().get_mutable_value().SetFromVector((u / plant.gain)[order])
        h = length / steps
        for k in range(steps):
            now = t + k * h
            k1 = slope(now, y)
            k2 = slope(now + h / 2, y + h / 2 * k1)
            k3 = slope(now + h / 2, y + h / 2 * k2)
            k4 = slope(now + h, y + h * k3)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return y

    positions, commands = np.empty((2, plan.samples, 2))
    for k, t in enumerate(plan.run.time(plan.kept)[:-1]):
        positions[k] = y[plant.positions]
        commands[k] = stacked.drive.command(k, stacked.measurement.of(k, positions[k]))
        rest = hold.rest / rate if k else 0.0
        if rest:
            y = stretch(t, rest, commands[max(k - hold.late - 1, 0)], y)
        y = stretch(t + rest, 1.0 / rate - rest, commands[max(k - hold.late, 0)], y)
    return positions, commands


# --- the same as Drake's ----------------------------------------------------------------------


@needs_compiler
@pytest.mark.parametrize("kind", CONTROLLERS)
@pytest.mark.parametrize(
    ("robot", "effects"),
    [
        (arm(), RICH),
        (Robot.from_text(SLIDING), FRICTION | {"stribeck_friction@elbow": [0.3]}),
    ],
    ids=["rich", "sliding"],
)
def test_it_is_drakes_on_the_same_steps(kind: str, robot: Robot, effects: dict[str, Any], always):
    body = mechanism(robot, effects, friction_width=0.05)
    heavier = robot.with_theta(1.1 * robot.theta)
    inside = mechanism(heavier, {"coulomb_friction@shoulder": [0.5], "drive_gain@elbow": [0.2]})
    rng = np.random.default_rng(7)
    one = task(body, nominal=inside, start=3.0, rng=rng)
    sensors = Sensors(position_std=1e-6, position_resolution=(0.0, 1e-5))
    plan = Plan(one, 40, settings_of(CONTROLLERS[kind], sensors))
    expected, u_expected = by_drake_on_steps(plan, 2)
    through = CONTROLLERS[kind].law.through_model
    loop = compiled_loop(body, inside if through else body)
    assert not isinstance(loop, str)
    given = replace(loop_input(plan, {}, {}), accuracy=np.inf, steps=(1, 1))
    motion = loop.run(loop.function(0), given)
    assert not isinstance(motion, str)
    assert np.ptp(expected, axis=0).min() > 0.005, "it moves"
    np.testing.assert_allclose(motion.q, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.u, u_expected, rtol=1e-9, atol=1e-9)


@needs_compiler
@pytest.mark.parametrize("kind", CONTROLLERS)
def test_it_is_near_to_drakes_error_controlled_answer(kind: str, always):
    body = mechanism(arm(), FRICTION | {"stribeck_friction@elbow": [0.3]}, friction_width=0.02)
    tasks = [task(body, seed, 0.3) for seed in (1, 2)]
    found = both(tasks, CONTROLLERS[kind], lead_in=0.1)
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one.q, other.q, rtol=0, atol=1e-6)
        np.testing.assert_allclose(one.torque, other.torque, rtol=0, atol=1e-3 * np.ptp(other.u))
        np.testing.assert_array_equal(one.q_ref, other.q_ref)
        np.testing.assert_array_equal(one.saturated > 0, other.saturated > 0)
        np.testing.assert_allclose(one.a, other.a, rtol=0, atol=2e-3 * np.abs(other.a).max())


def both(tasks: list[Task], controller: Controller, **settings: Any) -> tuple[Any, Any]:
    """Rollouts of the compiled loop, and of Drake's at a far higher accuracy."""
    loop, exact = ClosedLoop(), ClosedLoop(accuracy=1e-6, integrator="drake")
    made = (
        loop.simulate(tasks, controller, **settings),
        exact.simulate(tasks, controller, **settings),
    )
    assert loop.notes == ()
    assert loop.builds == 1
    return made


@needs_compiler
def test_a_tighter_accuracy_is_nearer(always):
    """Whatever the rate: the steps follow the error, not the samples."""
    body = mechanism(arm(), FRICTION, friction_width=0.01)
    slow = replace(PD, rate_hz=100.0, kp=(300.0, 80.0), kd=(15.0, 3.0))
    (exact,) = ClosedLoop(accuracy=1e-8, integrator="drake").simulate([task(body)], slow)
    off = []
    for accuracy in (1e-2, 1e-4, 1e-6):
        (found,) = ClosedLoop(accuracy=accuracy).simulate([task(body)], slow)
        off.append(np.abs(found.q - exact.q).max())
    assert off[0] < 1e-4
    assert off[0] > 3 * off[1] > 9 * off[2]


@needs_compiler
def test_stiff_friction_takes_more_steps_or_goes_to_drake(always, monkeypatch):
    """h Fc / (w J) is about 20 at a step a sample, where the rule diverges from 2.8 on."""
    robot = arm()
    body = mechanism(robot, FRICTION, friction_width=2e-3)
    slow = replace(PD, kp=(80.0, 20.0), kd=(6.0, 1.2))
    turning = task(body, duration=0.9)
    (exact,) = ClosedLoop(accuracy=1e-6, integrator="drake").simulate([turning], slow, lead_in=0.0)
    loop = ClosedLoop()
    (found,) = loop.simulate([turning], slow, lead_in=0.0)
    assert loop.notes == ()
    assert np.any(np.diff(np.sign(found.v), axis=0)), "it reverses"
    np.testing.assert_allclose(found.q, exact.q, rtol=0, atol=1e-6)
    plan = Plan(turning, 450, settings_of(slow, Sensors()))
    made = compiled_loop(body, body)
    assert not isinstance(made, str)
    given = loop_input(plan, {}, {})
    refused = made.run(made.function(0), replace(given, steps=(0, 0)))
    assert refused == "it is too stiff for the steps of the compiled loop"
    monkeypatch.setattr(CompiledLoop, "run", lambda *_: refused)
    (drakes,) = ClosedLoop(integrator="drake").simulate([turning], slow, lead_in=0.0)
    other = ClosedLoop()
    (again,) = other.simulate([replace(turning, name="run1")], slow, lead_in=0.0)
    assert same(again, drakes)
    assert other.notes == (f"Drake simulates 'run1': {refused}.",)


@needs_compiler
def test_exchanged_names_are_another_loop(always):
    """The same tree, whose traced effect is at the other joint."""
    names = {"shoulder": "elbow", "elbow": "shoulder"}
    robot = arm()
    joints = tuple(replace(one, name=names.get(one.name, one.name)) for one in robot.joints)
    effects = FRICTION | {"presliding@shoulder": [2.0]}
    for one in (robot, replace(robot, joints=joints)):
        found = both([task(mechanism(one, effects, friction_width=0.05))], PD, lead_in=0.0)
        np.testing.assert_allclose(found[0][0].q, found[1][0].q, rtol=0, atol=1e-6)


# --- many at once -----------------------------------------------------------------------------


@needs_compiler
def test_many_at_once_are_those_of_one_by_one(always):
    robot, rng = arm(), np.random.default_rng(0)
    shared = Fourier.random(robot, 2.0, 5)

    def tasks() -> list[Task]:
        return [
            Task(
                mechanism(robot.with_theta(robot.theta * (1 + 0.01 * k)), FRICTION),
                shared,
                0.1 + 0.01 * (k % 3),
                rng=np.random.default_rng(k),
            )
            for k in range(70)
        ]

    loop, told = ClosedLoop(), []
    sensors = Sensors(position_std=1e-5)
    many = loop.simulate(
        tasks(), PD, sensors, lead_in=0.02, progress=lambda *step: told.append(step)
    )
    assert loop.builds == 1, "one function for all parameters"
    assert told[-1][0] == pytest.approx(told[-1][1])
    for k in rng.choice(70, 6, replace=False):
        (one,) = ClosedLoop().simulate([tasks()[k]], PD, sensors, lead_in=0.02)
        for name in ("q", "v", "q_measured", "u", "torque"):
            np.testing.assert_array_equal(getattr(many[k], name), getattr(one, name))


# --- who simulates ----------------------------------------------------------------------------


def same(one: Rollout, other: Rollout) -> bool:
    return bool(np.array_equal(one.q, other.q) and np.array_equal(one.u, other.u))


@needs_compiler
def test_what_is_no_formula_goes_to_drake(always):
    robot = arm()
    elastic = TrueEffect.of("joint_elasticity@elbow", robot, [1e-3])
    body = Mechanism.of(robot, (*TrueEffect.of("rotor_inertia", robot, [0.05]), *elastic))
    plain = mechanism(robot, FRICTION)
    loop = ClosedLoop()
    soft, stiff = loop.simulate([task(body), task(plain)], PD, lead_in=0.1)
    (alone,) = ClosedLoop(integrator="drake").simulate([task(body)], PD, lead_in=0.1)
    assert same(soft, alone)
    assert loop.builds == 2
    (why,) = (note for note in loop.notes if note.startswith("Drake simulates"))
    assert "joint_elasticity@elbow" in why
    (compiled,) = ClosedLoop().simulate([task(plain)], PD, lead_in=0.1)
    assert same(stiff, compiled)


@needs_compiler
def test_what_fails_is_refused_in_drakes_words(always):
    """Both where the loop diverges and where the inertia is lost on the way."""
    robot = arm()
    wild = replace(PD, kp=(8e5, 2e5), kd=(6e3, 2e3))
    negative = mechanism(robot, {})
    theta = robot.theta.copy()
    theta[10 + 7 :] = -1.0
    lost = Mechanism.of(robot.with_theta(theta))
    for body, controller in ((negative, wild), (lost, PD)):
        said = []
        for integrator in ("auto", "drake"):
            with pytest.raises(SimulationError) as refused:
                ClosedLoop(integrator=integrator).simulate([task(body, name="run1")], controller)
            said.append((str(refused.value), refused.value.reason))
        assert said[0] == said[1]


@needs_compiler
def test_the_environment_and_the_work_decide(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    body = mechanism(arm(), FRICTION)
    (drakes,) = ClosedLoop(integrator="drake").simulate([task(body)], PD)
    monkeypatch.setenv("DYNIDENT_COMPILE", "never")
    (never,) = ClosedLoop().simulate([task(body)], PD)
    monkeypatch.setenv("DYNIDENT_COMPILE", "auto")
    (few,) = ClosedLoop().simulate([task(body, duration=0.1)], PD, lead_in=0.0)
    (short,) = ClosedLoop(integrator="drake").simulate([task(body, duration=0.1)], PD, lead_in=0.0)
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")
    (compiled,) = ClosedLoop().simulate([task(body)], PD)
    monkeypatch.setenv("DYNIDENT_COMPILE", "auto")
    (many,) = ClosedLoop(repeats=20).simulate([task(body)], PD)
    (cool,) = ClosedLoop().simulate([task(body)], PD)
    assert same(many, compiled)
    assert same(cool, drakes), "that there is a function by now changes no answer"
    assert same(never, drakes)
    assert same(few, short)
    assert not same(compiled, drakes)
    ways = {one.way for one in loop_evaluations()}
    assert ways >= {"Drake", "compiled"}


def test_without_a_compiler_drake_simulates_and_says_so(monkeypatch, tmp_path):
    from dynident.closed_loop.compiled import loop_function

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("DYNIDENT_COMPILE", "always")
    monkeypatch.setattr(compiler, "compiler", lambda: None)
    monkeypatch.setattr(loop_function, "_loops", {})
    body = mechanism(arm(), FRICTION)
    loop = ClosedLoop()
    (found,) = loop.simulate([task(body)], PD)
    (drakes,) = ClosedLoop(integrator="drake").simulate([task(body)], PD)
    assert same(found, drakes)
    assert any("no C compiler" in note for note in loop.notes)


def test_no_other_integrator() -> None:
    with pytest.raises(SimulationError, match="integrators: auto, drake"):
        ClosedLoop(integrator="euler")  # type: ignore[arg-type]


def test_a_model_that_remembers_computes_no_torque_in_either_loop(always):
    robot = arm()
    body = mechanism(robot, FRICTION | {"presliding@shoulder": [1.0]})
    law = replace(PD, kind="computed_torque")
    for integrator in ("auto", "drake"):
        one = replace(task(body), nominal=body)
        with pytest.raises(DynidentError, match="presliding@shoulder"):
            ClosedLoop(integrator=integrator).simulate([one], law)
