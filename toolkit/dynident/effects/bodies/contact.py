"""A push on the robot in one recording only: a contact, a collision, a hand."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter, ShapeParameter, force_unit
from dynident.effects.traits import Needs


class Contact(JointEffect):
    """A disturbance pulse A exp(-((t - time) / width)^2 / 2) in the recording of one number.

    It is no part of the robot: it is found in what differs between repetitions of a period, and
    keeps that one disturbance out of everything else.
    """

    name = "contact"
    law = "A exp(-((t - time)/width)^2/2), in one recording"
    sign_of = "a burst in one repetition only"
    meaning = (
        "something pushed the robot for a moment in one recording: it touched an obstacle, or "
        "someone touched it"
    )
    shown_by = "repetition"
    experiment = "record {joint} once more, over several periods, with nothing in its way"
    needs = Needs.NUMBER
    reverses = False
    found_by = "repetition"

    def parameters(self, robot):
        return (Parameter("A", force_unit(robot, self.joint), means="greatest torque of the push"),)

    def shape_parameters(self, robot):
        # Places are not screened: what differs between repetitions says where it is.
        return (
            ShapeParameter(
                "number", "1", (1.0,), lower=1.0, upper=1e6, means="number of the recording"
            ),
            ShapeParameter(
                "time", "s", (0.0,), lower=-1e6, upper=1e6, means="when the push is strongest"
            ),
            ShapeParameter(
                "width",
                "s",
                (0.2,),
                lower=1e-3,
                upper=10.0,
                means="how long it lasts, as a standard deviation",
            ),
        )

    def variants(self, robot):
        yield self.on(robot)

    def at_joint(self, block: Block) -> np.ndarray:
        number, time, width = self.shape
        share = float(block.number == round(number))
        return share * np.exp(-(((block.t[:, None] - time) / width) ** 2) / 2)

    def sensitivities(self, block: Block) -> np.ndarray:
        _, time, width = self.shape
        columns = self.columns(block)
        away = ((block.t - time) / width)[:, None, None]
        slopes = np.zeros(away.shape), away * time / width, away**2
        return np.stack([slope * columns for slope in slopes], axis=-1)
