"""Play between the teeth of a transmission."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from dynident.effects.base import Block, Effect, Parameter, ShapeParameter, motion_unit
from dynident.effects.driven import (
    DrivenLink,
    Response,
    Transmitting,
    mean_inertia,
    share_of_rotor,
    stacked,
)
from dynident.effects.joint_elasticity import DAMPING, RESONANCE, ROTOR_SHARE
from dynident.effects.transmission import Transmission

_GAPS = (0.0015, 0.003, 0.006, 0.012)
"""rad (a tenth of it in m): gaps that are screened."""


class Backlash(Effect):
    """A gap between two compliant sides: the link is free inside.

    Its torque is not linear in the gap: the column is the driven response with the gap at which it
    is taken (`point`), per unit of it. See `dynident.effects.driven`.
    """

    name = "backlash"
    law = "driven response of the link in a gap"
    sign_of = "bursts where the load reverses"
    confounded_with = ("joint_elasticity", "presliding", "coulomb_friction")
    shown_by = "load"
    experiment = "move {joint} so that its load changes sign slowly, many times"
    needs = frozenset({"body", "whole"})
    secant = True

    def parameters(self, robot):
        return (Parameter("gap", motion_unit(robot, self.joint), 0.0),)

    def shape_parameters(self, robot):
        sides = ShapeParameter("resonance", "Hz", (15.0, 30.0), RESONANCE.lower, RESONANCE.upper)
        return (sides, DAMPING, ROTOR_SHARE)

    def variants(self, robot) -> Iterator[Backlash]:
        scale = 0.1 if motion_unit(robot, self.joint) == "m" else 1.0
        for one, gap in product(super().variants(robot), _GAPS):
            yield one.at([scale * gap])

    @property
    def gap(self) -> float:
        """The gap at which the column is taken."""
        given = self.point[0] if self.point else 0.0
        return max(given, _GAPS[0] / 100.0) if given > 0 else _GAPS[1]

    def suited(self, block: Block) -> Backlash:
        share = share_of_rotor(block, block.index(self.joint))
        return self if share is None else self.shaped(*self.shape[:2], share)

    def columns(self, block: Block) -> np.ndarray:
        _, response = self._response(block)
        return (response.torque / self.gap)[:, :, None]

    def sensitivities(self, block: Block) -> np.ndarray:
        gear, response = self._response(block)
        K, D, B = gear.stiffness, gear.damping, gear.rotor
        share = self.shape[2]
        other = -share / (1.0 - share)
        changes = ((2 * K, D, 0.0), (0.0, D, 0.0), (other * K, other * D, B))
        return stacked(response.by(*change, 0.0) / self.gap for change in changes)

    def by_gap(self, block: Block) -> np.ndarray:
        """Return the derivative of the torque by the gap at `point`, (T, n, 1)."""
        _, response = self._response(block)
        return response.by(0.0, 0.0, 0.0, 0.5)[:, :, None]

    def _response(self, block: Block) -> tuple[Transmitting, Response]:
        link = DrivenLink(block, block.index(self.joint))
        gear = Transmitting.of(link.inertia, self.shape, self.gap)
        return gear, link.response(gear)

    def simulated_force(self, values, block):
        return np.zeros(block.q.shape)

    def simulated_terms(self, values, robot):
        return ()

    def simulated_transmission(self, values, robot):
        joint, (gap,) = robot.names.index(str(self.joint)), values
        if not gap > 0:
            return None
        rotor = self.shape[2] / (1.0 - self.shape[2]) * mean_inertia(robot, joint)
        # The sides are as stiff as the shape says, for the motor that there is.
        resonance, damping, _ = self.shape
        stiffness = mean_inertia(robot, joint) * (2.0 * np.pi * resonance) ** 2
        return Transmission(joint, stiffness, damping * stiffness / (np.pi * resonance), gap, rotor)
