"""A transmission that bends under load."""

from __future__ import annotations

import numpy as np

from dynident.effects.base import (
    Block,
    Effect,
    Parameter,
    ShapeParameter,
    force_unit,
    motion_unit,
)
from dynident.effects.driven import (
    DrivenLink,
    Response,
    Transmitting,
    mean_inertia,
    share_of_rotor,
    stacked,
)
from dynident.effects.transmission import Transmission

RESONANCE = ShapeParameter("resonance", "Hz", (5.0, 12.0, 30.0, 80.0), 2.0, 200.0)
"""Of the link against the locked motor, at the mean of its inertia."""
DAMPING = ShapeParameter("damping", "1", (0.1,), 0.002, 2.0)
ROTOR_SHARE = ShapeParameter("rotor_share", "1", (0.3,), 0.005, 0.95)
"""Share of the motor in the inertia that moves with the joint."""


class JointElasticity(Effect):
    """A spring of compliance c with damping between the motor and the link of a joint.

    The link's driven response per unit of compliance. The torque of every joint changes, as all
    feel the link's acceleration. See `dynident.effects.driven`.
    """

    name = "joint_elasticity"
    law = "c (driven response of the link behind the spring)"
    sign_of = "an error that grows with acceleration and rings after jerks"
    confounded_with = ("backlash", "torque_delay", "rotor_inertia")
    shown_by = "acceleration"
    experiment = "move {joint} with high accelerations and sudden stops, other joints still"
    needs = frozenset({"body", "whole"})

    def parameters(self, robot):
        unit = f"{motion_unit(robot, self.joint)}/({force_unit(robot, self.joint)})"
        if force_unit(robot, self.joint) == "N":
            unit = "m/N"
        return (Parameter("c", unit, 0.0),)

    def shape_parameters(self, robot):
        return (RESONANCE, DAMPING, ROTOR_SHARE)

    def suited(self, block: Block) -> JointElasticity:
        share = share_of_rotor(block, block.index(self.joint))
        return self if share is None else self.shaped(*self.shape[:2], share)

    def columns(self, block: Block) -> np.ndarray:
        gear, response = self._response(block)
        return (response.torque * gear.stiffness)[:, :, None]

    def sensitivities(self, block: Block) -> np.ndarray:
        gear, response = self._response(block)
        K, D, B = gear.stiffness, gear.damping, gear.rotor
        share = self.shape[2]
        # The shares of motor and link sum to one: what the motor gains, the link has not.
        other = -share / (1.0 - share)
        found = []
        for stiffness, damping, rotor in (
            (2 * K, D, 0.0),
            (0.0, D, 0.0),
            (other * K, other * D, B),
        ):
            by = response.by(stiffness, damping, rotor, 0.0)
            found.append(K * by + stiffness * response.torque)
        return stacked(found)

    def _response(self, block: Block) -> tuple[Transmitting, Response]:
        link = DrivenLink(block, block.index(self.joint))
        gear = Transmitting.of(link.inertia, self.shape)
        return gear, link.response(gear)

    def simulated_force(self, values, block):
        return np.zeros(block.q.shape)

    def simulated_terms(self, values, robot):
        return ()

    def simulated_transmission(self, values, robot):
        joint, (compliance,) = robot.names.index(str(self.joint)), values
        if not compliance > 0:
            return None
        resonance, damping, share = self.shape
        stiffness = 1.0 / compliance
        rotor = share / (1.0 - share) * mean_inertia(robot, joint)
        return Transmission(joint, stiffness, damping * stiffness / (np.pi * resonance), 0.0, rotor)
