"""A torque that grows with time: a drifting sensor or amplifier."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit
from dynident.effects.residual_picture import ResidualPicture


class TorqueDrift(JointEffect):
    """Torque in proportion to the time since the session began: rate t."""

    name = "torque_drift"
    time_varying = True
    law = "rate t"
    sign_of = "a ramp against the time of the session, whatever the joint does"
    meaning = "the reading of the torque creeps away from zero as time goes by"
    pictures = (ResidualPicture("time", "a ramp over time: a drift", lambda x, s: x),)
    confounded_with = ("torque_offset", "thermal_friction")
    shown_by = "session"
    experiment = "repeat one recording of {joint} early and late in a long session"
    reverses = False

    def parameters(self, robot):
        return (
            Parameter(
                "rate",
                f"{force_unit(robot, self.joint)}/s",
                means="change of the torque with the time of the session",
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        return block.t[:, None]

    def time_factor(self, block: Block) -> np.ndarray:
        return block.t
