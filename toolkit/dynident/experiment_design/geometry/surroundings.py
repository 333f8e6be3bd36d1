"""What is around a robot: boxes that points of it stay in, and obstacles that it stays clear of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from dynident.errors import DesignError
from dynident.robot import Robot
from dynident.settings import SettingsTable
from dynident.words import nearest

_Position = Annotated[list[float], Field(min_length=3, max_length=3)]
_Size = Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=3, max_length=3)]


class BoxEntry(SettingsTable):
    """A box that a point of the robot stays in, along the axes of the base.

    Attributes
    ----------
    joint : with which the point moves.
    point : m, in the frame of that joint, whose origin is on its axis.
    lower, upper : m, in the frame of the base.
    """

    joint: str
    point: _Position = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    lower: _Position
    upper: _Position


class ObstacleEntry(SettingsTable):
    """An obstacle, fixed to the base: a box along its axes, or a sphere.

    Attributes
    ----------
    centre : m, in the frame of the base.
    size : m, of a box, from face to face.
    radius : m, of a sphere.
    """

    centre: _Position
    size: _Size | None = None
    radius: float | None = Field(default=None, gt=0)


@dataclass(frozen=True, eq=False)
class Obstacle:
    """An obstacle; `size` (3,) m of a box, or (1,) the radius of a sphere, `centre` (3,) m."""

    centre: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, entry: ObstacleEntry, where: str) -> Obstacle:
        """Return the obstacle of an entry; raise `DesignError` if it is no box and no sphere."""
        if (entry.size is None) == (entry.radius is None):
            what = "an obstacle has a size (of a box) or a radius (of a sphere)"
            raise DesignError(what, where, "give one of them")
        size = [entry.radius] if entry.size is None else entry.size
        return cls(np.array(entry.centre), np.array(size, dtype=float))

    def shape(self) -> Any:
        """Return its shape, as Drake has it."""
        from pydrake.geometry import Box, Sphere

        return Sphere(self.size[0]) if len(self.size) == 1 else Box(*self.size)


@dataclass(frozen=True, eq=False, kw_only=True)
class StayBox:
    """A box that a point of the robot stays in.

    Attributes
    ----------
    robot : whose point it is.
    joint : index of the joint with which it moves.
    point : (3,) m, in that joint's frame.
    lower, upper : (3,) m, in the frame of the base.
    """

    robot: Robot
    joint: int
    point: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @classmethod
    def of(cls, entry: BoxEntry, robot: Robot, where: str) -> StayBox:
        """Return the box of an entry.

        Parameters
        ----------
        entry : of the file.
        robot : whose point it is.
        where : the file, for messages.

        Returns
        -------
        The box, of that robot.

        Raises
        ------
        DesignError
            If the joint is unknown, or the box has no inside.
        """
        if entry.joint not in robot.names:
            remedy = nearest(entry.joint, robot.names, "joints")
            raise DesignError(f"the robot has no joint '{entry.joint}'", where, remedy)
        lower, upper = np.array(entry.lower), np.array(entry.upper)
        if not np.all(lower < upper):
            what = f"the box of {entry.joint} has no inside"
            raise DesignError(what, where, "give lower below upper on each axis")
        return cls(
            robot=robot,
            joint=robot.names.index(entry.joint),
            point=np.array(entry.point),
            lower=lower,
            upper=upper,
        )

    def places(self, q: np.ndarray) -> np.ndarray:
        """Return where the point is in the frame of the base, (T, 3) m.

        Parameters
        ----------
        q : (T, n) rad or m.
        """
        found = np.tile(self.point, (len(q), 1))
        index = self.joint
        while index != -1:
            joint = self.robot.joints[index]
            moved = np.outer(q[:, index], joint.axis)
            if joint.kind == "revolute":
                found = Rotation.from_rotvec(moved).apply(found)
            else:
                found = found + moved
            found = found @ joint.R.T + joint.p
            index = joint.parent
        return found

    def room(self, q: np.ndarray) -> np.ndarray:
        """Return how far the point is from the nearest face, (T,) m; below 0 outside."""
        places = self.places(q)
        return np.minimum(places - self.lower, self.upper - places).min(axis=1)
