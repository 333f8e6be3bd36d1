"""Dry (Coulomb) friction."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term


class CoulombFriction(JointEffect):
    """Constant torque against the motion: Fc tanh(v / w), w the joint's friction width."""

    name = "coulomb_friction"
    opposes_motion = True
    at_every_joint = True
    law = "Fc sign(v)"
    sign_of = "a step at zero velocity"
    meaning = "dry friction, the same at any speed, that changes sign with the direction of motion"
    pictures = (
        ResidualPicture(
            "velocity",
            "a step at zero velocity: dry (Coulomb) friction",
            lambda x, s: np.tanh(x / (0.02 * s)),
        ),
    )
    confounded_with = ("viscous_friction", "stribeck_friction")
    shown_by = "reversals"
    experiment = "reverse {joint} many times and move it at several speeds"

    def parameters(self, robot):
        return (
            Parameter(
                "Fc",
                force_unit(robot, self.joint),
                0.0,
                means="dry friction, the same at every speed",
                is_level=True,
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        return block.sign(block.v[:, [block.index(self.joint)]], self.joint)

    def simulated_terms(self, values, robot):
        j = robot.names.index(str(self.joint))
        return (Term(j, "sign", (j,), values[0]),)
