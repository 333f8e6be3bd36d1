"""What stands between the torques that are commanded and the plant, where that is not nothing.

Dry friction that grows with the torque, and transmissions that give way. A joint that gives way has
a motor of its own, whose position and speed are continuous states beside the plant's; encoder and
effects are on the motor's side, and the plant feels what the transmission carries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from dynident.effects import Transmission
from dynident.errors import SimulationError

_FASTEST = 1e5
"""rad/s, or 1/s: a motor against its spring that is faster takes too many steps."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where K robots of n joints stand in a plant; N = K n.

    Attributes
    ----------
    place : (N,) where each joint stands in the plant's positions and velocities.
    inputs : (N,) where each joint stands in the plant's actuation.
    """

    place: np.ndarray
    inputs: np.ndarray


class Gears:
    """Transmissions at c joints, as arrays (c,)."""

    def __init__(self, gears: Sequence[Transmission]) -> None:
        self.stiffness = np.array([one.stiffness for one in gears])
        self.damping = np.array([one.damping for one in gears])
        self.half_gap = np.array([one.gap / 2.0 for one in gears])
        self.rotor = np.array([one.rotor for one in gears])
        self._has_gaps = bool(np.any(self.half_gap > 0))

    def require_integrable(self, joints: Sequence[str]) -> None:
        """Refuse what is faster than an integrator can follow.

        Raises
        ------
        SimulationError
        """
        fastest = np.maximum(np.sqrt(self.stiffness / self.rotor), self.damping / self.rotor)
        for joint, rate in zip(joints, fastest, strict=True):
            if not rate < _FASTEST:
                what = f"the transmission is too stiff to be integrated ({rate:.2g} rad/s)"
                remedy = "choose a larger compliance, or a larger rotor inertia"
                raise SimulationError(what, f"joint '{joint}'", remedy, reason="unstable")

    def torque(self, bent: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the transmitted torque of deflections and their rates."""
        if not self._has_gaps:
            return self.stiffness * bent + self.damping * rate
        half = self.half_gap
        torque = self.stiffness * (bent - np.minimum(np.maximum(bent, -half), half))
        return torque + self.damping * rate * (np.abs(bent) >= half)

    def bent(self, torque: np.ndarray) -> np.ndarray:
        """Return the deflections that carry torques at rest."""
        return torque / self.stiffness + self.half_gap * np.sign(torque)


class DrivetrainSystem(LeafSystem):
    """Losses and transmissions of joints, in the plant's order.

    Parameters
    ----------
    layout : of the joints.
    compliant : (c,) which of them give way.
    has_forces : whether effects act on top of the torques.

    Attributes
    ----------
    gears : parameters of the c transmissions, to be set before each simulation; `set_loss` sets
        those of the losses.
    """

    def __init__(self, layout: Layout, compliant: np.ndarray, has_forces: bool) -> None:
        LeafSystem.__init__(self)
        self._size, self._count = len(layout.place), len(compliant)
        self._at, self._drive = layout.place[compliant], layout.inputs[compliant]
        self._motion_at = np.concatenate([self._at, self._size + self._at])
        # Of each actuator, where its joint stands among the velocities.
        self._joint_of = layout.place[np.argsort(layout.inputs)]
        self._order = np.argsort(layout.inputs)
        self.gears = Gears(())
        self.set_loss(np.zeros(self._size), np.ones(self._size))
        self.state = self.DeclareVectorInputPort("state", 2 * self._size)
        motion = {self.input_port_ticket(self.state.get_index()), self.xc_ticket()}
        self.torque = self.DeclareVectorInputPort("torque", self._size)
        self.forces = self.DeclareVectorInputPort("forces", self._size) if has_forces else None
        self.seen = self.DeclareVectorOutputPort("seen", 2 * self._size, self._see, motion)
        self.acting = self.DeclareVectorOutputPort("acting", self._size, self._act)
        self.applied = self.DeclareVectorOutputPort("applied", self._size, self._apply)
        if self._count:
            self.DeclareContinuousState(self._count, self._count, 0)

    def set_loss(self, loss: np.ndarray, widths: np.ndarray) -> None:
        """Take the dry friction per torque, and the width of its change of sign, of N joints."""
        self._loss, self._widths = loss[self._order], widths[self._order]
        self._loses = bool(np.any(loss))

    def _motors(self, context: Any) -> np.ndarray:
        return context.get_continuous_state_vector().CopyToVector()

    def _motion(self, context: Any) -> np.ndarray:
        """Return the state (2 N,) with the motors' at joints that give way."""
        x: Any = self.state.Eval(context)
        if self._count:
            x = np.array(x)
            x[self._motion_at] = self._motors(context)
        return x

    def _driving(self, context: Any) -> np.ndarray:
        """Return the torques that are left of the commanded ones, in the actuators' order."""
        torque: Any = self.torque.Eval(context)
        if not self._loses:
            return torque
        sign = np.tanh(self._motion(context)[self._size + self._joint_of] / self._widths)
        return torque / (1.0 + self._loss * sign * np.sign(torque))

    def _carried(self, context: Any) -> np.ndarray:
        x: Any = self.state.Eval(context)
        apart = self._motors(context) - x[self._motion_at]
        return self.gears.torque(apart[: self._count], apart[self._count :])

    def _see(self, context: Any, output: Any) -> None:
        output.SetFromVector(self._motion(context))

    def _act(self, context: Any, output: Any) -> None:
        torque = self._driving(context)
        if self._count:
            torque = np.array(torque)
            torque[self._drive] = 0.0
        output.SetFromVector(torque)

    def _apply(self, context: Any, output: Any) -> None:
        force = np.zeros(self._size)
        if self.forces is not None:
            effects: Any = self.forces.Eval(context)
            force += effects
        if self._count:
            force[self._at] = self._carried(context)
        output.SetFromVector(force)

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        """Let the motors move; Drake's name."""
        c = self._count
        if not c:
            return
        load = self._driving(context)[self._drive] - self._carried(context)
        if self.forces is not None:
            forces: Any = self.forces.Eval(context)
            load = load + forces[self._at]
        rates = np.concatenate([self._motors(context)[c:], load / self.gears.rotor])
        derivatives.get_mutable_vector().SetFromVector(rates)
