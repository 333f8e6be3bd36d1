"""Time of a simulated closed loop, beside the loops that one writes by hand.

    python benchmarks/closed_loop.py [--repeats 5] [--accuracy 1e-3]

The seven-joint arm of problems/iiwa follows its validation motion for 10 s under its PD law at
200 Hz: viscous friction, Coulomb friction as tanh(v / w), rotor inertias, ideal sensors. All start
on the reference, and hold each command to the next sample.

  dynident     ClosedLoop.simulate, once built
  drake        the same in Drake as users write it: controller and friction as LeafSystems in
               Python, commands held by a discrete update, LogVectorOutput; same integrator
               and accuracy
  pinocchio    pinocchio.aba in a Python loop, RK4 with one and with two steps a sample

Each is compared with the loop simulated at accuracy 1e-9: largest position error, and the rms error
of the command over its rms. Then the instrumental variable estimate of problems/scara (40 s, from
the regular start), and what another robot costs in a diagram that stands against building one.
Times are the median of some runs in one process, in ms of CPU. On a machine with other work they
are larger: look at the load that is printed first.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pinocchio as pin
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Adder, LogVectorOutput

import dynident as di
from dynident.closed_loop import ClosedLoop, Task
from dynident.closed_loop.plant.diagram import Plant
from dynident.threads import single_threaded

PROBLEMS = Path(__file__).parents[1] / "problems"
DURATION = 10.0  # s
PIN: Any = pin  # its modules have no stubs


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


def loop() -> Loop:
    experiment = di.closed_loop.load_experiment(PROBLEMS / "iiwa" / "experiment.toml")
    mechanism = experiment.mechanism()
    (test,) = (run for run in experiment.runs if run.use == "test")
    rate = experiment.controller.simulated_rate()
    q, v, _ = test.trajectory.at(np.arange(round(DURATION * rate)) / rate)
    values = {one.effect.label: one.values[0] for one in experiment.effects}
    found = {
        kind: np.array([values[f"{kind}@{joint}"] for joint in mechanism.robot.names])
        for kind in ("rotor_inertia", "viscous_friction", "coulomb_friction")
    }
    task = Task(mechanism, test.trajectory, DURATION)
    urdf = PROBLEMS / "iiwa" / "iiwa.urdf"
    width = float(mechanism.friction_widths[0])
    return Loop(task, experiment.controller, urdf, q, v, *found.values(), width=width)


Result = tuple[np.ndarray, np.ndarray]  # positions and commands at the samples, (T, n)


def ours(one: Loop, accuracy: float) -> Callable[[], Result]:
    closed = ClosedLoop(accuracy=accuracy)

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
        simulator.AdvanceTo(DURATION)
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


# --- times ---------------------------------------------------------------------------------------


def timed(what: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    times, result = [], None
    for _ in range(repeats):
        start = time.process_time()
        result = what()
        times.append(time.process_time() - start)
    return 1e3 * median(times), result


def loops(accuracy: float, repeats: int) -> None:
    one = loop()
    exact, u_exact = ours(one, 1e-9)()
    first, run = timed(lambda: ours(one, accuracy)(), 1)
    print(f"7 joints, {DURATION:g} s at 200 Hz, accuracy {accuracy:g}; errors against 1e-9")
    print(f"{'':28s} {'CPU ms':>8s} {'q, rad':>9s} {'command':>9s}")
    rows = (
        ("dynident", ours(one, accuracy)),
        ("drake, by hand", drake_by_hand(one, accuracy)),
        ("pinocchio, 1 step a sample", pinocchio_by_hand(one, 1)),
        ("pinocchio, 2 steps a sample", pinocchio_by_hand(one, 2)),
    )
    for name, run in rows:
        run()  # built, and loaded
        ms, (q, u) = timed(run, repeats)
        off = np.sqrt(np.mean((u - u_exact) ** 2) / np.mean(u_exact**2))
        print(f"{name:28s} {ms:8.0f} {np.abs(q - exact).max():9.1e} {off:9.1e}")
    print(f"{'dynident, first run':28s} {first:8.0f}")
    reparametrised(one, repeats)


def reparametrised(one: Loop, repeats: int) -> None:
    """Another robot in a diagram that stands, against another diagram."""
    mechanism = one.task.mechanism
    build, plant = timed(lambda: Plant([mechanism]), repeats)
    heavier = replace(mechanism, robot=mechanism.robot.with_theta(1.1 * mechanism.robot.theta))
    others = (heavier, mechanism)
    give, _ = timed(lambda: [plant.set([other], [0.0]) for other in others], repeats)
    print(f"other parameters: {give / 2:.2f} ms; another diagram: {build:.1f} ms")


def scara(repeats: int) -> None:
    study = di.load(PROBLEMS / "scara" / "study.toml")
    assert study.controller is not None
    method = di.IV(study.controller, start="regular")
    for name, dataset in (
        ("filtered", study.train),
        ("unfiltered", replace(study.train, filter=di.Filter())),
    ):
        ms, found = timed(lambda d=dataset: di.fit(study.model, d, method), repeats)
        print(f"scara, {name}: IV from the regular start {ms:.0f} ms, {found.status}")


@single_threaded
def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--accuracy", type=float, default=1e-3)
    said = parser.parse_args()
    print(f"load of the last minute: {os.getloadavg()[0]:.2f} on {os.cpu_count()} processors")
    loops(said.accuracy, said.repeats)
    scara(min(said.repeats, 3))


if __name__ == "__main__":
    main()
