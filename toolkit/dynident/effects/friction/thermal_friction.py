"""Friction that changes as the drives warm up."""

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

COOL = 25.0
"""Degrees Celsius at which the friction is that of the other effects."""
SPAN = 10.0
"""K for which its parameters are the change."""


class ThermalFriction(JointEffect):
    """Viscous and dry friction in proportion to a factor h: h (Fvt v + Fct tanh(v / w)).

    Where the motor's temperature is recorded, h = (temperature - 25 C) / 10 K; elsewhere it is the
    warming up itself, h = exp(-t / T) with the time t of the session. Either sign is possible:
    friction mostly falls as a drive warms up, which is a positive change with the time and a
    negative one with the temperature. Recordings that belong together should all have the
    temperature, or none.
    """

    name = "thermal_friction"
    opposes_motion = True
    time_varying = True
    # Where the session is short beside T nothing warms up, and these two are what it looks like.
    stands_in_for = ("viscous_friction", "coulomb_friction")
    law = "h (Fvt v + Fct sign(v)), h = exp(-t/T) or (temperature - 25 C)/10 K"
    sign_of = "slopes and steps against velocity that change in the course of the session"
    meaning = "friction changes as the joint warms up"
    confounded_with = ("viscous_friction", "coulomb_friction", "torque_drift")
    shown_by = "session"
    experiment = (
        "repeat one recording of {joint} from a cold start until it is warm, with its temperature "
        "if there is a sensor"
    )

    def parameters(self, robot):
        force, motion = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (
            Parameter(
                "Fvt",
                f"{force} s/{motion}",
                means="viscous friction, cold less warm; or its change per 10 K",
            ),
            Parameter(
                "Fct",
                force,
                means="dry friction, cold less warm; or its change per 10 K",
            ),
        )

    def shape_parameters(self, robot):
        grid = (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
        return (
            ShapeParameter(
                "T", "s", grid, lower=1.0, upper=1e5, means="time in which the joint warms up"
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        v = block.v[:, [block.index(self.joint)]]
        return self.time_factor(block)[:, None] * np.hstack([v, block.sign(v, self.joint)])

    def sensitivities(self, block: Block) -> np.ndarray:
        columns = self.columns(block)
        if self._temperature(block) is not None:
            return np.zeros((*columns.shape, 1))
        # d exp(-t / T) / d log T = t / T exp(-t / T)
        return (block.t[:, None, None] / self.shape[0] * columns)[..., None]

    def temperature(self, t: np.ndarray) -> np.ndarray:
        """Return the temperature of the session's times t (T,) that this law takes, in C."""
        return COOL + SPAN * np.exp(-t / self.shape[0])

    def time_factor(self, block: Block) -> np.ndarray:
        recorded = self._temperature(block)
        if recorded is None:
            return np.exp(-block.t / self.shape[0])
        return (recorded - COOL) / SPAN

    def _temperature(self, block: Block) -> np.ndarray | None:
        """Temperature of the joint, (T,) C, where it is recorded."""
        if block.temperature is None:
            return None
        here = block.temperature[:, block.index(self.joint)]
        return here if np.isfinite(here).all() else None
