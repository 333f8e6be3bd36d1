"""Friction that falls as motion starts (Stribeck)."""

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
from dynident.effects.residual_picture import ResidualPicture


def _spikes(width: float) -> ResidualPicture:
    words = "spikes beside zero velocity: Stribeck friction, or presliding"
    return ResidualPicture(
        "velocity", words, lambda x, s: np.sign(x) * np.exp(-((x / (width * s)) ** 2))
    )


class StribeckFriction(JointEffect):
    """Extra dry friction at low speed: Fs tanh(v / w) exp(-(v / vs)^2)."""

    name = "stribeck_friction"
    opposes_motion = True
    law = "Fs sign(v) exp(-(v/vs)^2)"
    sign_of = "spikes on both sides of zero velocity"
    meaning = (
        "the joint resists more when it creeps than when it glides: friction falls as motion starts"
    )
    pictures = (
        _spikes(0.05),
        _spikes(0.15),
    )
    confounded_with = ("coulomb_friction", "viscous_friction")
    beyond = ("coulomb_friction",)
    shown_by = "slow"
    experiment = "move {joint} slowly, at speeds below 0.1 rad/s (or 0.01 m/s), in both directions"

    def parameters(self, robot):
        return (
            Parameter(
                "Fs",
                force_unit(robot, self.joint),
                0.0,
                means="dry friction at creeping speed, beyond that of gliding",
                is_level=True,
            ),
        )

    def shape_parameters(self, robot):
        unit = motion_unit(robot, self.joint)
        scale = 0.1 if unit == "m" else 1.0
        grid = tuple(scale * speed for speed in (0.02, 0.04, 0.08, 0.16, 0.32, 0.64))
        return (
            ShapeParameter(
                "vs",
                f"{unit}/s",
                grid,
                lower=0.005 * scale,
                upper=2.0 * scale,
                means="Stribeck speed: where 37 % of Fs are left",
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return block.sign(v, self.joint) * np.exp(-((v / self.shape[0]) ** 2))
