"""Regressor and inverse dynamics through Pinocchio.

Pinocchio is given joints and inertias by us, never a file: its parsers change broken inertias.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio

from dynident.inertia import to_pinocchio
from dynident.robot.tree import Array

if TYPE_CHECKING:
    from dynident.robot.robot import Robot

# The bindings carry no types.
pin: Any = pinocchio

_AXES = np.eye(3)
_ALIGNED = {
    "revolute": (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ),
    "prismatic": (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
}
_TILTED = {
    "revolute": pin.JointModelRevoluteUnaligned,
    "prismatic": pin.JointModelPrismaticUnaligned,
}


def _kinematics(robot: Robot) -> tuple[Any, list[int]]:
    """Return a massless model and, for each of its joints, the index in `robot.joints`."""
    model = pin.Model()
    model.name = robot.name
    model.gravity = pin.Motion(np.asarray(robot.gravity), np.zeros(3))
    children: dict[int, list[int]] = {}
    for index, joint in enumerate(robot.joints):
        children.setdefault(joint.parent, []).append(index)
    ids = {-1: 0}
    order: list[int] = []
    # Depth first, as Pinocchio's subtree bookkeeping wants it.
    waiting = children.get(-1, [])[::-1]
    while waiting:
        index = waiting.pop()
        joint = robot.joints[index]
        placement = pin.SE3(np.array(joint.R), np.array(joint.p))
        ids[index] = model.addJoint(
            ids[joint.parent], _joint_model(joint.kind, joint.axis), placement, joint.name
        )
        order.append(index)
        waiting.extend(children.get(index, [])[::-1])
    return model, order


def _joint_model(kind: str, axis: Array):
    for aligned, unit in zip(_ALIGNED[kind], _AXES, strict=True):
        if np.array_equal(axis, unit):
            return aligned()
    return _TILTED[kind](np.array(axis))


def _inertia(phi: Array) -> Any:
    return pin.Inertia.FromDynamicParameters(np.array(phi))


def pinocchio_model(robot: Robot, theta: Array) -> Any:
    """Return the Pinocchio model of a robot; see `Robot.pinocchio`."""
    model, order = _kinematics(robot)
    for pin_id, index in enumerate(order, start=1):
        phi = theta[10 * index : 10 * index + 10]
        model.inertias[pin_id] = to_pinocchio(phi, f"body '{robot.bodies[index]}'")
    return model


@dataclass(frozen=True, eq=False)
class TorqueDerivatives:
    """Derivatives of the torque along a motion: [t, i, j] = d tau_i / d x_j.

    Attributes
    ----------
    by_q, by_v, by_a : (T, n, n); `by_a` is the joint-space inertia.
    """

    by_q: Array
    by_v: Array
    by_a: Array


class Dynamics:
    """The evaluator of one robot: its model, work space and the order of its joints.

    Parameters
    ----------
    robot : Robot
    """

    def __init__(self, robot: Robot) -> None:
        self.model, order = _kinematics(robot)
        self.data = self.model.createData()
        self.n = robot.n
        # q_pin = q[:, order]; a permutation is applied only where the order differs.
        self.order = None if order == list(range(self.n)) else np.array(order)
        # A simulation asks for one sample at a time, of parameters that stay the same.
        self._held: Array | None = None
        self._judged: Array | None = None
        self._extra: Array | None = None

    def _sorted(self, *motion: Array) -> list[Array]:
        if self.order is None:
            return list(motion)
        return [np.ascontiguousarray(x[:, self.order]) for x in motion]

    def regressor(self, q: Array, v: Array, a: Array) -> Array:
        """Return Y (T, n, 10 n), rows and columns in the robot's order."""
        q, v, a = self._sorted(q, v, a)
        model, data, evaluate = self.model, self.data, pin.computeJointTorqueRegressor
        out = np.empty((len(q), self.n, 10 * self.n))
        for k in range(len(q)):
            out[k] = evaluate(model, data, q[k], v[k], a[k])
        if self.order is None:
            return out
        permuted = np.empty_like(out)
        columns = (10 * self.order[:, None] + np.arange(10)).ravel()
        permuted[:, self.order[:, None], columns[None, :]] = out
        return permuted

    def inverse_dynamics(self, q: Array, v: Array, a: Array, theta: Array) -> Array:
        """Return tau (T, n) for any finite or non-finite theta (10 n,), in the robot's order."""
        phi = theta.reshape(self.n, 10)
        if not np.all(np.isfinite(phi)):
            return np.full(q.shape, np.nan)
        extra = self._extra_masses(phi)
        if extra is None:
            return self._rnea(q, v, a, phi)
        return self._rnea(q, v, a, phi + extra) - self._rnea(q, v, a, extra)

    def _extra_masses(self, phi: Array) -> Array | None:
        # Pinocchio holds mass, centre of mass and central inertia, which a massless body with a
        # first moment does not have. The torque is linear in theta: give every body a mass
        # large enough to represent, and take the torque of those masses off again.
        if self._judged is None or not np.array_equal(phi, self._judged):
            sound = [_representable(body) for body in phi]
            self._extra = None
            if not all(sound):
                self._extra = np.zeros((self.n, 10))
                self._extra[:, 0] = np.where(sound, 0.0, _mass_offset(phi))
            self._judged = phi.copy()
        return self._extra

    def derivatives(self, q: Array, v: Array, a: Array, theta: Array) -> TorqueDerivatives:
        """Return the derivatives of tau, in the robot's order; theta must be representable."""
        model, data, evaluate = self.model, self.data, pin.computeRNEADerivatives
        self._set_inertias(theta.reshape(self.n, 10))
        q, v, a = self._sorted(q, v, a)
        by_q, by_v, by_a = (np.empty((len(q), self.n, self.n)) for _ in range(3))
        for k in range(len(q)):
            by_q[k], by_v[k], by_a[k] = evaluate(model, data, q[k], v[k], a[k])
        # Pinocchio fills the upper triangle of the inertia matrix only.
        by_a = np.triu(by_a) + np.triu(by_a, 1).transpose(0, 2, 1)
        if self.order is None:
            return TorqueDerivatives(by_q, by_v, by_a)
        sorted_back = []
        for x in (by_q, by_v, by_a):
            permuted = np.empty_like(x)
            permuted[:, self.order[:, None], self.order[None, :]] = x
            sorted_back.append(permuted)
        return TorqueDerivatives(*sorted_back)

    def _set_inertias(self, phi: Array) -> None:
        if self._held is not None and np.array_equal(phi, self._held):
            return
        self._held = None
        order = range(self.n) if self.order is None else self.order
        for pin_id, index in enumerate(order, start=1):
            body = phi[index]
            self.model.inertias[pin_id] = _inertia(body) if np.any(body) else pin.Inertia.Zero()
        self._held = phi.copy()

    def _rnea(self, q: Array, v: Array, a: Array, phi: Array) -> Array:
        model, data, evaluate = self.model, self.data, pin.rnea
        self._set_inertias(phi)
        q, v, a = self._sorted(q, v, a)
        out = np.empty(q.shape)
        for k in range(len(q)):
            out[k] = evaluate(model, data, q[k], v[k], a[k])
        if self.order is None:
            return out
        permuted = np.empty_like(out)
        permuted[:, self.order] = out
        return permuted


def _representable(phi: Array) -> bool:
    """Whether the central inertia keeps its digits: no large part of it cancels."""
    if not np.any(phi):
        return True
    mass, moment, inertia = abs(phi[0]), np.abs(phi[1:4]).max(), np.abs(phi[4:]).max()
    return mass > 0.0 and moment**2 <= 1e2 * mass * max(inertia, 1e-6 * mass)


def _mass_offset(phi: Array) -> Array:
    """A mass for each body that is of the size of its own numbers."""
    return np.abs(phi).max(axis=1) + np.abs(phi[:, 0])
