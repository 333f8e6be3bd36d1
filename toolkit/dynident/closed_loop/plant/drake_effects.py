"""Forces that need Python as systems of a Drake diagram."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from dynident.closed_loop.plant.point_force import PointForce


class ForceSystem(LeafSystem):
    """What effects add to the generalised force on the plant; it keeps their internal states."""

    def __init__(self, size: int, force: PointForce, memory: int = 0) -> None:
        LeafSystem.__init__(self)
        self.force = force
        self.state = self.DeclareVectorInputPort("state", 2 * size)
        self.output = self.DeclareVectorOutputPort("force", size, self._calculate)
        if memory:
            self.DeclareContinuousState(memory)

    def _calculate(self, context: Any, output: Any) -> None:
        x: Any = self.state.Eval(context)
        z = context.get_continuous_state_vector().CopyToVector()
        output.SetFromVector(self.force(context.get_time(), x, z))

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        """Let the internal states change; Drake's name."""
        z = context.get_continuous_state_vector().CopyToVector()
        if len(z):
            x: Any = self.state.Eval(context)
            rate = self.force.rate(context.get_time(), x, z)
            derivatives.get_mutable_vector().SetFromVector(rate)


class InertiaSystem(LeafSystem):
    """The force of an inertia A that is neither a body's nor a motor's own.

    It is -A a, with a the acceleration that solves (M + A) a = u - bias + other forces; all in the
    plant's order, M with the motors. The acceleration of the plant under this force is then a.

    Attributes
    ----------
    A : (N, N) kg m^2, ..., to be set before each simulation.
    parameters : the Context in which the bodies' and motors' inertias are set, the plant's alone.
    """

    def __init__(self, plant: Any, has_other_forces: bool) -> None:
        LeafSystem.__init__(self)
        size = plant.num_velocities()
        self.A = np.zeros((size, size))
        self.parameters = plant.CreateDefaultContext()
        self._plant, self._actuation = plant, plant.MakeActuationMatrix()
        self.state = self.DeclareVectorInputPort("state", 2 * size)
        self.torque = self.DeclareVectorInputPort("torque", size)
        self.others = self.DeclareVectorInputPort("others", size) if has_other_forces else None
        self.output = self.DeclareVectorOutputPort("force", size, self._calculate)

    def _calculate(self, context: Any, output: Any) -> None:
        x: Any = self.state.Eval(context)
        if not np.isfinite(x).all():  # which would end the process inside Drake
            raise RuntimeError("the state is not finite")
        plant, parameters = self._plant, self.parameters
        torque: Any = self.torque.Eval(context)
        load = self._actuation @ torque
        if self.others is not None:
            load += self.others.Eval(context)
        plant.SetPositionsAndVelocities(parameters, x)
        load -= plant.CalcBiasTerm(parameters)
        load += plant.CalcGravityGeneralizedForces(parameters)
        mass = plant.CalcMassMatrix(parameters)
        output.SetFromVector(-self.A @ np.linalg.solve(mass + self.A, load))
