"""Regressor and inverse dynamics through Pinocchio.

Pinocchio is given joints and inertias by us, never a file: its parsers change broken inertias.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import lazy_loader
import numpy as np

from dynident.inertia import to_pinocchio
from dynident.robot.tree import Array, Joint

# Slow to load, and not needed to read or check a description; the bindings carry no types.
pin: Any = lazy_loader.load("pinocchio")


def _kinematics(joints: Sequence[Joint], gravity: Array) -> tuple[Any, list[int]]:
    """Return a massless model and, for each of its joints, the index in `joints`."""
    model = pin.Model()
    model.gravity = pin.Motion(np.asarray(gravity), np.zeros(3))
    children: dict[int, list[int]] = {}
    for index, joint in enumerate(joints):
        children.setdefault(joint.parent, []).append(index)
    ids = {-1: 0}
    order: list[int] = []
    # Depth first, as Pinocchio's subtree bookkeeping wants it.
    waiting = children.get(-1, [])[::-1]
    while waiting:
        index = waiting.pop()
        joint = joints[index]
        placement = pin.SE3(np.array(joint.R), np.array(joint.p))
        ids[index] = model.addJoint(
            ids[joint.parent], _joint_model(joint.kind, joint.axis), placement, joint.name
        )
        order.append(index)
        waiting.extend(children.get(index, [])[::-1])
    return model, order


def _joint_model(kind: str, axis: Array) -> Any:
    for letter, unit in zip("XYZ", np.eye(3), strict=True):
        if np.array_equal(axis, unit):
            return getattr(pin, f"JointModel{kind[0].upper()}{letter}")()
    return getattr(pin, f"JointModel{kind.capitalize()}Unaligned")(np.array(axis))


def pinocchio_model(
    joints: Sequence[Joint], gravity: Array, theta: Array, bodies: Sequence[str]
) -> Any:
    """Return the Pinocchio model of a robot; see `Robot.pinocchio`.

    Parameters
    ----------
    joints : sequence of Joint
    gravity : (3,) ndarray
        m/s^2.
    theta : (10 n,) ndarray
        Parameters of the moving bodies.
    bodies : sequence of str
        Their names, for messages.

    Raises
    ------
    RobotError
        If Pinocchio cannot hold a body.
    """
    model, order = _kinematics(joints, gravity)
    for pin_id, index in enumerate(order, start=1):
        phi = theta[10 * index : 10 * index + 10]
        model.inertias[pin_id] = to_pinocchio(phi, f"body '{bodies[index]}'")
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
    joints : sequence of Joint
    gravity : (3,) ndarray
        m/s^2, in the world's axes.
    """

    def __init__(self, joints: Sequence[Joint], gravity: Array) -> None:
        self.model, order = _kinematics(joints, gravity)
        self.data = self.model.createData()
        self.n = len(joints)
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
            self.model.inertias[pin_id] = (
                pin.Inertia.FromDynamicParameters(np.array(body))
                if np.any(body)
                else pin.Inertia.Zero()
            )
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
