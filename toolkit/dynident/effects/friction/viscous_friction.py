"""Viscous friction."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit, motion_unit
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term


class ViscousFriction(JointEffect):
    """Torque proportional to speed: Fv v."""

    name = "viscous_friction"
    opposes_motion = True
    at_every_joint = True
    law = "Fv v"
    sign_of = "a slope against velocity"
    meaning = "a resistance in proportion to the speed, as from grease"
    pictures = (
        ResidualPicture("velocity", "a slope against velocity: viscous friction", lambda x, s: x),
    )
    confounded_with = ("coulomb_friction", "quadratic_drag")
    shown_by = "speed"
    experiment = "move {joint} at several constant speeds in both directions"
    reverses = False

    def parameters(self, robot):
        unit = f"{force_unit(robot, self.joint)} s/{motion_unit(robot, self.joint)}"
        return (Parameter("Fv", unit, 0.0, means="friction per unit of speed"),)

    def at_joint(self, block: Block) -> np.ndarray:
        return block.v[:, [block.index(self.joint)]]

    def simulated_terms(self, values, robot):
        j = robot.names.index(str(self.joint))
        return (Term(j, "speed", (j,), values[0]),)
