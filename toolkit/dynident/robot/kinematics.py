"""Kinematics from Drake's parser: the sanitised copy in, bodies and joints out.

Drake knows the conventions of all three formats (poses relative to frames, defaults, angles in
degrees). It is shown only copies without inertias, shapes or plugins, so that nothing broken or
unresolvable reaches it; what it says about an inertia is used for MJCF geometry alone.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.inertia import from_drake
from dynident.robot.tree import Array

_KINDS = {"revolute": "revolute", "prismatic": "prismatic", "weld": "fixed"}
WORLD = "world"
# Of a message in Drake's words, which may quote the whole file.
_LONGEST = 200


@dataclass(frozen=True, eq=False)
class Connection:
    """A joint between two bodies, moving or fixed.

    Attributes
    ----------
    name, kind, parent, child : str
        Kind "revolute", "prismatic" or "fixed"; names of the bodies it connects.
    X_PF, X_CM : (4, 4) ndarray
        Pose of the joint's frame on the parent in the parent body, and of the one on the child
        in the child body; the two coincide at q = 0 (up to `X_FM` of a fixed joint, which is
        contained in X_PF).
    axis : (3,) ndarray
        In F (and M); zeros for a fixed joint.
    lower, upper, velocity : float
    """

    name: str
    kind: str
    parent: str
    child: str
    X_PF: Array
    X_CM: Array
    axis: Array
    lower: float
    upper: float
    velocity: float


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Bodies, connections and the pose of a root that nothing attaches.

    Attributes
    ----------
    bodies : tuple of str
        Without the world.
    connections : tuple of Connection
    roots : dict
        Body name -> (4, 4) pose in the world, for bodies without a parent.
    phi : dict
        Body name -> (10,) inertial parameters as Drake has them.
    """

    bodies: tuple[str, ...]
    connections: tuple[Connection, ...]
    roots: dict[str, Array]
    phi: dict[str, Array]


def parse(copy: str, suffix: str, where: str) -> Kinematics:
    """Return the kinematics of a sanitised description.

    Raises
    ------
    RobotError
        With Drake's own words, if it cannot read the copy; or naming a joint of a type that is
        not supported.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    try:
        with quiet():
            Parser(plant).AddModelsFromString(copy, suffix)
    except Exception as error:  # the bindings raise whatever the parser's libraries throw
        raise RobotError(f"cannot be understood: {_reason(error)}", where) from None
    world = plant.world_body().index()
    bodies = [plant.get_body(i) for i in _indices(plant) if i != world]
    connections = tuple(_connection(plant.get_joint(i), where) for i in plant.GetJointIndices())
    attached = {connection.child for connection in connections}
    roots: dict[str, Array] = {
        body.name(): np.array(plant.GetDefaultFloatingBaseBodyPose(body).GetAsMatrix4())
        for body in bodies
        if body.name() not in attached
    }
    phi = {body.name(): from_drake(body.default_spatial_inertia()) for body in bodies}
    return Kinematics(tuple(body.name() for body in bodies), connections, roots, phi)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Drake's log from the terminal: what is wrong is said once, in our error."""
    logger = logging.getLogger("drake")

    def drop(record: logging.LogRecord) -> bool:
        return False

    logger.addFilter(drop)
    try:
        yield
    finally:
        logger.removeFilter(drop)


def _reason(error: Exception) -> str:
    """Return the first line of the parser's words, without places in a copy nobody sees."""
    lines = str(error).strip().splitlines() or ["no reason given"]
    reason = re.sub(r"<(literal|data)-string>\S*\s*|\berror:\s*", "", lines[0]).strip()
    return reason if len(reason) <= _LONGEST else f"{reason[:_LONGEST]} ..."


def _indices(plant):
    from pydrake.multibody.tree import BodyIndex

    return [BodyIndex(i) for i in range(plant.num_bodies())]


def _connection(joint, where: str) -> Connection:
    kind = _KINDS.get(joint.type_name())
    if kind is None:
        raise UnsupportedError(
            f"is of type '{joint.type_name()}', which is not supported",
            f"{where}: joint '{joint.name()}'",
            "use revolute, prismatic and fixed joints",
        )
    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame().GetAsMatrix4()
    X_CM = joint.frame_on_child().GetFixedPoseInBodyFrame().GetAsMatrix4()
    axis = np.zeros(3)
    lower, upper, velocity = -np.inf, np.inf, np.inf
    if kind == "fixed":
        X_PF = X_PF @ joint.X_FM().GetAsMatrix4()
    else:
        axis = joint.revolute_axis() if kind == "revolute" else joint.translation_axis()
        lower = float(joint.position_lower_limits()[0])
        upper = float(joint.position_upper_limits()[0])
        velocity = float(joint.velocity_upper_limits()[0])
    return Connection(
        joint.name(),
        kind,
        joint.parent_body().name(),
        joint.child_body().name(),
        X_PF,
        X_CM,
        np.asarray(axis, dtype=float),
        lower,
        upper,
        velocity if velocity > 0.0 else np.inf,
    )
