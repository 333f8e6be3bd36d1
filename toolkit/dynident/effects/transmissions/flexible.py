"""What a spring and a dead zone between a motor and its link have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from dynident.effects.effect import Block, Forceless, ShapeParameter
from dynident.effects.traits import Needs
from dynident.effects.transmission import Transmission
from dynident.effects.transmissions.along import mean_inertia, share_of_rotor
from dynident.effects.transmissions.dead_zone import Transmitting
from dynident.effects.transmissions.driven_link import DrivenLink, driven_link
from dynident.effects.transmissions.link_response import Response, response, stacked
from dynident.robot import Robot

_SCREENED = (3.0, 4.0, 5.4, 7.3, 9.8, 13.2, 18.0, 25.0, 40.0, 80.0)  # Hz: a peak is narrow
RESONANCE = ShapeParameter(
    "resonance",
    "Hz",
    _SCREENED,
    lower=2.0,
    upper=200.0,
    means="frequency of the link against the locked motor",
)
"""Of the link against the locked motor, at the mean of its inertia."""
DAMPING = ShapeParameter(
    "damping", "1", (0.1, 0.35), lower=0.002, upper=2.0, means="damping ratio of that resonance"
)
ROTOR_SHARE = ShapeParameter(
    "rotor_share",
    "1",
    (0.3,),
    lower=0.005,
    upper=0.95,
    means="share of the motor in the inertia that moves with the joint",
)
"""Share of the motor in the inertia that moves with the joint."""


class FlexibleJoint(Forceless):
    """A compliant transmission between the motor and the link of a joint, perhaps with a dead zone.

    Its column is a filtered dynamic regressor, the response of the link behind it. The torque of
    every joint changes, as all feel the link's acceleration. See
    `dynident.effects.transmissions.link_response`.
    """

    needs = Needs.BODIES | Needs.RECORDING

    @property
    def gap(self) -> float:
        """The gap at which the response is taken, rad or m."""
        return 0.0

    @abstractmethod
    def per_unit(self, stiffness: float) -> float:
        """What takes the response to a column: linear in the stiffness, or independent of it."""

    def suited(self, block: Block) -> FlexibleJoint:
        share = share_of_rotor(block, block.index(self.joint))
        return self if share is None else self.shaped(*self.shape[:2], share)

    def unresolved(self, values: Sequence[float], step: float) -> str:
        resonance, most = self.shape[0], 0.5 / step
        if resonance <= most:
            return ""
        return f"resonates at {resonance:.3g} Hz, above the {most:.3g} Hz that the samples tell"

    def columns(self, block: Block) -> np.ndarray:
        return self._column(self._response(self._link(block)))

    def family(
        self, variants: Sequence[FlexibleJoint], blocks: Sequence[Block]
    ) -> list[list[np.ndarray]]:
        # One after the other: what each makes of its motion takes much memory.
        return [
            [one._column(response(link, one._gear(link))) for one in variants]
            for link in map(self._link, blocks)
        ]

    def sensitivities(self, block: Block) -> np.ndarray:
        found = self._response(self._link(block))
        K, D, B = found.gear.stiffness, found.gear.damping, found.gear.rotor
        # The shares of motor and link sum to one: what the motor gains, the link has not.
        other = -self.shape[2] / (1.0 - self.shape[2])
        slopes = []
        for stiffness, damping, rotor in (
            (2 * K, D, 0.0),
            (0.0, D, 0.0),
            (other * K, other * D, B),
        ):
            change = self.per_unit(K + stiffness) - self.per_unit(K)
            by = found.by(stiffness, damping, rotor)
            slopes.append(self.per_unit(K) * by + change * found.torque)
        return stacked(slopes)

    def _link(self, block: Block) -> DrivenLink:
        return driven_link(block, block.index(self.joint))

    def _column(self, found: Response) -> np.ndarray:
        return (self.per_unit(found.gear.stiffness) * found.torque)[:, :, None]

    def _gear(self, link: DrivenLink) -> Transmitting:
        return Transmitting.of(link.inertia, self.shape, self.gap)

    def _response(self, link: DrivenLink) -> Response:
        gear = self._gear(link)
        if link.latest is None or link.latest.gear != gear:
            link.latest = response(link, gear)
        return link.latest

    def transmission(self, robot: Robot, stiffness: float, gap: float) -> Transmission:
        """Return it as a simulator has it, for the motor and the damping of this shape.

        Parameters
        ----------
        robot : as described.
        stiffness : N m/rad or N/m.
        gap : rad or m, width of the dead zone; 0 for none.
        """
        joint = robot.names.index(str(self.joint))
        resonance, damping, share = self.shape
        rotor = share / (1.0 - share) * mean_inertia(robot, joint)
        return Transmission(
            joint=joint,
            stiffness=stiffness,
            damping=damping * stiffness / (np.pi * resonance),
            gap=gap,
            rotor=rotor,
        )
