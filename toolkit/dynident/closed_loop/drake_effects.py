"""The force of effects as systems of a Drake diagram."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from dynident.closed_loop.compiled import PointForce


class ForceSystem(LeafSystem):
    """What effects add to the generalised force on the plant."""

    def __init__(self, plant: Any, force: PointForce) -> None:
        LeafSystem.__init__(self)
        size = plant.num_velocities()
        self._force = force
        self.state = self.DeclareVectorInputPort("state", 2 * size)
        self.output = self.DeclareVectorOutputPort("force", size, self._calculate)

    def _calculate(self, context: Any, output: Any) -> None:
        x: Any = self.state.Eval(context)
        output.SetFromVector(self._force(context.get_time(), x))


class InertiaSystem(LeafSystem):
    """The same where effects also bring an inertia A that is not the motors' own.

    It takes A a, with a the acceleration that solves (M + A) a = u - bias - force; all in the
    plant's order.
    """

    def __init__(self, plant: Any, force: PointForce | None, A: np.ndarray) -> None:
        LeafSystem.__init__(self)
        size = plant.num_velocities()
        self._force, self._A = force, A
        self._plant, self._context = plant, plant.CreateDefaultContext()
        self._actuation = plant.MakeActuationMatrix()
        self.state = self.DeclareVectorInputPort("state", 2 * size)
        self.torque = self.DeclareVectorInputPort("torque", size)
        self.output = self.DeclareVectorOutputPort("force", size, self._calculate)

    def _calculate(self, context: Any, output: Any) -> None:
        x: Any = self.state.Eval(context)
        plant = self._plant
        torque: Any = self.torque.Eval(context)
        load = self._actuation @ torque
        added = 0.0 if self._force is None else self._force(context.get_time(), x)
        plant.SetPositionsAndVelocities(self._context, x)
        load += added - plant.CalcBiasTerm(self._context)
        load += plant.CalcGravityGeneralizedForces(self._context)
        mass = plant.CalcMassMatrix(self._context)
        output.SetFromVector(added - self._A @ np.linalg.solve(mass + self._A, load))
