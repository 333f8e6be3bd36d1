"""Another joint's motion felt through a shared transmission."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, force_unit, motion_unit
from dynident.effects.terms import Term


class JointCoupling(JointEffect):
    """Torque at `joint` from the motion of `source`.

    cv v_i + cc tanh(v_i / w) + ca a_i + cs tanh((v_i + v_j) / w), j the joint and i its source:
    viscous and dry friction and motor inertia that the transmission carries over, and dry friction
    of a part which turns with the sum of both.
    """

    name = "joint_coupling"
    place = "pair"
    law = "cv v[source] + cc sign(v[source]) + ca a[source] + cs sign(v + v[source])"
    sign_of = "a residual that follows another joint's motion"
    meaning = (
        "moving one joint loads the drive of another, as belts, cables and differential gears do"
    )
    confounded_with = ("rotor_inertia", "viscous_friction", "coulomb_friction")
    shown_by = "source alone"
    experiment = "move {source} with {joint} still, slowly and fast"

    def parameters(self, robot):
        force, motion = force_unit(robot, self.joint), motion_unit(robot, self.source)
        return (
            Parameter(
                "cv", f"{force} s/{motion}", means="torque per unit of the other joint's speed"
            ),
            Parameter("cc", force, means="torque that changes sign with the other joint's speed"),
            Parameter(
                "ca",
                f"{force} s^2/{motion}",
                means="torque per unit of the other joint's acceleration",
            ),
            Parameter("cs", force, means="torque that changes sign with the sum of both speeds"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        i, j = block.index(self.source), block.index(self.joint)
        v_i, v_j, a_i = block.v[:, i], block.v[:, j], block.a[:, i]
        dry = block.sign(v_i, self.source), block.sign(v_i + v_j, self.source, self.joint)
        return np.column_stack([v_i, dry[0], a_i, dry[1]])

    def simulated_force(self, values, block):
        # The acceleration term acts through the inertia matrix below.
        without_acceleration = np.array(values, dtype=float)
        without_acceleration[2] = 0.0
        return self.columns(block) @ without_acceleration

    def simulated_terms(self, values, robot):
        j, i = robot.names.index(str(self.joint)), robot.names.index(str(self.source))
        viscous, dry, _, both = values
        return (
            Term(j, "speed", (i,), viscous),
            Term(j, "sign", (i,), dry),
            Term(j, "sign", (i, j), both),
        )

    def simulated_inertia(self, values, robot):
        inertia = np.zeros((robot.n, robot.n))
        j, i = robot.names.index(str(self.joint)), robot.names.index(str(self.source))
        inertia[j, i] = values[2]
        return inertia
