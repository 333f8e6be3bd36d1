"""The diagram of mechanisms side by side: built once for a structure, then given parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from scipy.linalg import block_diag

from dynident.closed_loop.mechanism import Mechanism, Past
from dynident.closed_loop.plant.drake_effects import ForceSystem, InertiaSystem
from dynident.closed_loop.plant.drivetrain import DrivetrainSystem, Gears, Layout
from dynident.closed_loop.plant.layers import Layers, Terms, summed
from dynident.closed_loop.plant.point_force import point_force
from dynident.closed_loop.plant.side_by_side import (
    Bodies,
    giving_way,
    is_coupled,
    with_other_forces,
)
from dynident.errors import DynidentError, SimulationError
from dynident.inertia import to_drake
from dynident.robot.drake import add_to_plant

_FAR = 1e6
"""rad or m; no pose is beyond."""
_SETTLING = 5
"""Iterations for the weight of a link to hang where its spring carries it."""
_LOST = 0.01
"""Least eigenvalue of the inertia over that along the reference, below which it is lost."""


@contextmanager
def _refusals() -> Iterator[None]:
    """Turn what the rooms below refuse into this room's error."""
    try:
        yield
    except DynidentError as error:
        raise SimulationError(error.what, error.where, error.remedy, reason="massless") from None


class Plant:
    """Mechanisms of n joints each, in one Drake diagram; stacked vectors are (N,), N = K n.

    Attributes
    ----------
    diagram : its input is the actuation (N,) in the order of `inputs`.
    context : the diagram's, with the parameters that were set last.
    place : (N,) where each joint stands in the plant's positions and velocities.
    inputs : (N,) where each joint stands in the plant's actuation.
    positions, speeds : (N,) where the motion of each joint's motor stands in the diagram's state;
        the plant's own state comes first.
    remembers : whether there are states besides the plant's.
    gain : (N,) recorded torque per torque that acts.
    """

    def __init__(self, mechanisms: Sequence[Mechanism]) -> None:
        # Drake's type stubs know neither shapes nor the classes that it returns: hence Any.
        builder: Any = DiagramBuilder()
        plant: Any = builder.AddSystem(MultibodyPlant(0.0))
        with _refusals():
            self._parts = [
                add_to_plant(replace(one.robot, name=f"robot{k}"), plant)
                for k, one in enumerate(mechanisms)
            ]
        plant.Finalize()
        # In a tree of joints of one degree, positions and velocities stand in the same order.
        self.place = np.concatenate([part.velocity_indices() for part in self._parts])
        self.inputs = np.concatenate([part.input_indices() for part in self._parts])
        self._plant, size = plant, plant.num_velocities()
        state = plant.get_state_output_port()
        bodies = self._bodies(mechanisms, [0.0] * len(mechanisms))
        self._compliant = giving_way(mechanisms)
        self._train: Any = None
        seen, terms, others = state, Terms.of(bodies), with_other_forces(bodies)
        computed = any(one.effects for one in others.mechanisms)
        if len(self._compliant) or any(np.any(one.loss) for one in mechanisms):
            layout = Layout(self.place, self.inputs)
            has_forces = computed or bool(terms.terms)
            self._train = DrivetrainSystem(layout, self._compliant, has_forces)
            builder.AddSystem(self._train)
            builder.Connect(state, self._train.state)
            builder.ExportInput(self._train.torque, "torque")
            builder.Connect(self._train.acting, plant.get_actuation_input_port())
            seen = self._train.seen
        else:
            builder.ExportInput(plant.get_actuation_input_port(), "torque")
        self._layers = Layers(builder, seen, terms)
        outputs = self._layers.outputs
        self._forces: Any = None
        if computed:
            force = point_force(others)
            self._forces = builder.AddSystem(ForceSystem(size, force, others.memory))
            builder.Connect(seen, self._forces.state)
            outputs.append(self._forces.output)
        if self._train is not None:
            if self._train.forces is not None:
                builder.Connect(summed(builder, outputs, size), self._train.forces)
            outputs = [self._train.applied]
        self._coupling: Any = None
        if any(is_coupled(one.inertia) for one in mechanisms):
            self._coupling = builder.AddSystem(InertiaSystem(plant, bool(outputs)))
            builder.Connect(state, self._coupling.state)
            if self._train is None:
                builder.ConnectInput("torque", self._coupling.torque)
            else:
                builder.Connect(self._train.acting, self._coupling.torque)
            if outputs:
                builder.Connect(summed(builder, outputs, size), self._coupling.others)
            outputs.append(self._coupling.output)
        if outputs:
            generalized = plant.get_applied_generalized_force_input_port()
            builder.Connect(summed(builder, outputs, size), generalized)
        self.positions, self.speeds = self.place.copy(), size + self.place
        own = np.arange(len(self._compliant))
        self.positions[self._compliant] = 2 * size + own
        self.speeds[self._compliant] = 2 * size + len(own) + own
        self.remembers = bool(len(own) or others.memory)
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()

    @property
    def count(self) -> int:
        """Number of mechanisms, K."""
        return len(self._parts)

    def set(self, mechanisms: Sequence[Mechanism], starts: Sequence[float]) -> None:
        """Give the bodies and effects the values of mechanisms of the same structure.

        Raises
        ------
        SimulationError
            If a body has a first moment without mass.
        """
        self._mechanisms = tuple(mechanisms)
        bodies = self._bodies(mechanisms, starts)
        inertia: np.ndarray = np.asarray(block_diag(*(one.inertia for one in mechanisms)))
        self._set_train(mechanisms, inertia)
        self._inertia, motors = inertia, np.diag(inertia)
        self.gain = np.concatenate([one.gain for one in mechanisms])
        contexts = [self._plant.GetMyMutableContextFromRoot(self.context)]
        if self._coupling is not None:
            contexts.append(self._coupling.parameters)
            rest = inertia - np.diag(motors)
            self._coupling.A[np.ix_(self.place, self.place)] = rest
        actuators = [actuator for part in self._parts for actuator in part.actuators]
        for part, mechanism in zip(self._parts, mechanisms, strict=True):
            robot = mechanism.robot
            for k, body in enumerate(part.bodies):
                phi = robot.theta[10 * k : 10 * k + 10]
                with _refusals():
                    value = to_drake(phi, f"body '{robot.bodies[k]}'")
                for context in contexts:
                    body.SetSpatialInertiaInBodyFrame(context, value)
        for actuator, value in zip(actuators, motors, strict=True):
            for context in contexts:
                # Drake takes any value here, and refuses a hinge without positive inertia later.
                actuator.SetRotorInertia(context, value)
        self._layers.set(self.context, Terms.of(bodies))
        if self._forces is not None:
            self._forces.force.set(with_other_forces(bodies))

    def _set_train(self, mechanisms: Sequence[Mechanism], inertia: np.ndarray) -> None:
        """Set the drivetrain; motors before a spring are its own, not the plant's."""
        if self._train is None:
            return
        at = self._compliant
        rest = inertia - np.diag(np.diag(inertia))
        if np.any(rest[at]) or np.any(rest[:, at]):
            what = "the inertia of a motor is coupled to a joint that gives way"
            raise SimulationError(what, remedy="leave out the coupling's ca, or the transmission")
        inertia[at, at] = 0.0
        widths = np.concatenate([one.friction_widths for one in mechanisms])
        self._train.set_loss(np.concatenate([one.loss for one in mechanisms]), widths)
        self._train.gears = Gears([gear for one in mechanisms for gear in one.transmissions])
        names = [one.robot.names[gear.joint] for one in mechanisms for gear in one.transmissions]
        self._train.gears.require_integrable(names)

    def start(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the diagram's state where motors move so, (N,) each, and springs carry the load.

        Internal states of effects are zero.

        Parameters
        ----------
        q, v, a : (N,) rad or m, and derivatives.
        """
        at, size = self._compliant, len(self.place)
        state = np.zeros(self.context.num_continuous_states())
        state[self.positions], state[self.speeds] = q, v
        link = q.copy()
        for _ in range(_SETTLING if len(at) else 0):
            load = np.empty_like(link)
            for k, one in enumerate(self._mechanisms):
                own = self._columns(k)
                motion = (x[None, own] for x in (link, v, a))
                load[own] = one.robot.inverse_dynamics(*motion)[0]
            link[at] = q[at] - self._train.gears.bent(load[at])
        state[self.place], state[size + self.place] = link, v
        return state

    def past(self, states: np.ndarray) -> Past:
        """Return what is not the motors' motion of the diagram's states (T, .)."""
        size = len(self.place)
        memory = states[:, 2 * size + 2 * len(self._compliant) :]
        return Past(states[:, self.place], states[:, size + self.place], memory)

    def require_inertia(self, poses: np.ndarray) -> None:
        """Refuse robots whose joint-space inertia is not positive at one of the poses (T, N).

        Raises
        ------
        SimulationError
        """
        mass = self._mass(poses)
        # Motors are in it; the rest makes a matrix that need not be symmetric.
        rest = self._inertia - np.diag(np.diag(self._inertia))
        self._least = np.empty(len(self._mechanisms))
        for k, mechanism in enumerate(self._mechanisms):
            own = self._columns(k)
            least = _least_eigenvalues(mass[:, own, own])
            whole = np.zeros(len(least))
            sound = least > 0
            whole[sound], _ = np.linalg.slogdet(mass[sound][:, own, own] + rest[own, own])
            bad = np.flatnonzero(whole <= 0)
            if len(bad):
                at = zip(mechanism.robot.names, poses[bad[0], own], strict=True)
                raise SimulationError(
                    "the joint-space inertia is not positive (least eigenvalue "
                    f"{least[bad[0]]:.3g})",
                    f"{mechanism.robot.name} at " + ", ".join(f"{j} = {x:.3g}" for j, x in at),
                    "check the inertias of the robot (dynident check) and of its effects",
                    reason="inertia",
                )
            self._least[k] = least.min()

    def inertia_is_lost(self, pose: np.ndarray, k: int) -> bool:
        """Whether the inertia of mechanism k nearly vanishes at a pose (N,) of them all.

        Nearly, because accelerations run away before it does.
        """
        if not (np.abs(pose) < _FAR).all():
            return False
        own = self._columns(k)
        least = _least_eigenvalues(self._mass(pose[None])[:, own, own])[0]
        return bool(least < _LOST * self._least[k])

    def _columns(self, k: int) -> slice:
        n = self._mechanisms[0].robot.n
        return slice(k * n, k * n + n)

    def _mass(self, poses: np.ndarray) -> np.ndarray:
        """Return the joint-space inertia with the motors at poses (T, N), (T, N, N)."""
        context, place = self._plant.GetMyMutableContextFromRoot(self.context), self.place
        mass = np.empty((len(poses), len(place), len(place)))
        for one, pose in zip(mass, poses, strict=True):
            self._plant.SetPositions(context, scattered(pose, place))
            one[:] = self._plant.CalcMassMatrix(context)[np.ix_(place, place)]
        return mass

    def notes(self) -> tuple[str, ...]:
        """Say what is not evaluated in C++."""
        found = [
            one.effect.label
            for mechanism in self._mechanisms
            for one in mechanism.effects
            if one in mechanism.others
            or is_coupled(one.effect.simulated_inertia(one.values, mechanism.robot))
            or one.effect.simulated_transmission(one.values, mechanism.robot) is not None
            or np.any(one.effect.simulated_loss(one.values, mechanism.robot))
        ]
        return tuple(
            f"{label} is evaluated in Python, which makes the simulation slower."
            for label in dict.fromkeys(found)
        )

    def _bodies(self, mechanisms: Sequence[Mechanism], starts: Sequence[float]) -> Bodies:
        return Bodies(tuple(mechanisms), tuple(starts), self.place)


def _least_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the least eigenvalue of each (T, n, n); NaN where an entry is not finite."""
    sound = np.isfinite(matrices).all(axis=(1, 2))
    least = np.full(len(matrices), np.nan)
    least[sound] = np.linalg.eigvalsh(matrices[sound])[:, 0]
    return least


def scattered(values: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the plant's vector of values that are in our order."""
    vector = np.empty(len(values))
    vector[place] = values
    return vector
