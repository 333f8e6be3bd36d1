"""A spring across a joint: a cable, a hose, a gas spring, a balancer."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit, motion_unit
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term


class JointSpring(JointEffect):
    """Torque k q + c, which is zero at the rest position -c/k."""

    name = "joint_spring"
    law = "k q + c"
    sign_of = "a ramp against position"
    meaning = (
        "something pulls the joint towards one position like a spring: a balancer, a hose, a "
        "bundle of cables"
    )
    pictures = (ResidualPicture("position", "a ramp against position: a spring", lambda x, s: x),)
    confounded_with = ("torque_ripple", "torque_offset")
    shown_by = "position range"
    experiment = "move {joint} slowly over its whole range"
    reverses = False
    contains = ("torque_offset",)

    def parameters(self, robot):
        force, motion = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (
            Parameter("k", f"{force}/{motion}", 0.0, means="stiffness"),
            Parameter("c", force, means="torque at position zero"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        q = block.q[:, [block.index(self.joint)]]
        return np.hstack([q, np.ones_like(q)])

    def simulated_terms(self, values, robot):
        j = robot.names.index(str(self.joint))
        return (Term(j, "position", (j,), values[0]), Term(j, "constant", (), values[1]))
