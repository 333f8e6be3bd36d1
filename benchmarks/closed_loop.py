"""Simulated closed loops, beside the loops that one writes by hand.

The seven-joint arm of problems/iiwa follows its validation motion under its PD law: viscous
friction, Coulomb friction as tanh(v / w), rotor inertias, ideal sensors. All start on the
reference, and hold each command to the next sample. Then many rollouts in one call, what another
robot costs in a diagram that stands against building one, and the instrumental variable estimate of
problems/scara.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Adder, LogVectorOutput

import dynident as di
from dynident.closed_loop import ClosedLoop, Sensors, Task
from dynident.closed_loop.loop import Integrator
from dynident.closed_loop.plant.diagram import Plant
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

PROBLEMS = Path(__file__).parents[1] / "problems"
ACCURACY, EXACT = 1e-3, 1e-9  # of Drake's error control
RATES_HZ = (200.0, 1000.0)
PIN: Any = pin  # its modules have no stubs
MUJOCO: Any = mujoco


@dataclass(frozen=True, eq=False)
class Loop:
    """What all simulate.

    Attributes
    ----------
    task, controller : as dynident has them.
    urdf : of the arm.
    q_ref, v_ref : (T, n) at the controller's samples.
    rotors, viscous, coulomb : (n,)
    width : of Coulomb friction, rad/s.
    """

    task: Task
    controller: di.closed_loop.Controller
    urdf: Path
    q_ref: np.ndarray
    v_ref: np.ndarray
    rotors: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    width: float

    @property
    def step(self) -> float:
        return 1.0 / self.controller.simulated_rate()

    def law(self, k: int, q: np.ndarray, before: np.ndarray) -> np.ndarray:
        """The command of sample k."""
        kp, kd = np.array(self.controller.kp), np.array(self.controller.kd)
        return kp * (self.q_ref[k] - q) + kd * (self.v_ref[k] - (q - before) / self.step)


def loop(rate_hz: float, seconds: float) -> Loop:
    experiment = di.closed_loop.load_experiment(PROBLEMS / "iiwa" / "experiment.toml")
    mechanism = experiment.mechanism()
    (test,) = (run for run in experiment.runs if run.use == "test")
    controller = replace(experiment.controller, rate_hz=rate_hz)
    q, v, _ = test.trajectory.at(np.arange(round(seconds * rate_hz)) / rate_hz)
    values = {one.effect.label: one.values[0] for one in experiment.effects}
    found = {
        kind: np.array([values[f"{kind}@{joint}"] for joint in mechanism.robot.names])
        for kind in ("rotor_inertia", "viscous_friction", "coulomb_friction")
    }
    task = Task(mechanism, test.trajectory, seconds)
    urdf = PROBLEMS / "iiwa" / "iiwa.urdf"
    width = float(mechanism.friction_widths[0])
    return Loop(task, controller, urdf, q, v, *found.values(), width=width)


Result = tuple[np.ndarray, np.ndarray]  # positions and commands at the samples, (T, n)


def ours(one: Loop, accuracy: float, integrator: Integrator) -> Callable[[], Result]:
    closed = ClosedLoop(accuracy=accuracy, integrator=integrator)

    def run() -> Result:
        (rollout,) = closed.simulate([one.task], one.controller, lead_in=0.0)
        return rollout.q, rollout.u

    return run


class HandController(LeafSystem):
    """A PD law with a held command and a backward difference."""

    def __init__(self, one: Loop) -> None:
        super().__init__()
        self.loop, n = one, one.q_ref.shape[1]
        self.DeclareVectorInputPort("state", 2 * n)
        declare: Any = self.DeclareDiscreteState
        command = declare(np.zeros(n))
        self.before = declare(one.q_ref[0] - one.step * one.v_ref[0])
        self.DeclarePeriodicDiscreteUpdateEvent(one.step, 0.0, self.update)
        self.DeclareStateOutputPort("command", command)

    def update(self, context: Any, discrete: Any) -> None:
        k = min(round(context.get_time() / self.loop.step), len(self.loop.q_ref) - 1)
        state: Any = self.get_input_port().Eval(context)
        q = state[: self.loop.q_ref.shape[1]]
        before = context.get_discrete_state(self.before).value()
        discrete.set_value(0, self.loop.law(k, q, before))
        discrete.set_value(1, q)


class HandFriction(LeafSystem):
    """Viscous and Coulomb friction of every joint."""

    def __init__(self, one: Loop) -> None:
        super().__init__()
        self.loop, self.n = one, one.q_ref.shape[1]
        self.DeclareVectorInputPort("state", 2 * self.n)
        self.DeclareVectorOutputPort("torque", BasicVector(self.n), self.torque)

    def torque(self, context: Any, output: Any) -> None:
        state: Any = self.get_input_port().Eval(context)
        v = state[self.n :]
        output.SetFromVector(
            -self.loop.viscous * v - self.loop.coulomb * np.tanh(v / self.loop.width)
        )


def drake_by_hand(one: Loop, accuracy: float) -> Callable[[], Result]:
    builder: Any = DiagramBuilder()
    plant: Any = builder.AddSystem(MultibodyPlant(0.0))
    parser: Any = Parser(plant)
    parser.AddModels(str(one.urdf))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    for name, rotor in zip(one.task.mechanism.robot.names, one.rotors, strict=True):
        actuator = plant.AddJointActuator(name, plant.GetJointByName(name))
        actuator.set_default_rotor_inertia(rotor)
        actuator.set_default_gear_ratio(1.0)
    plant.Finalize()
    controller = builder.AddSystem(HandController(one))
    friction = builder.AddSystem(HandFriction(one))
    total = builder.AddSystem(Adder(2, one.q_ref.shape[1]))
    builder.Connect(plant.get_state_output_port(), controller.get_input_port())
    builder.Connect(plant.get_state_output_port(), friction.get_input_port())
    builder.Connect(controller.get_output_port(), total.get_input_port(0))
    builder.Connect(friction.get_output_port(), total.get_input_port(1))
    builder.Connect(total.get_output_port(), plant.get_actuation_input_port())
    states = LogVectorOutput(plant.get_state_output_port(), builder, one.step)
    commands = LogVectorOutput(controller.get_output_port(), builder, one.step)
    diagram = builder.Build()

    def run() -> Result:
        simulator: Any = Simulator(diagram)
        context = simulator.get_mutable_context()
        plant_context = plant.GetMyMutableContextFromRoot(context)
        plant.SetPositions(plant_context, one.q_ref[0])
        plant.SetVelocities(plant_context, one.v_ref[0])
        ResetIntegratorFromFlags(simulator, "runge_kutta3", one.step)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        simulator.Initialize()
        simulator.AdvanceTo(one.task.duration)
        count, n = one.q_ref.shape
        # A command that is logged at its sample is that of the sample before.
        return (
            states.FindLog(context).data()[:n, :count].T,
            commands.FindLog(context).data()[:, 1 : count + 1].T,
        )

    return run


def pinocchio_by_hand(one: Loop, steps: int) -> Callable[[], Result]:
    model: Any = PIN.buildModelFromUrdf(str(one.urdf))
    model.armature = one.rotors
    data = model.createData()
    h = one.step / steps

    def acceleration(q: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        torque = u - one.viscous * v - one.coulomb * np.tanh(v / one.width)
        return PIN.aba(model, data, q, v, torque)

    def run() -> Result:
        q, v = one.q_ref[0].copy(), one.v_ref[0].copy()
        before = q - one.step * v
        positions, commands = np.empty_like(one.q_ref), np.empty_like(one.q_ref)
        for k in range(len(one.q_ref)):
            u = one.law(k, q, before)
            before = positions[k] = q
            commands[k] = u
            for _ in range(steps):
                a1 = acceleration(q, v, u).copy()
                v2 = v + h / 2 * a1
                a2 = acceleration(q + h / 2 * v, v2, u).copy()
                v3 = v + h / 2 * a2
                a3 = acceleration(q + h / 2 * v2, v3, u).copy()
                v4 = v + h * a3
                a4 = acceleration(q + h * v3, v4, u)
                q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
                v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        return positions, commands

    return run


def mujoco_by_hand(one: Loop, steps: int, integrator: str) -> Callable[[], Result]:
    """The friction beside the viscous is an applied force, held for a step."""
    model = MUJOCO.MjModel.from_xml_path(str(one.urdf))
    model.opt.timestep = one.step / steps
    model.opt.integrator = getattr(MUJOCO.mjtIntegrator, f"mjINT_{integrator.upper()}")
    for flag in ("CONTACT", "LIMIT"):
        model.opt.disableflags |= getattr(MUJOCO.mjtDisableBit, f"mjDSBL_{flag}")
    model.dof_armature[:] = one.rotors
    # A polynomial in the speed where there are several: the first is viscous.
    model.dof_damping.reshape(model.nv, -1)[:, 0] = one.viscous

    def run() -> Result:
        data = MUJOCO.MjData(model)
        data.qpos[:], data.qvel[:] = one.q_ref[0], one.v_ref[0]
        before = data.qpos - one.step * data.qvel
        positions, commands = np.empty_like(one.q_ref), np.empty_like(one.q_ref)
        for k in range(len(one.q_ref)):
            q = data.qpos.copy()
            u = one.law(k, q, before)
            before = positions[k] = q
            commands[k] = u
            for _ in range(steps):
                data.qfrc_applied[:] = u - one.coulomb * np.tanh(data.qvel / one.width)
                MUJOCO.mj_step(model, data)
        return positions, commands

    return run


# --- side by side --------------------------------------------------------------------------------


@single_threaded
def lines(size: Size) -> Iterator[Line]:
    seconds, repeats = {"tiny": (0.2, 1), "quick": (2.0, 1), "full": (10.0, 5)}[size]
    with compiled():
        for rate in RATES_HZ[:1] if size == "tiny" else RATES_HZ:
            yield from loops(loop(rate, seconds), repeats)
        yield from many(loop(RATES_HZ[0], seconds), {"tiny": 2, "quick": 20, "full": 1000}[size])
    yield from reparametrised(loop(RATES_HZ[0], seconds), repeats)
    if size != "tiny":
        yield from scara(min(repeats, 3))


def loops(one: Loop, repeats: int) -> Iterator[Line]:
    """Everyone's loop, with its errors against one of high accuracy."""
    exact, u_exact = ours(one, EXACT, "drake")()
    substeps = max(1, round(one.step / 1e-3))
    contestants = {
        f"dynident, compiled, accuracy {ACCURACY:g}": ours(one, ACCURACY, "auto"),
        f"dynident in Drake, accuracy {ACCURACY:g}": ours(one, ACCURACY, "drake"),
        "Drake by hand, same integrator and accuracy": drake_by_hand(one, ACCURACY),
        "RK4 over pinocchio.aba, 1 step a sample": pinocchio_by_hand(one, 1),
        "RK4 over pinocchio.aba, 2 steps a sample": pinocchio_by_hand(one, 2),
        "mj_step, implicitfast, 1 ms": mujoco_by_hand(one, substeps, "implicitfast"),
        "mj_step, RK4, 1 step a sample": mujoco_by_hand(one, 1, "rk4"),
    }
    case = f"{one.task.duration:g} s at {1 / one.step:g} Hz"
    for who, run in contestants.items():
        first, _ = cpu(run)
        spent, (q, u) = cpu(run, repeats)
        off = np.sqrt(np.mean((u - u_exact) ** 2) / np.mean(u_exact**2))
        figures = {
            "CPU per simulated s, ms": 1e3 * spent / one.task.duration,
            "first run, ms": 1e3 * first,
            "error of q, rad": float(np.abs(q - exact).max()),
            "of the command, %": 100 * float(off),
        }
        yield Line(case=case, who=who, figures=figures)


@contextmanager
def compiled() -> Iterator[None]:
    """Have functions compiled whether it pays or not; where there is no compiler, Drake runs."""
    before = os.environ.get("DYNIDENT_COMPILE")
    os.environ["DYNIDENT_COMPILE"] = "always"
    try:
        yield
    finally:
        del os.environ["DYNIDENT_COMPILE"]
        if before is not None:
            os.environ["DYNIDENT_COMPILE"] = before


def many(one: Loop, count: int) -> Iterator[Line]:
    """Robots and encoder noise at random, as a bootstrap has them."""
    mechanism, sensors = one.task.mechanism, Sensors(position_std=1e-5)
    few = max(1, count // 25)  # Drake's
    ways: tuple[tuple[str, Integrator, int], ...] = (
        ("dynident, compiled", "auto", count),
        (f"dynident in Drake, from {few} of them", "drake", few),
    )
    for who, integrator, number in ways:
        rng = np.random.default_rng(0)
        tasks = []
        for k in range(number):
            theta = mechanism.robot.theta * (1.0 + 0.01 * rng.standard_normal())
            body = replace(mechanism, robot=mechanism.robot.with_theta(theta))
            tasks.append(replace(one.task, mechanism=body, rng=np.random.default_rng(k)))
        closed = ClosedLoop(integrator=integrator)
        begun = time.perf_counter()
        spent, _ = cpu(lambda c=closed, t=tasks: c.simulate(t, one.controller, sensors))
        share = count / number
        figures = {"all, ms": 1e3 * share * spent}
        figures["elapsed, s"] = share * (time.perf_counter() - begun)
        case = f"{count} rollouts of {one.task.duration:g} s at {1 / one.step:g} Hz"
        yield Line(case=case, who=who, figures=figures)


def reparametrised(one: Loop, repeats: int) -> Iterator[Line]:
    """Another robot in a diagram that stands, against another diagram."""
    mechanism = one.task.mechanism
    build, plant = cpu(lambda: Plant([mechanism]), repeats)
    heavier = replace(mechanism, robot=mechanism.robot.with_theta(1.1 * mechanism.robot.theta))
    give, _ = cpu(lambda: [plant.set([one], [0.0]) for one in (heavier, mechanism)], repeats)
    for who, spent in (
        ("dynident, the standing one set", give / 2),
        ("dynident, built anew", build),
    ):
        yield Line(case="diagram of another robot", who=who, figures={"all, ms": 1e3 * spent})


def scara(repeats: int) -> Iterator[Line]:
    study = di.load(PROBLEMS / "scara" / "study.toml")
    assert study.controller is not None
    method = di.IV(study.controller, start="regular")
    for name, dataset in (
        ("filtered", study.train),
        ("unfiltered", replace(study.train, filter=di.Filter())),
    ):
        spent, _ = cpu(lambda d=dataset: di.fit(study.model, d, method), repeats)
        case = f"instrumental variables, `problems/scara`, {name}"
        yield Line(case=case, who="dynident.IV", figures={"all, ms": 1e3 * spent})


BENCHMARK = Benchmark(
    title="A simulated closed loop",
    work="The arm of `problems/iiwa` along its validation motion: PD law, held commands, rotor "
    "inertias, viscous and Coulomb friction (tanh). Errors are against the same loop at accuracy "
    "1e-9: the largest of the positions, and the root mean square of the commands over theirs. For "
    "`mj_step` the dry friction is an applied force, held for a step.",
    compared="CPU per simulated s, ms",
    lines=lines,
)
