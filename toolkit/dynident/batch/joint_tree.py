"""The moving joints of a robot as numbers: all that its equations of motion are written from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, kw_only=True)
class JointTree:
    """A tree of joints with one degree of freedom each, and gravity.

    Two trees of the same numbers are equal, so that their functions are made once.

    Attributes
    ----------
    parents : (n,) index of the joint that carries each; -1 for the world.
    prismatic : (n,) whether a joint slides along its axis, else it turns about it.
    placements : n times twelve numbers: R row by row, then p in m, of the joint's frame in its
        parent's (the world's for -1) at q = 0.
    axes : n times three numbers: unit vector in the joint's frame.
    gravity : m/s^2, in the world's axes.
    """

    parents: tuple[int, ...]
    prismatic: tuple[bool, ...]
    placements: tuple[tuple[float, ...], ...]
    axes: tuple[tuple[float, ...], ...]
    gravity: tuple[float, ...]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.parents)

    def placement(self, joint: int) -> tuple[np.ndarray, np.ndarray]:
        """R (3, 3) and p (3,) in m of a joint's frame in its parent's."""
        numbers = np.array(self.placements[joint])
        return numbers[:9].reshape(3, 3), numbers[9:]

    @cached_property
    def order(self) -> tuple[int, ...]:
        """The joints, each after its parent."""
        return tuple(sorted(range(self.n), key=lambda joint: len(self.carriers[joint])))

    @cached_property
    def carriers(self) -> tuple[tuple[int, ...], ...]:
        """For each joint those that move its link, from the world on; itself the last."""
        found = []
        for joint in range(self.n):
            path = [joint]
            while self.parents[path[-1]] != -1:
                path.append(self.parents[path[-1]])
            found.append(tuple(reversed(path)))
        return tuple(found)
