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

_MOST_IN_A_TURN = 500.0
_FEW = 63  # per revolution: as whole numbers they are products of no more than six powers
_PER_TURN = ShapeParameter(
    "k",
    "1/rev",
    tuple(float(k) for k in (*range(2, 33), *range(34, 62, 2))),
    lower=1.0,
    upper=_MOST_IN_A_TURN,
    means="ripples per revolution",
)
# As close as lines of a quarter of a metre's travel are wide, 25 rad/m: over a longer one, what
# lies between is looked for in a spectrum.
_PER_METRE = ShapeParameter(
    "k",
    "rad/m",
    tuple(float(k) for k in range(30, 3001, 10)),
    lower=10.0,
    upper=1e5,
    means="phase of the ripple per metre",
)


class TorqueRipple(JointEffect):
    """One harmonic of the position: As sin(k q) + Ac cos(k q).

    k is in cycles per revolution, or in cycles per 2 pi metres for a prismatic joint (rad/m). Up to
    60 cycles whole numbers are tried; beyond, up to the 500 of a gear's fast side, what a spectrum
    of the residual over the position shows, as far as half of the rows are slow enough for it.
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
        return (_PER_METRE if motion_unit(robot, self.joint) == "m" else _PER_TURN,)

    def lines_over_position(self, robot):
        if motion_unit(robot, self.joint) == "m":
            return _PER_METRE.grid[0], _PER_METRE.grid[-1]
        # In a turn, what teeth and magnets make comes a whole number of times: the grid has them
        # all, but for those of a gear's fast side, which comes round some hundred times.
        return _PER_TURN.grid[-1], _MOST_IN_A_TURN

    def at_joint(self, block: Block) -> np.ndarray:
        (k,) = self.shape
        if 1 <= k <= _FEW and k == int(k) and block.q.dtype == float:  # symbols have no powers
            z = block.circling(self.joint, int(k))
            return np.stack([np.imag(z), np.real(z)], axis=1)
        phase = k * block.q[:, [block.index(self.joint)]]
        return np.hstack([np.sin(phase), np.cos(phase)])
