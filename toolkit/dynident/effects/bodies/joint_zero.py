"""An encoder whose zero is not where the description has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.effects.bodies.turn import turn_about
from dynident.effects.effect import Block, Forceless, Parameter, motion_unit
from dynident.effects.traits import Needs
from dynident.robot.joint_derivatives import JointDerivatives

_NEXT_TO_NOTHING = 1e-5
"""Offset in rad or m below which a difference has fewer digits than the derivative in the middle
of it."""


class JointZero(Forceless):
    """The joint stands at q + offset where q is recorded; torques of all joints change."""

    name = "joint_zero"
    law = "tau(q + offset) - tau(q)"
    sign_of = "a residual that follows the weight as if the joint stood elsewhere"
    meaning = (
        "the encoder's zero is not where the robot description has it, so that the joint "
        "stands at another angle than it reports"
    )
    confounded_with = ("base_tilt", "joint_spring", "torque_offset")
    shown_by = "position range"
    experiment = (
        "move {joint} slowly through its whole range with the other joints in several poses (at a "
        "joint that carries the rest of the robot nothing but gravity shows it; at the last joint "
        "of an arm it cannot be told from the last link's centre of mass)"
    )
    needs = Needs.BODIES
    nonlinear = True

    def parameters(self, robot):
        unit = motion_unit(robot, self.joint)
        return (Parameter("offset", unit, -1.0, 1.0, means="position less what the record says"),)

    def columns(self, block: Block) -> np.ndarray:
        body, j = block.fitted_robot(self.label), block.index(self.joint)
        (offset,) = self.point or (0.0,)
        if offset == 0.0:
            return block.derivatives.by(j).by_q[:, :, None]
        moved = np.array(block.q)
        if abs(offset) < _NEXT_TO_NOTHING:
            moved[:, j] += offset / 2
            return JointDerivatives(body, moved, block.v, block.a).by(j).by_q[:, :, None]
        moved[:, j] += offset
        rise = body.inverse_dynamics(moved, block.v, block.a)
        rise -= body.inverse_dynamics(block.q, block.v, block.a)
        return rise[:, :, None] / offset

    def simulated_robot(self, values, robot):
        index = robot.names.index(str(self.joint))
        joint = robot.joints[index]
        if joint.kind == "prismatic":
            moved = replace(joint, p=joint.p + joint.R @ joint.axis * values[0])
        else:
            moved = replace(joint, R=joint.R @ turn_about(joint.axis, values[0]))
        return replace(robot, joints=(*robot.joints[:index], moved, *robot.joints[index + 1 :]))
