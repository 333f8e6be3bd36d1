"""Inertia of the rotor and gears, as felt at the joint."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, Forceless, JointEffect, Parameter, motion_unit
from dynident.effects.residual_picture import ResidualPicture


class RotorInertia(Forceless, JointEffect):
    """Torque proportional to the joint's own acceleration: Ia a."""

    name = "rotor_inertia"
    at_every_joint = True
    law = "Ia a"
    sign_of = "a slope against the joint's own acceleration"
    meaning = (
        "the motor's spinning rotor must be accelerated too; seen from the link it is an "
        "inertia of its own"
    )
    pictures = (
        ResidualPicture(
            "acceleration",
            "a slope against acceleration: an inertia (of a rotor, say)",
            lambda x, s: x,
        ),
    )
    shown_by = "acceleration"
    experiment = (
        "accelerate {joint} hard together with the other joints (at the first joint of an arm it "
        "cannot be told from the inertia of the links)"
    )
    reverses = False

    def parameters(self, robot):
        unit = "kg" if motion_unit(robot, self.joint) == "m" else "kg m^2"
        return (
            Parameter("Ia", unit, 0.0, means="inertia of motor and gear, as felt at the joint"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        return block.a[:, [block.index(self.joint)]]

    def simulated_inertia(self, values, robot):
        inertia = np.zeros((robot.n, robot.n))
        j = robot.names.index(str(self.joint))
        inertia[j, j] = values[0]
        return inertia
