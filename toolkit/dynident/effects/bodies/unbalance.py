"""Weight beside a vertical axis, which only a tilted base makes felt."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Self

import numpy as np

from dynident.effects.effect import Block, JointEffect, Parameter
from dynident.robot import Robot

_VERTICAL = 0.02
"""Sine of the angle to gravity below which an axis is vertical."""


class Unbalance(JointEffect):
    """Us sin(q) + Uc cos(q): the centre of mass lies elsewhere beside the axis than described.

    About a vertical axis that nothing turns gravity makes no torque, so that no recording of an
    upright robot tells how far from it the centre of mass of the link lies; the columns of a tilt
    take it from the description. Where that is wrong, the tilted base makes this torque: the weight
    of the link, times the tilt, times the distance.
    """

    name = "unbalance"
    law = "Us sin(q) + Uc cos(q)"
    sign_of = "a wave of one cycle per revolution against position, on a tilted base"
    meaning = (
        "the centre of mass lies elsewhere beside a vertical axis than the description says, which "
        "only a tilted base makes felt"
    )
    confounded_with = ("joint_spring", "torque_ripple", "torque_offset")
    shown_by = "position range"
    experiment = "move {joint} slowly over its whole range"
    reverses = False
    requires = ("base_tilt",)

    @classmethod
    def candidates(cls, robot: Robot) -> Iterator[Self]:
        """Joints that turn about the vertical, with slides alone between them and the base."""
        if not np.any(robot.gravity):
            return
        down = np.array(robot.gravity) / np.linalg.norm(robot.gravity)
        turn: dict[int, np.ndarray] = {-1: np.eye(3)}  # of links that nothing turns
        for number, joint in enumerate(robot.joints):
            if joint.parent not in turn:
                continue
            here = turn[joint.parent] @ joint.R
            if joint.kind == "prismatic":
                turn[number] = here
            elif np.linalg.norm(np.cross(here @ joint.axis, down)) <= _VERTICAL:
                yield cls(joint.name)

    def parameters(self, robot):
        return (
            Parameter("Us", "N m", means="amplitude of the sine part"),
            Parameter("Uc", "N m", means="amplitude of the cosine part"),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        q = block.q[:, [block.index(self.joint)]]
        return np.hstack([np.sin(q), np.cos(q)])
