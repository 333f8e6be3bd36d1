"""Drag that grows with the square of speed."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit, motion_unit
from dynident.effects.residual_picture import ResidualPicture


class QuadraticDrag(JointEffect):
    """Torque of air, grease or a fan: Fq v abs(v)."""

    name = "quadratic_drag"
    opposes_motion = True
    law = "Fq v |v|"
    sign_of = "a curve against velocity, steeper at speed"
    meaning = "the resistance grows with the square of the speed, as in oil or air"
    pictures = (
        ResidualPicture("velocity", "a curve, steeper at speed: drag", lambda x, s: x * np.abs(x)),
    )
    confounded_with = ("viscous_friction", "coulomb_friction")
    shown_by = "speed"
    experiment = "move {joint} from slow to its highest speed in both directions"
    reverses = False

    def parameters(self, robot):
        force, motion = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (
            Parameter("Fq", f"{force} s^2/{motion}^2", 0.0, means="friction per square of speed"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return v * np.abs(v)
