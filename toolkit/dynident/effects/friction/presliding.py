"""Dry friction that builds up over a distance instead of a speed (Dahl)."""

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
from dynident.effects.traits import Needs
from dynident.effects.transmissions.bands import solve_band


class Presliding(JointEffect):
    """A share Fp of the dry friction follows Dahl's state z instead of tanh(v / w).

    z' = (v - abs(v) z) / distance; at speed z is the sign of v, and nothing is added. Between two
    samples the joint is taken to move one way, which integrates z exactly. Source: Dahl (1968),
    A solid friction model.
    """

    name = "presliding"
    law = "Fp (z - sign(v)), z' = (v - abs(v) z)/distance"
    sign_of = "loops after each reversal"
    meaning = (
        "before it slips the joint gives a little, so that friction builds up over a small "
        "distance after each reversal"
    )
    confounded_with = ("coulomb_friction", "stribeck_friction", "backlash")
    shown_by = "tiny reversals"
    experiment = "move {joint} to and fro by less than 0.01 rad (or 1 mm)"
    needs = Needs.RECORDING
    memory = 1

    def parameters(self, robot):
        return (
            Parameter(
                "Fp",
                force_unit(robot, self.joint),
                0.0,
                means="dry friction that builds up over a distance",
                is_level=True,
            ),
        )

    def shape_parameters(self, robot):
        unit = motion_unit(robot, self.joint)
        scale = 0.1 if unit == "m" else 1.0
        grid = tuple(scale * distance for distance in (1e-3, 3e-3, 1e-2, 3e-2))
        return (
            ShapeParameter(
                "distance",
                unit,
                grid,
                lower=1e-4 * scale,
                upper=0.3 * scale,
                means="distance after a reversal over which it builds up",
            ),
        )

    def at_joint(self, block: Block) -> np.ndarray:
        if block.memory is not None:  # one instant of a simulation
            v = block.v[:, [block.index(self.joint)]]
            return block.memory[:, :1] - block.sign(v, self.joint)
        j = block.index(self.joint)
        return (self._state(block, j)[0] - block.sign(block.v[:, j], self.joint))[:, None]

    def sensitivities(self, block: Block) -> np.ndarray:
        j = block.index(self.joint)
        full = np.zeros((*block.q.shape, 1, 1))
        full[:, j, 0, 0] = self._state(block, j)[1]
        return full

    def _state(self, block: Block, j: int) -> tuple[np.ndarray, np.ndarray]:
        """Return z (T,), and its derivative by the logarithm of the distance.

        Where the motion repeats, a period of it is run through before.
        """
        q = block.q[:, j]
        before = 0
        if block.period is not None:
            before = min(round(block.period / float(np.mean(np.diff(block.t)))), len(q) - 1)
        step = np.diff(np.concatenate([q[:before] - q[before] + q[0], q]))
        way, sign = np.abs(step) / self.shape[0], np.sign(step)
        kept = np.exp(-way)
        start = block.sign(block.v[:1, j], self.joint)
        z = _recursion(kept, np.concatenate([start, sign * -np.expm1(-way)]))
        change = np.concatenate([[0.0], (z[:-1] - sign) * kept * way])
        return z[before:], _recursion(kept, change)[before:]

    def simulated_rate(self, values, block):
        v = block.v[:, [block.index(self.joint)]]
        return (v - np.abs(v) * block.memory) / self.shape[0]


def _recursion(kept: np.ndarray, added: np.ndarray) -> np.ndarray:
    """Return x with x[0] = added[0] and x[k + 1] = kept[k] x[k] + added[k + 1]."""
    band = np.ones((2, len(added)))
    band[1, :-1] = -kept
    return solve_band(band, added)
