"""The joint-space inertia of a tree of joints, and the torque at no acceleration, as expressions.

What forward dynamics are made of: M(q) a + h(q, v) = tau. M comes from composite bodies (Walker and
Orin, 1982): link j with all that it carries, moved as one by joint j alone, pushes back on the
joints that carry it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from dynident.batch.joint_tree import JointTree
from dynident.batch.newton_euler import SIGNALS, Equations, TreeMotion, skew, torque_equations
from dynident.batch.tape import Tape, tape_of
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")


_KEPT = 32  # tapes


@lru_cache(maxsize=_KEPT)
def joint_space_tape(tree: JointTree) -> Tape:
    """Return the instructions of `joint_space_equations`."""
    return tape_of(joint_space_equations(tree))


def joint_space_equations(tree: JointTree) -> Equations:
    """Write M and h for any parameters theta of the bodies, which are inputs as well.

    Accelerations are among the inputs, and in no expression.

    Parameters
    ----------
    tree : the robot.

    Returns
    -------
    Equations with places (k,): first the lower triangle of M, row by row, then h.
    """
    n = tree.n
    motion = TreeMotion(tree)
    theta = ca.SX.sym("theta", 10 * n)
    inputs = ca.vertcat(motion.inputs, theta)
    triangle = _inertia(motion, theta)
    torque = torque_equations(tree)
    function = ca.Function("torque", [torque.inputs], [torque.expressions])
    still = ca.vertcat(motion.inputs[: (SIGNALS - 1) * n], ca.SX.zeros(n), theta)
    rows = [triangle[i][j] for i in range(n) for j in range(i + 1)]
    expressions = ca.densify(ca.vertcat(*rows, function(still)))
    return Equations(inputs, tuple((k,) for k in range(len(rows) + n)), expressions)


def _inertia(motion: TreeMotion, theta: Any) -> list[list[Any]]:
    """M as rows of entries; those of joints that do not carry each other are zero."""
    tree = motion.tree
    mass, first, second = {}, {}, {}
    for j in range(tree.n):
        own = theta[10 * j : 10 * j + 10]
        mass[j], first[j] = own[0], own[1:4]
        xx, xy, yy, xz, yz, zz = (own[k] for k in range(4, 10))
        second[j] = ca.vertcat(
            ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz)
        )
    entries: list[list[Any]] = [[ca.SX(1, 1)] * tree.n for _ in range(tree.n)]
    for j in reversed(tree.order):
        axis = motion.axis[j]
        if tree.prismatic[j]:
            force, moment = mass[j] * axis, skew(first[j]) @ axis
        else:
            force, moment = skew(axis) @ first[j], second[j] @ axis
        carrier = j
        while carrier != -1:
            seen = force if tree.prismatic[carrier] else moment
            entry = motion.axis[carrier].T @ seen
            entries[max(j, carrier)][min(j, carrier)] = entry
            force, moment = _wrench_to_parent(motion, carrier, force, moment)
            carrier = tree.parents[carrier]
        parent = tree.parents[j]
        if parent != -1:
            h, J = first[j], second[j]
            if tree.prismatic[j]:
                h, J = _about(axis * motion.q[j], mass[j], h, J)
            h = motion.to_parent(j, h)
            J = motion.to_parent(j, motion.to_parent(j, J).T)
            h, J = _about(motion.p[j], mass[j], h, J)
            mass[parent] = mass[parent] + mass[j]
            first[parent], second[parent] = first[parent] + h, second[parent] + J
    return entries


def _wrench_to_parent(motion: TreeMotion, j: int, force: Any, moment: Any) -> tuple[Any, Any]:
    """A force and a moment about joint j's origin, as its parent's frame has them."""
    if motion.tree.prismatic[j]:
        moment = moment + skew(motion.axis[j]) @ force * motion.q[j]
    force = motion.to_parent(j, force)
    return force, motion.to_parent(j, moment) + skew(motion.p[j]) @ force


def _about(r: Any, mass: Any, h: Any, J: Any) -> tuple[Any, Any]:
    """First moment and inertia of a body about a point from which its origin is at r."""
    R, H = skew(r), skew(h)
    moved = J - (R @ H + H @ R) - mass * (R @ R)
    # Symmetric: each entry once, so that the same expression is not written twice.
    upper = [[moved[min(i, k), max(i, k)] for k in range(3)] for i in range(3)]
    return h + mass * r, ca.vertcat(*(ca.horzcat(*row) for row in upper))
