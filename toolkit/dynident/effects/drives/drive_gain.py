"""A torque constant or gear efficiency that is not what the recording assumed."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, Forceless, JointEffect, Parameter
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.traits import Needs
from dynident.errors import EffectError


class DriveGain(Forceless, JointEffect):
    """Recorded torque = (1 + e) times the torque that acts.

    The column is the torque which the model predicts, never the measured one: the measured torque
    would bring its noise along. All joints at once cannot be told from scaling every parameter.
    """

    name = "drive_gain"
    law = "e tau"
    sign_of = "a tilted line against load"
    meaning = "the drive gives more or less torque than it reports, in a fixed proportion"
    pictures = (
        ResidualPicture("load", "a tilted line against load: a drive gain", lambda x, s: x),
    )
    confounded_with = ("payload", "rotor_inertia")
    shown_by = "load"
    experiment = "move {joint} through loads that the other joints feel too, or weigh a known mass"
    needs = Needs.TORQUE
    linear_in_torque = True

    def parameters(self, robot):
        # Beyond half and twice it is another unit, or another column, and no torque constant.
        return (
            Parameter("e", "1", -0.5, 1.0, means="recorded torque over acting torque, less one"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        if block.torque is None:
            raise EffectError("needs the predicted torque in the block", self.label)
        return block.torque[:, [block.index(self.joint)]]

    def simulated_gain(self, values, robot):
        gain = np.ones(robot.n)
        gain[robot.names.index(str(self.joint))] += values[0]
        return gain
