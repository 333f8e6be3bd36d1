"""Regressor and inverse dynamics: of few samples through Pinocchio, of many through `batch`.

Pinocchio is given joints and inertias by us, never a file: its parsers change broken inertias.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from dynident.batch import (
    JointTree,
    regressor_kernel,
    torque_derivative_kernel,
    torque_kernel,
)
from dynident.inertia import to_pinocchio
from dynident.late_modules import LateModule
from dynident.robot.tree import Array, Joint

# Slow to load, and not needed to read or check a description; the bindings carry no types.
pin: Any = LateModule("pinocchio")

# Samples of one call for which a function of many samples pays. Measured: making it takes as long
# as 3000 (30 or 60 joints) to 7000 (2 joints) samples through Pinocchio, once a robot, and whoever
# asks for a recording asks again and again; below, a plain fit is done before CasADi is loaded. Not
# by what was asked before: the last digits would be.
_MANY = 1000
# Joints up to which derivatives by one joint's motion are written out. Measured: for 2, 7 and 12 of
# them that takes 0.1, 0.05 and 0.1 s a joint, and a sample 0.2, 1.3 and 3 us where Pinocchio, which
# knows only those by all joints, takes 4, 12 and 45.
_FEW_JOINTS = 12
# The same of those by all joints, which are these of each: for 2, 3 and 4 joints making them takes
# as long as 5 000, 14 000 and 32 000 samples through Pinocchio.
_FEWEST_JOINTS = 3


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


class _Workspace:
    """A model whose inertias change, and what Pinocchio writes to: of one robot in one thread."""

    def __init__(self, model: Any, sequence: Sequence[int]) -> None:
        self.model, self.data, self._sequence = model, model.createData(), sequence
        # A simulation asks for one sample at a time, of parameters that stay the same.
        self._held: Array | None = None
        self.keeps_digits = True

    def hold(self, phi: Array) -> None:
        """Give the model these inertias, and note whether it holds them with all their digits."""
        if self._held is not None and np.array_equal(phi, self._held):
            return
        self._held = None
        for pin_id, index in enumerate(self._sequence, start=1):
            body = np.array(phi[index])
            self.model.inertias[pin_id] = (
                pin.Inertia.FromDynamicParameters(body) if np.any(body) else pin.Inertia.Zero()
            )
        self.keeps_digits = all(_keeps_digits(body) for body in phi)
        self._held = phi.copy()


class _OfThread(threading.local):
    """Work spaces of the thread that asks, by their robot: threads may share a robot."""

    def __init__(self) -> None:
        self.known: WeakKeyDictionary[Dynamics, _Workspace] = WeakKeyDictionary()


_of_thread = _OfThread()


class Dynamics:
    """The evaluator of one robot: its model and the order of its joints.

    Parameters
    ----------
    joints : sequence of Joint
    gravity : (3,) ndarray
        m/s^2, in the world's axes.
    """

    def __init__(self, joints: Sequence[Joint], gravity: Array) -> None:
        self.model, self.sequence = _kinematics(joints, gravity)
        self.n = len(joints)
        self.tree = JointTree(
            parents=tuple(joint.parent for joint in joints),
            prismatic=tuple(joint.kind == "prismatic" for joint in joints),
            placements=tuple((*joint.R.ravel().tolist(), *joint.p.tolist()) for joint in joints),
            axes=tuple(tuple(joint.axis.tolist()) for joint in joints),
            gravity=tuple(np.asarray(gravity).tolist()),
        )
        # q_pin = q[:, order] and q = q_pin[:, back]; slices make no copies where nothing moves.
        ordered = self.sequence == list(range(self.n))
        self.order: Any = slice(None) if ordered else np.array(self.sequence)
        self.back: Any = slice(None) if ordered else np.argsort(self.sequence)

    def _workspace(self) -> _Workspace:
        found = _of_thread.known.get(self)
        if found is None:
            found = _of_thread.known[self] = _Workspace(pin.Model(self.model), self.sequence)
        return found

    def _evaluate(
        self,
        space: _Workspace,
        function: Callable[..., Any],
        motion: tuple[Array, ...],
        shape: tuple[int, ...],
    ) -> Array:
        """Return the function's values (T, *shape) at all samples, in the order of the model."""
        q, v, a = (np.ascontiguousarray(x[:, self.order]) for x in motion)
        out = np.empty((len(q), *shape))
        for one, q_k, v_k, a_k in zip(out, q, v, a, strict=True):
            one[...] = function(space.model, space.data, q_k, v_k, a_k)
        return out

    def regressor(
        self,
        q: Array,
        v: Array,
        a: Array,
        *,
        columns: Sequence[int] | None = None,
        out: Array | None = None,
    ) -> Array:
        """Return columns of Y (T, n, 10 n), rows and columns in the robot's order.

        Parameters
        ----------
        q, v, a : (T, n) ndarray
        columns, out
            As in `Robot.regressor`.
        """
        wanted = tuple(range(10 * self.n) if columns is None else columns)
        if self._is_many(q):
            return regressor_kernel(self.tree, wanted)(q, v, a, out=out)
        Y = self._evaluate(
            self._workspace(), pin.computeJointTorqueRegressor, (q, v, a), (self.n, 10 * self.n)
        )
        blocks = Y.reshape(len(Y), self.n, self.n, 10)
        Y = blocks[:, self.back][:, :, self.back].reshape(Y.shape)
        if out is None:
            return Y if columns is None else Y[:, :, list(wanted)]
        out[:] = Y[:, :, list(wanted)]
        return out

    def inverse_dynamics(self, q: Array, v: Array, a: Array, theta: Array) -> Array:
        """Return tau (T, n), in the robot's order; NaN for parameters that are not finite.

        Parameters
        ----------
        q, v, a : (T, n) ndarray
        theta : (10 n,) ndarray
            As in `Robot.inverse_dynamics`.
        """
        phi = theta.reshape(self.n, 10)
        if not np.all(np.isfinite(phi)):
            return np.full(q.shape, np.nan)
        if self._is_many(q):
            return torque_kernel(self.tree)(q, v, a, parameters=theta.tolist())
        space = self._workspace()
        space.hold(phi)
        function = pin.rnea
        if not space.keeps_digits:
            # Pinocchio holds mass, centre of mass and central inertia, which a massless body with
            # a first moment does not have. Its regressor needs none of them.
            ours = phi[self.sequence].ravel()

            def function(*sample: Any) -> Array:
                return pin.computeJointTorqueRegressor(*sample) @ ours

        return self._evaluate(space, function, (q, v, a), (self.n,))[:, self.back]

    def derivatives(self, q: Array, v: Array, a: Array, theta: Array) -> TorqueDerivatives:
        """Return the derivatives of tau, in the robot's order.

        Parameters
        ----------
        q, v, a : (T, n) ndarray
        theta : (10 n,) ndarray
            As in `Robot.torque_derivatives`.
        """
        if self._is_many(q) and self.n <= _FEWEST_JOINTS:
            each = [self._by_joint(joint, q, v, a, theta) for joint in range(self.n)]
            return TorqueDerivatives(*np.stack(each, axis=-1).swapaxes(0, 1))
        space = self._workspace()
        space.hold(theta.reshape(self.n, 10))
        found = self._evaluate(space, pin.computeRNEADerivatives, (q, v, a), (3, self.n, self.n))
        by_q, by_v, by_a = np.ascontiguousarray(found.swapaxes(0, 1))
        # Pinocchio fills the upper triangle of the inertia matrix only.
        by_a = np.triu(by_a) + np.triu(by_a, 1).transpose(0, 2, 1)
        ours = (x[:, self.back][:, :, self.back] for x in (by_q, by_v, by_a))
        return TorqueDerivatives(*ours)

    def derivatives_by(
        self, joint: int, q: Array, v: Array, a: Array, theta: Array
    ) -> TorqueDerivatives | None:
        """Return the derivatives of tau by one joint's motion alone, where that takes less time.

        Parameters
        ----------
        joint : int
        q, v, a : (T, n) ndarray
        theta : (10 n,) ndarray

        Returns
        -------
        (T, n) each; None of few samples or many joints, where `derivatives` are had for as much.
        """
        if not self._is_many(q) or self.n > _FEW_JOINTS:
            return None
        found = self._by_joint(joint, q, v, a, theta)
        return TorqueDerivatives(found[:, 0], found[:, 1], found[:, 2])

    def _by_joint(self, joint: int, q: Array, v: Array, a: Array, theta: Array) -> Array:
        """Return the derivatives by one joint's q, v and a, (T, 3, n)."""
        return torque_derivative_kernel(self.tree, joint)(q, v, a, parameters=theta.tolist())

    def _is_many(self, q: Array) -> bool:
        """Whether a function of many samples pays."""
        return len(q) >= _MANY


def _keeps_digits(phi: Array) -> bool:
    """Whether the central inertia keeps its digits: no large part of it cancels."""
    if not np.any(phi):
        return True
    mass, moment, inertia = abs(phi[0]), np.abs(phi[1:4]).max(), np.abs(phi[4:]).max()
    return mass > 0.0 and moment**2 <= 1e2 * mass * max(inertia, 1e-6 * mass)
