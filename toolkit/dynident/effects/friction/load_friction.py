"""Dry friction that grows with the load, as of worm gears and preloaded bearings."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, Forceless, JointEffect, Parameter
from dynident.effects.traits import Needs
from dynident.errors import EffectError


class LoadFriction(Forceless, JointEffect):
    """Dry friction in proportion to the torque that is transmitted: mu abs(tau) tanh(v/w).

    The column is made of the torque which the model predicts, never of the measured one, whose
    noise it would take for a load.
    """

    name = "load_friction"
    law = "mu |tau| tanh(v/w)"
    sign_of = "a fan against load: a step at zero velocity that grows with the load"
    meaning = "the joint's friction grows with the load that its gears and bearings carry"
    confounded_with = ("coulomb_friction", "drive_gain")
    shown_by = "load"
    experiment = "move {joint} slowly in both directions under several loads, both signs of them"
    needs = Needs.TORQUE

    def parameters(self, robot):
        # From 1 on the gear would block itself.
        return (Parameter("mu", "1", 0.0, 0.9, means="share of the load that becomes friction"),)

    def at_joint(self, block: Block) -> np.ndarray:
        if block.torque is None:
            raise EffectError("needs the predicted torque in the block", self.label)
        j = [block.index(self.joint)]
        return np.abs(block.torque[:, j]) * block.sign(block.v[:, j], self.joint)

    def simulated_loss(self, values, robot):
        loss = np.zeros(robot.n)
        loss[robot.names.index(str(self.joint))] = values[0]
        return loss
