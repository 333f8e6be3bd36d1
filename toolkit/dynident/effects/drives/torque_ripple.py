"""Torque that varies with the position of the motor or of a gear: cogging, ripple."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import (
    Block,
    JointEffect,
    Parameter,
    ShapeParameter,
    force_unit,
    motion_unit,
)


class TorqueRipple(JointEffect):
    """One harmonic of the position: As sin(k q) + Ac cos(k q).

    k is in cycles per revolution, or in cycles per 2 pi metres for a prismatic joint (rad/m).
    """

    name = "torque_ripple"
    law = "As sin(k q) + Ac cos(k q)"
    sign_of = "a comb against position, one line in cycles per revolution"
    meaning = (
        "the torque swells and fades with the position, as the teeth of a gear and the "
        "magnets of a motor make it"
    )
    confounded_with = ("joint_spring",)
    shown_by = "slow"
    experiment = "sweep {joint} slowly over its whole range"
    reverses = False

    def parameters(self, robot):
        unit = force_unit(robot, self.joint)
        return (
            Parameter("As", unit, means="amplitude of the sine part"),
            Parameter("Ac", unit, means="amplitude of the cosine part"),
        )

    def shape_parameters(self, robot):
        if motion_unit(robot, self.joint) == "m":
            # As close as lines of a quarter of a metre's travel are wide, 25 rad/m: over a longer
            # one, what lies between is looked for in a spectrum.
            grid = tuple(float(k) for k in range(30, 3001, 10))
            return (
                ShapeParameter(
                    "k", "rad/m", grid, lower=10.0, upper=1e5, means="phase of the ripple per metre"
                ),
            )
        grid = tuple(float(k) for k in (*range(2, 33), *range(34, 62, 2)))
        return (
            ShapeParameter(
                "k", "1/rev", grid, lower=1.0, upper=500.0, means="ripples per revolution"
            ),
        )

    def line_over_position(self, robot):
        # In a turn, what teeth and magnets make comes a whole number of times.
        return motion_unit(robot, self.joint) == "m"

    def at_joint(self, block: Block) -> np.ndarray:
        phase = self.shape[0] * block.q[:, [block.index(self.joint)]]
        return np.hstack([np.sin(phase), np.cos(phase)])
