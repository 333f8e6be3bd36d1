"""Points whose convex hull holds a shape, and what can be said of mass inside a hull.

Qhull (SciPy) makes the hulls. `trimesh` would add the moments of a solid, which are ten lines here.
"""

from __future__ import annotations

from functools import cache, cached_property
from itertools import product

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from dynident.robot.tree import Array

_SIDES = 32
_THIN = 1e-6


def circumscribed(kind: str, sizes: tuple[float, ...]) -> Array:
    """Return points (k, 3) whose convex hull holds a shape; see `formats.format.Shape`.

    The hull of a round shape is a little larger than the shape (below 1 % for a cylinder, 4 % for
    a ball), never smaller.
    """
    if kind == "box":
        return 0.5 * np.array(list(product((-1, 1), repeat=3))) * sizes
    if kind in ("sphere", "ellipsoid"):
        return _ball() * sizes
    radius, length = sizes
    ring = radius * (_circle() if kind == "cylinder" else _ball())
    end = np.array([0.0, 0.0, 0.5 * length])
    return np.vstack([ring - end, ring + end])


@cache
def _circle() -> Array:
    angle = np.arange(_SIDES) * 2 * np.pi / _SIDES
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)])
    return ring / np.cos(np.pi / _SIDES)


@cache
def _ball() -> Array:
    """Points around the unit ball: evenly spread, then moved out until the hull holds the ball."""
    count = 200
    z = 1.0 - (2 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - z**2)
    points = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
    # The poles and the axes, so that extents along them are exact but for the factor.
    points = np.vstack([points, np.eye(3), -np.eye(3)])
    return points / -np.max(ConvexHull(points).equations[:, 3])


class Hull:
    """The convex hull of points.

    Parameters
    ----------
    points : (k, 3)
        m; flat sets of points are given a trace of thickness.
    """

    def __init__(self, points: Array) -> None:
        spread = float(np.max(np.ptp(points, axis=0))) if len(points) else 0.0
        try:
            hull = ConvexHull(points)
        except (QhullError, ValueError):
            corners = np.array(list(product((-1, 1), repeat=3))) * _THIN * max(spread, 1e-9)
            points = (points[:, None] + corners).reshape(-1, 3)
            hull = ConvexHull(points, qhull_options="QJ")
        self.points: Array = points[hull.vertices]
        self.volume = float(hull.volume)
        self._all, self._facets = points, hull.simplices
        # Triangles of one flat facet have the same plane.
        _, first = np.unique(np.round(hull.equations, 9), axis=0, return_index=True)
        self._planes: Array = hull.equations[first]

    @property
    def normals(self) -> Array:
        """Outward normals of the facets, (k, 3)."""
        return self._planes[:, :3]

    @cached_property
    def box(self) -> Array:
        """Edges (3,) of the box around it along the frame's axes, m."""
        return np.ptp(self.points, axis=0)

    @property
    def extent(self) -> float:
        """Diagonal of that box, m."""
        return float(np.linalg.norm(self.box))

    def depth(self, point: Array) -> float:
        """Distance to the surface, m: positive inside, negative outside."""
        inside = -float(np.max(self._planes[:, :3] @ point + self._planes[:, 3]))
        return inside if inside >= 0.0 else -float(np.linalg.norm(self.nearest(point) - point))

    def nearest(self, point: Array) -> Array:
        """Return the point of the hull nearest to a point (3,)."""
        if np.max(self._planes[:, :3] @ point + self._planes[:, 3]) <= 0.0:
            return point
        # min |V' w - x| over w >= 0 with sum w = 1, the sum as a heavily weighted row. Lengths
        # in units of the extent, from its middle.
        middle, size = self.points.mean(axis=0), max(self.extent, np.linalg.norm(point), 1e-9)
        corners, target = (self.points - middle) / size, (point - middle) / size
        heavy = 1e4
        rows = np.vstack([corners.T, np.full((1, len(corners)), heavy)])
        weights, _ = nnls(rows, np.append(target, heavy))
        return self.points.T @ (weights / weights.sum())

    def reach(self, directions: Array) -> tuple[Array, Array]:
        """Return the least and the largest coordinate of the hull along directions (k, 3)."""
        along = self.points @ directions.T
        return along.min(axis=0), along.max(axis=0)

    @cached_property
    def second_moment(self) -> Array:
        """Second moment of a uniform filling about its own centre, by mass, (3, 3) m^2."""
        # Tetrahedra on the facets, with their fourth corner in the middle (the origin here).
        corners = self._all[self._facets] - self.points.mean(axis=0)
        volume = np.abs(np.linalg.det(corners)) / 6.0
        if not np.sum(volume) > 0.0:
            return np.zeros((3, 3))
        share, whole = volume / np.sum(volume), corners.sum(axis=1)
        first = share @ whole / 4.0
        second = np.einsum("t,tki,tkj->ij", share, corners, corners)
        second += np.einsum("t,ti,tj->ij", share, whole, whole)
        return second / 20.0 - np.outer(first, first)
