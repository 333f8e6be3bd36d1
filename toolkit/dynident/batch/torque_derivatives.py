"""Derivatives of the torque of inverse dynamics by one joint's motion, as CasADi expressions."""

from __future__ import annotations

from typing import Any

from dynident.batch.joint_tree import JointTree
from dynident.batch.newton_euler import SIGNALS, Equations, torque_equations
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")  # of few samples nothing is written out


def torque_derivative_equations(tree: JointTree, joint: int) -> Equations:
    """Write the derivatives of tau by q, v and a of one joint, but for entries that are zero.

    By those of all joints a robot of seven has as many operations as take NumPy longer than
    Pinocchio takes for them; whoever looks at one joint needs a fifth of these.

    Parameters
    ----------
    tree : the robot.
    joint : by whose motion.

    Returns
    -------
    Equations with places (0 by q, 1 by v, 2 by a; i): d tau_i / d x. Inputs are those of
    `torque_equations`.
    """
    torque = torque_equations(tree)
    cos, sin, q, v, a = (torque.inputs[k * tree.n + joint] for k in range(SIGNALS))
    by_q = ca.vertcat(cos, sin, q), ca.vertcat(-sin, cos, 1.0)
    places: list[tuple[int, ...]] = []
    expressions = []
    for kind, (signals, change) in enumerate((by_q, (v, ca.SX(1.0)), (a, ca.SX(1.0)))):
        column = ca.sparsify(ca.jtimes(torque.expressions, signals, change))
        places += [(kind, i) for i in column.sparsity().row()]
        expressions.append(ca.vertcat(*column.nonzeros()))
    return Equations(torque.inputs, tuple(places), ca.vertcat(*expressions))
