"""The diagram of closed loops side by side, stepped from sample to sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder

from dynident.closed_loop.compiled import point_force
from dynident.closed_loop.controllers import Controller, Drive
from dynident.closed_loop.drake_effects import ForceSystem, InertiaSystem
from dynident.closed_loop.rollout import Task
from dynident.errors import SimulationError
from dynident.robot.drake import add_to_plant

_SMALLEST_STEP = 1e-4
"""Of a sample; a motion that needs smaller ones is on its way to infinity."""
_WINDOW = 200
"""Samples between looks at the whole motion."""
_RUNAWAY = 100.0
"""A state this many times beyond the reference's has left the earth."""


class Loop:
    """The diagram of some tasks; all vectors are stacked task by task (N joints in all)."""

    def __init__(self, tasks: Sequence[Task], controller: Controller, accuracy: float) -> None:
        self._tasks, self._accuracy, self._rate = tasks, accuracy, controller.simulated_rate()
        self._joints = [
            (task.name, name, unit)
            for task in tasks
            for name, unit in zip(
                task.mechanism.robot.names, task.mechanism.robot.units, strict=True
            )
        ]
        repeated = {
            name: tuple(value) * len(tasks)
            for name in ("kp", "kd", "kv", "ki", "limit")
            if (value := getattr(controller, name)) is not None
        }
        self._controller = replace(controller, **repeated)
        self._gain = np.concatenate([task.mechanism.gain for task in tasks])
        self._inertia = _diagonal_blocks([task.mechanism.inertia for task in tasks])
        # Motor inertia is Drake's own; only the rest is left to the system of the effects.
        self._motor = np.maximum(np.diag(self._inertia), 0.0)
        self._diagram = self._build()

    def _build(self) -> Diagram:
        # Drake's type stubs know neither shapes nor the classes that it returns: hence Any.
        builder: Any = DiagramBuilder()
        plant: Any = builder.AddSystem(MultibodyPlant(0.0))
        parts = [
            add_to_plant(replace(task.mechanism.robot, name=f"robot{k}"), plant)
            for k, task in enumerate(self._tasks)
        ]
        actuators = [actuator for part in parts for actuator in part.actuators]
        for actuator, inertia in zip(actuators, self._motor, strict=True):
            actuator.set_default_rotor_inertia(inertia)
        plant.Finalize()
        # In a tree of joints of one degree, positions and velocities stand in the same order.
        self._place = np.concatenate([part.velocity_indices() for part in parts])
        self._inputs = np.concatenate([part.input_indices() for part in parts])
        self._plant = plant
        builder.ExportInput(plant.get_actuation_input_port(), "torque")
        force = point_force(
            [task.mechanism for task in self._tasks],
            [task.start for task in self._tasks],
            self._place,
        )
        rest = self._inertia - np.diag(self._motor)
        generalized = plant.get_applied_generalized_force_input_port()
        if np.any(rest):
            effects: Any = builder.AddSystem(
                InertiaSystem(plant, force, _permuted(rest, self._place))
            )
            builder.ConnectInput("torque", effects.torque)
        elif force is not None:
            effects = builder.AddSystem(ForceSystem(plant, force))
        else:
            return builder.Build()
        builder.Connect(plant.get_state_output_port(), effects.state)
        builder.Connect(effects.output, generalized)
        return builder.Build()

    def check_inertia(self, poses: np.ndarray) -> None:
        """Refuse robots whose joint-space inertia is not positive at one of the poses (T, N)."""
        context, place = self._plant.CreateDefaultContext(), self._place
        for pose in poses:
            self._plant.SetPositions(context, _scattered(pose, place))
            mass = self._plant.CalcMassMatrix(context)[np.ix_(place, place)]
            whole = mass - np.diag(self._motor) + self._inertia
            n = self._tasks[0].mechanism.robot.n
            for k, task in enumerate(self._tasks):
                own = slice(k * n, k * n + n)
                least = _least_eigenvalue(mass[own, own])
                if not (least > 0 and np.linalg.det(whole[own, own]) > 0):
                    robot = task.mechanism.robot
                    at = zip(robot.names, pose[own], strict=True)
                    raise SimulationError(
                        f"the joint-space inertia is not positive (least eigenvalue {least:.3g})",
                        f"{robot.name} at " + ", ".join(f"{j} = {x:.3g}" for j, x in at),
                        "check the inertias of the robot (dynident check) and of its effects",
                    )

    def run(
        self, time, q_ref, v_ref, noise, resolution, progress
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return q, v, measured q and commands, (T, N); references start one sample earlier."""
        total, size = noise.shape
        place, inputs = self._place, np.argsort(self._inputs)
        coarse, fine = bool(np.any(resolution > 0)), resolution == 0
        step = np.where(fine, 1.0, resolution)
        beyond = (_RUNAWAY * (1.0 + np.abs(q_ref).max() + np.abs(v_ref).max())) ** 2

        simulator: Any = Simulator(self._diagram)
        # Above one sample, or rounding of the time would leave a second, tiny step.
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 2.0 / self._rate)
        integrator = simulator.get_mutable_integrator()
        integrator.set_target_accuracy(self._accuracy)
        integrator.set_requested_minimum_step_size(_SMALLEST_STEP / self._rate)
        context = simulator.get_mutable_context()
        context.SetTime(time[0])
        held: Any = self._diagram.get_input_port().FixValue(context, np.zeros(size))
        context.SetContinuousState(
            np.concatenate([_scattered(q_ref[1], place), _scattered(v_ref[1], place)])
        )
        state = context.get_continuous_state_vector()
        simulator.Initialize()
        drive = Drive(self._controller, q_ref[0], v_ref[0])
        states, measured, commands = (np.empty((total, w)) for w in (2 * size, size, size))
        every = max(1, total // 200)
        for k in range(total):
            states[k] = x = state.CopyToVector()
            if not x @ x < beyond:  # true of NaN too
                raise self._diverged(time[k], x)
            q = x[place] + noise[k]
            if coarse:
                q = np.where(fine, q, np.rint(q / step) * step)
            measured[k] = q
            commands[k] = u = drive.command(q, q_ref[k + 1], v_ref[k + 1])
            held.GetMutableData().get_mutable_value().SetFromVector((u / self._gain)[inputs])
            try:
                simulator.AdvanceTo(time[k + 1])
            except RuntimeError as error:
                raise self._diverged(time[k], state.CopyToVector(), error) from None
            if k % _WINDOW == _WINDOW - 1:
                self._check_chatter(time[k], states[k + 1 - _WINDOW : k + 1], v_ref)
            if progress is not None and (k % every == 0 or k + 1 == total):
                progress((k + 1) / self._rate, total / self._rate)
        return states[:, place], states[:, size + place], measured, commands

    def _check_chatter(self, time: float, states: np.ndarray, v_ref: np.ndarray) -> None:
        """Refuse a loop whose speed swings from sample to sample by more than it follows."""
        v = states[:, len(self._place) + self._place]
        swing, pace = _rms(np.diff(v, 2, axis=0)), _rms(v_ref)
        # A joint that stands still swings by its encoder's noise alone.
        worst = int(np.argmax(swing / np.maximum(pace, 0.1 * pace.max() + 1e-9)))
        if swing[worst] > max(pace[worst], 0.1 * pace.max()) > 0:
            raise self._failure(worst, time, "the loop oscillates from sample to sample")

    def _diverged(self, time: float, x: np.ndarray, cause: Exception | None = None):
        speeds = x[len(self._place) + self._place]
        worst = int(np.argmax(np.where(np.isfinite(speeds), np.abs(speeds), np.inf)))
        what = "the loop diverges"
        if cause is not None:
            what = "the loop cannot be integrated"
            what += f" ({str(cause).strip().splitlines()[0].rstrip('.')})"
        return self._failure(worst, time, what, speeds[worst])

    def _failure(
        self, joint: int, time: float, what: str, speed: float | None = None
    ) -> SimulationError:
        task, name, unit = self._joints[joint]
        what += f": joint '{name}'" + ("" if speed is None else f" moves at {speed:.3g} {unit}/s")
        where = f"{task}, t = {time:.4g} s" if task else f"t = {time:.4g} s"
        return SimulationError(what, where, "lower the controller's gains, or raise its rate_hz")


def _diagonal_blocks(blocks: Sequence[np.ndarray]) -> np.ndarray:
    size, n = sum(len(block) for block in blocks), len(blocks[0])
    full = np.zeros((size, size))
    for k, block in enumerate(blocks):
        full[k * n : k * n + n, k * n : k * n + n] = block
    return full


def _rms(x: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(x**2, axis=0))


def _least_eigenvalue(matrix: np.ndarray) -> float:
    return float(np.linalg.eigvalsh(matrix)[0]) if np.isfinite(matrix).all() else float("nan")


def _permuted(matrix: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the plant's matrix of one that is in our order."""
    full = np.empty_like(matrix)
    full[np.ix_(place, place)] = matrix
    return full


def _scattered(values: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the plant's vector of values that are in our order."""
    vector = np.empty(len(values))
    vector[place] = values
    return vector
