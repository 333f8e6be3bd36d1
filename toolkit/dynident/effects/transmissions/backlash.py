"""Play between the teeth of a transmission."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from dynident.effects.effect import Block, Parameter, motion_unit
from dynident.effects.transmissions.along import mean_inertia
from dynident.effects.transmissions.flexible import DAMPING, RESONANCE, ROTOR_SHARE, FlexibleJoint
from dynident.effects.transmissions.link_response import responses

_GAPS = (0.0005, 0.0015, 0.004, 0.01, 0.025, 0.05)
"""rad (a tenth of it in m): gaps that are screened."""
_USUAL, _LEAST = 0.004, 1e-6
"""rad or m: the gap of an effect without a value, and the least at which a column is taken."""
_SOUGHT = ((8.0, 150.0), (0.02, 1.2), (0.05, 0.9))
"""Hz, 1 and 1: shapes that are searched through, from teeth that bounce to teeth that do not."""
_SOUGHT_GAPS = (1e-4, 6e-2)
"""rad (a tenth of it in m): from a third of an arc minute, as in precise gears."""


class Backlash(FlexibleJoint):
    """A dead zone between two compliant sides: the link is free inside.

    Its torque is not linear in the gap: the column is the response with the gap that is the
    linearisation point, per unit of it.
    """

    name = "backlash"
    law = "response of the link in a dead zone"
    sign_of = "bursts where the load reverses"
    meaning = (
        "there is play in the transmission: when the load changes sides, the motor turns a "
        "little before the link follows"
    )
    confounded_with = ("joint_elasticity", "presliding", "coulomb_friction")
    stands_in_for = ("joint_elasticity",)  # whose sides bend far more than its gap is wide
    excludes = ("joint_elasticity",)  # a joint has one transmission, and its sides are elastic
    shown_by = "load"
    experiment = "move {joint} so that its load changes sign slowly, many times"
    nonlinear = True

    def parameters(self, robot):
        return (
            Parameter("gap", motion_unit(robot, self.joint), 0.0, means="play of the transmission"),
        )

    def shape_parameters(self, robot):
        return (
            replace(RESONANCE, grid=(15.0, 30.0)),
            replace(DAMPING, grid=(0.1, 0.7)),
            ROTOR_SHARE,
        )

    def variants(self, robot) -> Iterator[Backlash]:
        scale = 0.1 if motion_unit(robot, self.joint) == "m" else 1.0
        for one, gap in product(super().variants(robot), _GAPS):
            yield one.at([scale * gap])

    def sought_in(self, robot):
        scale = 0.1 if motion_unit(robot, self.joint) == "m" else 1.0
        low, high = _SOUGHT_GAPS
        return (*_SOUGHT, (scale * low, scale * high))

    @property
    def gap(self) -> float:
        """The gap at which the column is taken."""
        given = self.point[0] if self.point else 0.0
        return max(given, _LEAST) if given > 0 else _USUAL

    def family(
        self, variants: Sequence[Backlash], blocks: Sequence[Block]
    ) -> list[list[np.ndarray]]:
        links = [self._link(block) for block in blocks]
        gears = [[one._gear(link) for one in variants] for link in links]
        return [
            [one._column(found) for one, found in zip(variants, each, strict=True)]
            for each in responses(links, gears)
        ]

    def point_slope(self, block):
        found = self._response(self._link(block))
        return found.by(0.0, 0.0, 0.0, half_gap=0.5)[:, :, None]

    def per_unit(self, stiffness):
        return 1.0 / self.gap

    def simulated_transmission(self, values, robot):
        (gap,) = values
        # The sides are as stiff as the shape says.
        joint = robot.names.index(str(self.joint))
        stiffness = mean_inertia(robot, joint) * (2.0 * np.pi * self.shape[0]) ** 2
        return self.transmission(robot, stiffness, gap) if gap > 0 else None
