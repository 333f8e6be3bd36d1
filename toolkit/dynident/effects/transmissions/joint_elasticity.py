"""A transmission that bends under load."""

from __future__ import annotations

from dynident.effects.effect import Parameter, force_unit, motion_unit
from dynident.effects.transmissions.flexible import DAMPING, RESONANCE, ROTOR_SHARE, FlexibleJoint


class JointElasticity(FlexibleJoint):
    """A spring of compliance c with damping between the motor and the link of a joint."""

    name = "joint_elasticity"
    law = "c (driven response of the link behind the spring)"
    sign_of = "an error that grows with acceleration and rings after jerks"
    meaning = (
        "the transmission gives like a spring between motor and link, so that the link swings "
        "after the motor"
    )
    confounded_with = ("backlash", "torque_delay", "rotor_inertia")
    shown_by = "acceleration"
    experiment = "move {joint} with high accelerations and sudden stops, other joints still"

    def parameters(self, robot):
        unit = f"{motion_unit(robot, self.joint)}/({force_unit(robot, self.joint)})"
        if force_unit(robot, self.joint) == "N":
            unit = "m/N"
        return (Parameter("c", unit, 0.0, means="compliance: the inverse of the stiffness"),)

    def shape_parameters(self, robot):
        return (RESONANCE, DAMPING, ROTOR_SHARE)

    def per_unit(self, stiffness):
        return stiffness  # the response of this stiffness is that of a compliance of 1 / stiffness

    def simulated_transmission(self, values, robot):
        (compliance,) = values
        return self.transmission(robot, 1.0 / compliance, 0.0) if compliance > 0 else None
