"""A load on the last link, in the recordings that carry it."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, Forceless, Parameter
from dynident.effects.traits import Needs
from dynident.errors import EffectError
from dynident.inertia import MEANINGS, PARAMETERS, UNITS

_NAMES = ("mass", *PARAMETERS[1:])


class Payload(Forceless):
    """Inertial parameters added to the last link while the payload is carried.

    Mass and first moment (mx, my, mz), and the second moments that any real load brings with
    them, about the origin of the last joint's frame. The last joint is the one with the most
    joints between it and the base.
    """

    name = "payload"
    place = "robot"
    law = "Y_last(q, v, a) [mass, mx, ...]"
    sign_of = "a residual like gravity and inertia of the last link, in some recordings only"
    meaning = "the robot carries something that the model does not know of"
    confounded_with = ("drive_gain",)
    shown_by = "payload"
    experiment = "repeat one recording with the payload and one without"
    reverses = False
    needs = Needs.REGRESSOR | Needs.PAYLOAD

    def parameters(self, robot):
        # A load has mass, and diagonal second moments are sums of m x^2: none is negative.
        positive = {"mass", "Ixx", "Iyy", "Izz"}
        return tuple(
            Parameter(name, unit, 0.0 if name in positive else -np.inf, means=words)
            for name, unit, words in zip(_NAMES, UNITS, MEANINGS, strict=True)
        )

    def columns(self, block: Block) -> np.ndarray:
        if block.rigid is None:
            raise EffectError("needs the rigid-body regressor in the block", self.label)
        tip = block.tip % len(block.names)
        return block.rigid[:, :, 10 * tip : 10 * tip + 10] * float(block.carries_payload)

    def simulated_robot(self, values, robot):
        theta = np.array(robot.theta, dtype=float).reshape(robot.n, 10)
        theta[robot.tip] += np.asarray(values, dtype=float)
        return robot.with_theta(theta.ravel())
