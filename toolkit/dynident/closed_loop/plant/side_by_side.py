"""Mechanisms side by side in one plant: where they stand, and what one diagram can serve.

In: mechanisms of n joints each. Out: their places in the plant, and what has to agree for one
diagram to simulate others.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.closed_loop.mechanism import Mechanism
from dynident.robot import Robot


@dataclass(frozen=True, eq=False)
class Bodies:
    """Mechanisms of n joints each, side by side in one plant.

    Attributes
    ----------
    mechanisms : K of them.
    starts : (K,) s, added to the time of each.
    place : (K n,) where each joint's speed stands in the plant's velocities, and its position in
        the plant's positions, which come first in the state.
    """

    mechanisms: tuple[Mechanism, ...]
    starts: tuple[float, ...]
    place: np.ndarray

    @property
    def distinct(self) -> list[Mechanism]:
        """Each mechanism once."""
        return list({id(one): one for one in self.mechanisms}.values())

    @property
    def memory(self) -> int:
        """Number of internal states of all, M: one mechanism after the other."""
        return sum(one.memory for one in self.mechanisms)


def with_other_forces(bodies: Bodies) -> Bodies:
    """Return the mechanisms with only those effects whose force is more than terms."""
    by_id = {id(one): replace(one, effects=one.others) for one in bodies.distinct}
    return replace(bodies, mechanisms=tuple(by_id[id(one)] for one in bodies.mechanisms))


def giving_way(mechanisms: Sequence[Mechanism]) -> np.ndarray:
    """Return which of the N joints give way, (c,) in our order."""
    n = mechanisms[0].robot.n
    joints = [k * n + gear.joint for k, one in enumerate(mechanisms) for gear in one.transmissions]
    return np.array(joints, dtype=int)


def structure(mechanisms: Sequence[Mechanism]) -> Hashable:
    """Return what two groups of mechanisms have in common where one diagram serves both."""
    parts = []
    for one in mechanisms:
        terms = frozenset((term.at, term.law, term.of) for term in one.terms)
        others = tuple((other.effect, len(other.values)) for other in one.others)
        said = (one.friction_width, one.carries_payload, one.number) if others else ()
        gears = tuple(gear.joint for gear in one.transmissions)
        train = gears, bool(np.any(one.loss))
        parts.append((_kinematics(one.robot), terms, others, said, train))
    return tuple(parts), any(is_coupled(one.inertia) for one in mechanisms)


def _kinematics(robot: Robot) -> Hashable:
    joints = tuple(
        (joint.name, joint.kind, joint.parent, _bytes(joint.R, joint.p, joint.axis))
        for joint in robot.joints
    )
    return joints, robot.bodies, _bytes(robot.gravity)


def _bytes(*arrays: np.ndarray) -> bytes:
    return b"".join(np.asarray(one, dtype=float).tobytes() for one in arrays)


def is_coupled(inertia: np.ndarray) -> bool:
    """Whether an effect's inertia is more than the motors' own, which Drake has by itself."""
    return bool(np.any(inertia - np.diag(np.diag(inertia))))
