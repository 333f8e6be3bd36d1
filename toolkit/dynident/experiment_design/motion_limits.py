"""What a motion may do: limits of position, speed, acceleration, jerk and torque of each joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import Field

from dynident.errors import DesignError
from dynident.experiment_design.geometry.surroundings import (
    BoxEntry,
    Obstacle,
    ObstacleEntry,
    StayBox,
)
from dynident.robot import Robot
from dynident.settings import SettingsTable, read_toml
from dynident.words import nearest

MARGIN = 0.9
"""Share of the description's limits that a motion uses."""
UNLIMITED = {"revolute": (1.0, 2.0, 10.0), "prismatic": (0.3, 0.5, 3.0)}
"""Half range (rad, m), speed and acceleration where nothing is stated."""


class _JointLimits(SettingsTable):
    """Limits of a joint; what is left out is as the description has it.

    Attributes
    ----------
    lower, upper : rad or m.
    speed, acceleration, jerk : rad/s or m/s, per s, and per s^2.
    torque : N m or N.
    """

    lower: float | None = None
    upper: float | None = None
    speed: float | None = Field(default=None, gt=0)
    acceleration: float | None = Field(default=None, gt=0)
    jerk: float | None = Field(default=None, gt=0)
    torque: float | None = Field(default=None, gt=0)


class LimitsFile(SettingsTable):
    """A file of limits: a table for each joint, and what is around the robot."""

    joints: dict[str, _JointLimits] = Field(default_factory=dict)
    boxes: list[BoxEntry] = Field(default_factory=list)
    obstacles: list[ObstacleEntry] = Field(default_factory=list)


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionLimits:
    """Limits of a motion, each (n,).

    Attributes
    ----------
    lower, upper : rad or m.
    speed, acceleration : rad/s or m/s, and per s.
    jerk : rad/s^3 or m/s^3; infinite where none is stated.
    torque : N m or N; infinite where none is known.
    boxes : that points of the robot stay in.
    obstacles : that it stays clear of.
    """

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray
    torque: np.ndarray
    boxes: tuple[StayBox, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def jerk_limited(self) -> np.ndarray:
        """Joints whose jerk is limited, (n,) mask."""
        return np.isfinite(self.jerk)

    @classmethod
    def of(cls, robot: Robot, margin: float = MARGIN) -> MotionLimits:
        """Return a share of the limits that a robot's description states, else usual ones.

        The acceleration, which descriptions do not state, is what takes a third of a second to
        full speed.

        Raises
        ------
        DesignError
            If the margin is not between 0 and 1.
        """
        if not 0 < margin <= 1:
            raise DesignError(f"margin = {margin:g}", remedy="choose it above 0, and at most 1")
        usual = np.array([UNLIMITED[joint.kind] for joint in robot.joints])
        lower, upper = (_stated([getattr(j, end) for j in robot.joints]) for end in _ENDS)
        # Where one end is free, the range begins at the other; where both are, it is about zero.
        free = np.isinf(lower) & np.isinf(upper)
        low = np.where(np.isinf(lower), np.where(free, 0.0, upper) - usual[:, 0], lower)
        high = np.where(np.isinf(upper), np.where(free, 0.0, lower) + usual[:, 0], upper)
        middle, half = (low + high) / 2, margin * (high - low) / 2
        stated = _stated([joint.velocity for joint in robot.joints])
        speed = np.where(np.isfinite(stated), margin * stated, usual[:, 1])
        effort = _stated([joint.effort for joint in robot.joints])
        acceleration = np.where(np.isfinite(stated), 3.0 * speed, usual[:, 2])
        return cls(
            lower=middle - half,
            upper=middle + half,
            speed=speed,
            acceleration=acceleration,
            jerk=np.full(len(speed), np.inf),
            torque=margin * effort,
        )

    @classmethod
    def from_file(cls, path: str | Path, robot: Robot) -> MotionLimits:
        """Read limits: `[joints.elbow]` with those that differ from the description's.

        They are `lower`, `upper`, `speed`, `acceleration`, `jerk` and `torque`. Besides there are
        `[[boxes]]` that points of the robot stay in, and `[[obstacles]]`.

        Raises
        ------
        DynidentError
            If the file cannot be read, names a joint that the robot has not, or leaves no room.
        """
        said, where = read_toml(path, LimitsFile), str(path)
        joints = {name: one.model_dump(exclude_none=True) for name, one in said.joints.items()}
        return replace(
            cls.of(robot).changed(joints, robot, where),
            boxes=tuple(StayBox.of(one, robot, where) for one in said.boxes),
            obstacles=tuple(Obstacle.of(one, where) for one in said.obstacles),
        )

    def shares(
        self, q: np.ndarray, rates: tuple[np.ndarray, np.ndarray, np.ndarray], centre: np.ndarray
    ) -> np.ndarray:
        """Return the largest share of each limit that a motion uses; infinite if it is no number.

        Between instants a motion may use more than at them: by an eighth of the second difference,
        as a parabola through three of them has it.

        Parameters
        ----------
        q : (T, n), at instants that are evenly spaced over a period.
        rates : speed, acceleration and torque, (T, n) each.
        centre : (n,) position that the range is seen from.

        Returns
        -------
        (4 n,) of position, speed, acceleration and torque.
        """
        moved = q - centre
        limits = (self.speed, self.acceleration, self.torque)
        shares = [
            moved / np.where(moved > 0, self.upper - centre, centre - self.lower),
            *(one / limit for one, limit in zip(rates, limits, strict=True)),
        ]
        # What is no number is within no limit.
        used = np.abs(np.concatenate(shares, axis=1))
        used = np.where(np.isfinite(used), used, np.inf)
        return (used + above_instants(used)).max(axis=0)

    def jerk_shares(self, jerk: np.ndarray) -> np.ndarray:
        """Return the largest share of the limit of jerk that a motion uses, (n,).

        Between instants as for `shares`; but what ends and begins again need not be the same.

        Parameters
        ----------
        jerk : (T, n), at instants that are evenly spaced from the beginning of a period to its end.
        """
        used = np.abs(jerk / self.jerk)
        used = np.where(np.isfinite(used), used, np.inf)
        above = above_instants(used)
        if len(used) > 2:
            above[0], above[-1] = above[1], above[-2]
        return (used + above).max(axis=0)

    def changed(
        self, values: Mapping[str, Mapping[str, float]], robot: Robot, where: str = "limits"
    ) -> MotionLimits:
        """Return the limits with other values: joint -> name of a limit -> value.

        Parameters
        ----------
        values : those that differ.
        robot : whose joints they are.
        where : for messages.

        Returns
        -------
        All limits.

        Raises
        ------
        DesignError
            If a joint is unknown, or its lower limit is not below its upper one.
        """
        arrays = {name: np.array(getattr(self, name)) for name in _NAMES}
        for joint, own in values.items():
            if joint not in robot.names:
                remedy = nearest(joint, robot.names, "joints")
                raise DesignError(f"the robot has no joint '{joint}'", where, remedy)
            for name, value in own.items():
                arrays[name][robot.names.index(joint)] = value
        found = replace(self, **arrays)
        found.require_ranges(robot, where)
        return found

    def require_ranges(self, robot: Robot, where: str | None = None) -> None:
        """Raise `DesignError` if a joint has no range to move in.

        Parameters
        ----------
        robot : whose joints they are.
        where : for messages.
        """
        for j, joint in enumerate(robot.names):
            if not self.lower[j] < self.upper[j]:
                what = f"the range of {joint} is {self.lower[j]:g} to {self.upper[j]:g}"
                raise DesignError(what, where, "give lower below upper")


def above_instants(values: np.ndarray) -> np.ndarray:
    """Return how far smooth values (T, k) exceed or undercut those at an instant close to it.

    Parameters
    ----------
    values : at instants that are evenly spaced over a period; what is infinite exceeds by nothing.
    """
    known = np.where(np.isfinite(values), values, 0.0)
    return np.abs(np.roll(known, 1, axis=0) - 2 * known + np.roll(known, -1, axis=0)) / 8


def _stated(numbers: list[float]) -> np.ndarray:
    """Limits of a description; what is beyond everything stands for none."""
    found = np.array(numbers, dtype=float)
    return np.where(np.abs(found) < _NONE, found, np.copysign(np.inf, found))


_NAMES = ("lower", "upper", "speed", "acceleration", "jerk", "torque")
_ENDS = ("lower", "upper")
_NONE = 1e6
