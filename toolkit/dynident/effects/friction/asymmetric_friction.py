"""Friction that differs between the two directions of motion."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit, motion_unit
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term


class AsymmetricFriction(JointEffect):
    """What differs between the directions: dFv abs(v) + dFc.

    With Fv and Fc of viscous and Coulomb friction in the model, the friction is (Fv + dFv) v + Fc
    forward and (Fv - dFv) v - Fc backward, up to dFc. The constant dFc cannot be told from a
    `torque_offset`; where one is in the model it takes the constant's place.
    """

    name = "asymmetric_friction"
    law = "dFv |v| + dFc"
    sign_of = "slopes against velocity that differ between the two directions"
    meaning = "the joint resists differently in its two directions of motion"
    pictures = (
        ResidualPicture(
            "velocity",
            "slopes that differ between the directions: asymmetric friction",
            lambda x, s: np.abs(x),
        ),
    )
    confounded_with = ("torque_offset", "quadratic_drag")
    shown_by = "speed"
    experiment = "move {joint} at several constant speeds in both directions"
    reverses = False
    contains = ("torque_offset",)
    stands_in_for = ("torque_offset",)

    def parameters(self, robot):
        force, motion = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (
            Parameter(
                "dFv",
                f"{force} s/{motion}",
                means="half the difference of viscous friction between the directions",
            ),
            Parameter(
                "dFc", force, means="half the difference of dry friction between the directions"
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return np.hstack([np.abs(v), np.ones_like(v)])

    def simulated_terms(self, values, robot):
        j = robot.names.index(str(self.joint))
        return (Term(j, "magnitude", (j,), values[0]), Term(j, "constant", (), values[1]))
