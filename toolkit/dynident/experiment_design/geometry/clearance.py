"""How far a robot stays from itself, by its own collision geometry, as Drake sees it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.errors import DesignError
from dynident.experiment_design.geometry.robot_shapes import RobotShapes
from dynident.robot import Robot

_SEEN = 0.1
"""m beyond the margin, within which distances are worked out: what is farther does not matter."""
_SAMPLES = 40  # random positions: what is too near at all of them, a motion does not change
_STEP = 1e-5  # rad or m, of a slope


@dataclass(frozen=True, eq=False)
class DistanceCut:
    """A bound on the position at an instant, by which a distance is kept near a known position.

    Attributes
    ----------
    t : s.
    slope : (n,) of the distance, m per rad or m.
    least : of slope @ q(t).
    """

    t: float
    slope: np.ndarray
    least: float


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
    def of(cls, robot: Robot, margin: float) -> Clearance:
        """Read the collision geometry of a robot's description.

        Links joined to each other are not looked at, nor what is too near at every one of many
        random positions: the housings of neighbours, a hull around a link with a hollow.

        Parameters
        ----------
        robot : with the description that it was read from.
        margin : m, to be kept.

        Raises
        ------
        DesignError
            If the margin is not positive, or the description states no geometry that can collide,
            or none that can be read.
        """
        if not (margin > 0 and np.isfinite(margin)):
            raise DesignError(f"clearance = {margin:g} m", remedy="choose it above 0")
        shapes = RobotShapes.of(robot)
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
        return replace(found, ignored=found._always(robot))

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

    def cuts(self, t: np.ndarray, q: np.ndarray) -> list[DistanceCut]:
        """Return bounds that move a motion away from where it comes too near.

        At each instant that is nearer than its neighbours, the distance as a linear function of
        the position.

        Parameters
        ----------
        t : (T,) s, of a period.
        q : (T, n).
        """
        near = self.along(q)
        lowest = (near <= np.roll(near, 1)) & (near < np.roll(near, -1)) & (near < self.margin)
        found = []
        for k in np.flatnonzero(lowest):
            slope = np.array(
                [
                    (self.distance(q[k] + step) - self.distance(q[k] - step)) / (2 * _STEP)
                    for step in _STEP * np.eye(len(q[k]))
                ]
            )
            if np.any(slope):
                least = self.margin - near[k] + float(slope @ q[k])
                found.append(DistanceCut(float(t[k]), slope, least))
        return found
