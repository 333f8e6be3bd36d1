"""How far a robot stays from itself and from obstacles, by its collision geometry in Drake."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.errors import DesignError
from dynident.experiment_design.geometry.robot_shapes import RobotShapes
from dynident.experiment_design.geometry.surroundings import Obstacle
from dynident.robot import Robot

_SEEN = 0.1
"""m beyond the margin, within which distances are worked out: what is farther does not matter."""
_SAMPLES = 40  # random positions: what is too near at all of them, a motion does not change


@dataclass(frozen=True, eq=False, kw_only=True)
class Clearance:
    """Distances between the links of a robot that can come near each other.

    Attributes
    ----------
    margin : m, that is kept.
    shapes : of the robot.
    context : of their plant.
    whole : context of the diagram that owns it.
    ignored : pairs of geometries that are too near wherever the robot stands.
    """

    margin: float
    shapes: RobotShapes
    context: Any
    whole: Any
    ignored: frozenset[tuple[int, int]]

    @classmethod
    def of(cls, robot: Robot, margin: float, obstacles: tuple[Obstacle, ...] = ()) -> Clearance:
        """Read the collision geometry of a robot's description.

        Links joined to each other are not looked at, nor what is too near at every one of many
        random positions: the housings of neighbours, a hull around a link with a hollow.

        Parameters
        ----------
        robot : with the description that it was read from.
        margin : m, to be kept.
        obstacles : around the robot, none of which is left out.

        Returns
        -------
        The distances to be kept.

        Raises
        ------
        DesignError
            If the margin is not positive, or the description states no geometry that can collide,
            or none that can be read; or if an obstacle is too near wherever the robot stands.
        """
        if not (margin > 0 and np.isfinite(margin)):
            raise DesignError(f"clearance = {margin:g} m", remedy="choose it above 0")
        shapes = RobotShapes.of(robot, obstacles)
        if not shapes.scene.model_inspector().GetCollisionCandidates():
            what = "states no collision geometry of links that could meet"
            raise DesignError(
                what,
                robot.description.path if robot.description else None,
                "leave the clearance out",
            )
        whole = shapes.builder.Build().CreateDefaultContext()
        context = shapes.plant.GetMyMutableContextFromRoot(whole)
        found = cls(margin=margin, shapes=shapes, context=context, whole=whole, ignored=frozenset())
        always = found._always(robot)
        fixed = {one.get_value() for one in shapes.obstacles}
        if any(fixed.intersection(pair) for pair in always):
            what = f"an obstacle is nearer than {margin:g} m wherever the robot stands"
            raise DesignError(
                what, remedy="check its centre and its size, or ask for less clearance"
            )
        return replace(found, ignored=always)

    def _always(self, robot: Robot) -> frozenset[tuple[int, int]]:
        near = [set(self._pairs(q, self.margin)) for q in robot.random_motion(0, _SAMPLES)[0]]
        return frozenset(set.intersection(*near))

    def _pairs(self, q: np.ndarray, within: float) -> dict[tuple[int, int], float]:
        """Pairs of geometries nearer than that, and their distances."""
        plant = self.shapes.plant
        others = plant.GetPositions(self.context)
        plant.SetPositions(self.context, self.shapes.positions(q, others))
        query = plant.get_geometry_query_input_port().Eval(self.context)
        found = query.ComputeSignedDistancePairwiseClosestPoints(within)
        return {(one.id_A.get_value(), one.id_B.get_value()): float(one.distance) for one in found}

    def distance(self, q: np.ndarray) -> float:
        """Return the least distance at a position, m; what is far beyond the margin is that far.

        Parameters
        ----------
        q : (n,) rad or m.
        """
        farthest = self.margin + _SEEN
        pairs = self._pairs(q, farthest)
        known = (one for pair, one in pairs.items() if pair not in self.ignored)
        return min(known, default=farthest)

    def along(self, q: np.ndarray) -> np.ndarray:
        """Return the least distance along a motion, (T,) m.

        Parameters
        ----------
        q : (T, n).
        """
        return np.array([self.distance(one) for one in q])
