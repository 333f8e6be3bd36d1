"""A constant torque, of a current amplifier's offset for instance."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term


class TorqueOffset(JointEffect):
    """The same torque whatever the robot does."""

    name = "torque_offset"
    at_every_joint = True
    law = "offset"
    sign_of = "a constant, whatever the joint does"
    meaning = "the torque reads a constant too much or too little"
    pictures = (
        ResidualPicture(
            "velocity",
            "a constant at all velocities: an offset",
            lambda x, s: np.ones_like(x),
        ),
    )
    confounded_with = ("asymmetric_friction", "joint_spring")
    shown_by = "position range"
    experiment = "move {joint} over a wide range in both directions, so that gravity changes"
    reverses = False

    def parameters(self, robot):
        return (Parameter("offset", force_unit(robot, self.joint), means="constant torque"),)

    def at_joint(self, block: Block) -> np.ndarray:
        return np.ones((len(block.t), 1))

    def simulated_terms(self, values, robot):
        j = robot.names.index(str(self.joint))
        return (Term(j, "constant", (), values[0]),)
