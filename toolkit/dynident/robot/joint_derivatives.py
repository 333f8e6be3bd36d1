"""Derivatives of the torque along a motion, evaluated joint by joint as they are asked for."""

from __future__ import annotations

from functools import cached_property

from dynident.robot.dynamics import TorqueDerivatives
from dynident.robot.robot import Robot
from dynident.robot.tree import Array


class JointDerivatives:
    """Derivatives of a robot's torque by the motion of each joint.

    Of many samples only those of the joints that are asked for are evaluated, which is most of
    the time one; of few, all at once.

    Parameters
    ----------
    robot : with the bodies that count.
    q, v, a : (T, n) in rad or m, and per s and s^2.
    """

    def __init__(self, robot: Robot, q: Array, v: Array, a: Array) -> None:
        self._robot, self._motion = robot, (q, v, a)
        self._known: dict[int, TorqueDerivatives] = {}

    def by(self, joint: int) -> TorqueDerivatives:
        """Return the derivatives by one joint's q, v and a: [t, i] = d tau_i / d x.

        Parameters
        ----------
        joint : column of the joint.

        Returns
        -------
        (T, n) each.
        """
        if joint not in self._known:
            found = self._robot.torque_derivatives_by(joint, *self._motion)
            if found is None:
                by_q, by_v, by_a = (x[:, :, joint] for x in self._all)
                found = TorqueDerivatives(by_q, by_v, by_a)
            self._known[joint] = found
        return self._known[joint]

    @cached_property
    def _all(self) -> tuple[Array, Array, Array]:
        every = self._robot.torque_derivatives(*self._motion)
        return every.by_q, every.by_v, every.by_a
