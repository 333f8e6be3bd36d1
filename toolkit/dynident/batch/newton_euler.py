"""The equations of motion of a tree of joints, written out as CasADi expressions.

All vectors are in the frame of the joint that they belong to, at its origin. What is zero, one or a
number is folded in as it is written, so that a joint with a tidy frame costs little.

With the angular velocity w and acceleration e of a body and U = [e]x + [w]x [w]x, a point r of it
accelerates by a + U r. A body of mass m, first moment h and inertia J then needs the force
m a + U h and the moment h x a + J e + w x J w about the origin, linear in its ten parameters.
Gravity is an acceleration of the world upwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.batch.joint_tree import JointTree
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")  # of few samples nothing is written out

SIGNALS = 5
"""Rows of input for each joint: cos q, sin q, q, v, a; see `dynident.batch.kernel`."""

_ROUNDING = 2e-16  # of an entry of a rotation: what is below comes from a sine that is meant as 0


@dataclass(frozen=True)
class Equations:
    """Scalar expressions and where each belongs.

    Attributes
    ----------
    inputs : casadi.SX (k, 1): `SIGNALS` rows of n signals each, then parameters, if any.
    places : of each expression in the result.
    expressions : casadi.SX (len(places), 1).
    """

    inputs: Any
    places: tuple[tuple[int, ...], ...]
    expressions: Any


def regressor_equations(tree: JointTree, columns: tuple[int, ...]) -> Equations:
    """Write the regressor of inverse dynamics, tau = Y theta, but for entries that are zero.

    Parameters
    ----------
    tree : the robot.
    columns : of Y that are wanted, ascending; column 10 j + k is parameter k of body j.

    Returns
    -------
    Equations with places (row, position in `columns`).
    """
    motion = TreeMotion(tree)
    places: list[tuple[int, ...]] = []
    expressions = []
    turning: dict[int, Any] = {}
    sliding: dict[int, Any] = {}
    for j in tree.order:
        turning[j], sliding[j] = motion.axes_at(j, turning, sliding)
        wanted = [k for k, column in enumerate(columns) if column // 10 == j]
        if not wanted:
            continue
        moment, force = motion.unit_wrenches(j)
        own = [columns[k] % 10 for k in wanted]
        block = ca.sparsify(turning[j].T @ moment[:, own] + sliding[j].T @ force[:, own])
        rows, positions = block.sparsity().get_triplet()
        places += [(tree.carriers[j][i], wanted[k]) for i, k in zip(rows, positions, strict=True)]
        expressions.append(ca.vertcat(*block.nonzeros()))
    return Equations(motion.inputs, tuple(places), ca.vertcat(*expressions))


def torque_equations(tree: JointTree) -> Equations:
    """Write the torque of inverse dynamics for any parameters theta, which are inputs as well.

    Parameters
    ----------
    tree : the robot.

    Returns
    -------
    Equations with places (joint,), of all joints.
    """
    theta = ca.SX.sym("theta", 10 * tree.n)
    motion = TreeMotion(tree)
    moments, forces = {}, {}
    for j in tree.order:
        moment, force = motion.unit_wrenches(j)
        own = theta[10 * j : 10 * j + 10]
        moments[j], forces[j] = moment @ own, force @ own
    torque: list[Any] = [None] * tree.n
    for j in reversed(tree.order):
        axis = motion.axis[j]
        torque[j] = axis.T @ (forces[j] if tree.prismatic[j] else moments[j])
        parent = tree.parents[j]
        if parent == -1:
            continue
        force = motion.to_parent(j, forces[j])
        moment = moments[j]
        if tree.prismatic[j]:
            moment = moment + skew(axis) @ forces[j] * motion.q[j]
        forces[parent] = forces[parent] + force
        moments[parent] = moments[parent] + motion.to_parent(j, moment) + skew(motion.p[j]) @ force
    places = tuple((j,) for j in range(tree.n))
    inputs = ca.vertcat(motion.inputs, theta)
    return Equations(inputs, places, ca.densify(ca.vertcat(*torque)))


class TreeMotion:
    """The motion of all bodies, symbolic."""

    def __init__(self, tree: JointTree) -> None:
        self.tree = tree
        signals = [ca.SX.sym(name, tree.n) for name in ("cos", "sin", "q", "v", "a")]
        self.inputs = ca.vertcat(*signals)
        self._cos, self._sin, self.q, self._v, self._a = signals
        self.axis = [numbers(tree.axes[j]) for j in range(tree.n)]
        self.p: list[Any] = [None] * tree.n
        self._turns: list[tuple[Any, ...]] = [()] * tree.n
        # Of the world: at rest, accelerated against gravity.
        rest = ca.SX(3, 1)
        self._w, self._e = {-1: rest}, {-1: rest}
        self._u = {-1: ca.SX(3, 3)}
        self._lift = {-1: numbers([-g for g in tree.gravity])}
        self._products: dict[int, tuple[Any, ...]] = {}
        for j in tree.order:
            self._place(j)
            self._move(j)

    def to_child(self, j: int, vectors: Any) -> Any:
        """Vectors in the frame of joint j's parent as seen from joint j's frame."""
        for R in self._turns[j]:
            vectors = R.T @ vectors
        return vectors

    def to_parent(self, j: int, vectors: Any) -> Any:
        """Vectors in the frame of joint j as seen from its parent's frame."""
        for R in reversed(self._turns[j]):
            vectors = R @ vectors
        return vectors

    def axes_at(self, j: int, turning: dict[int, Any], sliding: dict[int, Any]) -> tuple[Any, Any]:
        """How body j turns, and how its origin moves, per unit speed of each joint that moves it.

        Parameters
        ----------
        j : the body.
        turning, sliding : the same of its parent, if it has one.

        Returns
        -------
        Two (3, number of carriers), in the frame of joint j.
        """
        parent, nothing = self.tree.parents[j], ca.SX(3, 1)
        own = (nothing, self.axis[j]) if self.tree.prismatic[j] else (self.axis[j], nothing)
        if parent == -1:
            return own
        turned = self.to_child(j, turning[parent])
        moved = self.to_child(j, sliding[parent] - skew(self.p[j]) @ turning[parent])
        if self.tree.prismatic[j]:
            moved = moved - self.q[j] * (skew(self.axis[j]) @ turned)
        return ca.horzcat(turned, own[0]), ca.horzcat(moved, own[1])

    def unit_wrenches(self, j: int) -> tuple[Any, Any]:
        """Moment and force, (3, 10) each, for a unit of each parameter of body j."""
        e, U, a = self._e[j], self._u[j], self._lift[j]
        xx, yy, zz, xy, xz, yz = self._products[j]
        inertia = ca.horzcat(
            ca.vertcat(e[0], xz, -xy),
            ca.vertcat(-U[2, 0], U[2, 1], xx - yy),
            ca.vertcat(-yz, e[1], xy),
            ca.vertcat(U[1, 0], zz - xx, -U[1, 2]),
            ca.vertcat(yy - zz, -U[0, 1], U[0, 2]),
            ca.vertcat(yz, -xz, e[2]),
        )
        moment = ca.horzcat(ca.SX(3, 1), -skew(a), inertia)
        force = ca.horzcat(a, U, ca.SX(3, 6))
        return moment, force

    def _place(self, j: int) -> None:
        """Write how the frame of a joint stands in its parent's."""
        R, p = self.tree.placement(j)
        self.p[j] = numbers(p)
        if self.tree.prismatic[j]:
            self._turns[j] = (numbers(R),)
            return
        u = np.array(self.tree.axes[j])
        across, along = np.eye(3) - np.outer(u, u), np.outer(u, u)
        cos, sin = self._cos[j], self._sin[j]

        def turned(by: np.ndarray) -> Any:
            cross = np.cross(u, np.eye(3)).T  # [u]x
            return cos * numbers(by @ across) + sin * numbers(by @ cross) + numbers(by @ along)

        # One after the other, or as one product: what takes fewer operations on a vector.
        parts, whole = (numbers(R), turned(np.eye(3))), (turned(R),)
        self._turns[j] = min(whole, parts, key=lambda factors: sum(map(_cost, factors)))

    def _move(self, j: int) -> None:
        """Write the motion of a body from its parent's."""
        parent, axis = self.tree.parents[j], self.axis[j]
        w, e = (self.to_child(j, x[parent]) for x in (self._w, self._e))
        lift = self.to_child(j, self._lift[parent] + self._u[parent] @ self.p[j])
        if not self.tree.prismatic[j]:
            e = e + axis * self._a[j] + skew(w) @ axis * self._v[j]
            w = w + axis * self._v[j]
        w, e = ca.sparsify(w), ca.sparsify(e)
        x, y, z = w[0], w[1], w[2]
        xx, yy, zz, xy, xz, yz = products = (x * x, y * y, z * z, x * y, x * z, y * z)
        U = ca.vertcat(
            ca.horzcat(-(yy + zz), xy - e[2], xz + e[1]),
            ca.horzcat(xy + e[2], -(xx + zz), yz - e[0]),
            ca.horzcat(xz - e[1], yz + e[0], -(xx + yy)),
        )
        if self.tree.prismatic[j]:
            # The origin slides along the axis, which turns.
            lift = lift + U @ axis * self.q[j] + 2.0 * (skew(w) @ axis * self._v[j])
            lift = lift + axis * self._a[j]
        self._w[j], self._e[j], self._u[j] = w, e, ca.sparsify(U)
        self._lift[j], self._products[j] = ca.sparsify(lift), products


def numbers(values: Any) -> Any:
    """A constant matrix; entries that only rounding keeps from zero are left out."""
    array = np.array(values, dtype=float)
    array[np.abs(array) < _ROUNDING * np.abs(array).max(initial=0.0)] = 0.0
    return ca.SX(ca.sparsify(ca.DM(array)))


def skew(x: Any) -> Any:
    """The matrix [x]x with [x]x y = x x y."""
    none = ca.SX(1, 1)
    return ca.vertcat(
        ca.horzcat(none, -x[2], x[1]),
        ca.horzcat(x[2], none, -x[0]),
        ca.horzcat(-x[1], x[0], none),
    )


def _cost(matrix: Any) -> int:
    """Operations that its product with a vector takes."""
    plain = sum(entry.is_constant() and abs(float(entry)) == 1.0 for entry in matrix.nonzeros())
    rows = np.bincount(matrix.sparsity().row(), minlength=3)
    return int(np.maximum(rows - 1, 0).sum()) + matrix.nnz() - plain
