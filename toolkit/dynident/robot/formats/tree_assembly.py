"""The tree of joints and links, which Drake's parser makes out of a sanitised copy.

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
from typing import Any

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.inertia import from_drake
from dynident.robot.formats.elements import absent, refuse_closed_chains
from dynident.robot.formats.format import Contents
from dynident.robot.formats.xmltree import Element, closest, to_text
from dynident.robot.tree import Joint, Link

WORLD = "world"
_KINDS = ("revolute", "prismatic", "weld")
# Of a message in Drake's words, which may quote the whole file.
_LONGEST = 200


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


def drake_plant(copy: Element, file_type: str) -> Any:
    """Return a plant, not finalized, that holds a copy; raises whatever Drake's parser throws."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    with quiet():
        Parser(plant).AddModelsFromString(to_text(copy), file_type)
    return plant


def understood(contents: Contents, file_type: str, where: str) -> Any:
    """Return a plant that holds the sanitised copy of a description.

    Parameters
    ----------
    contents : Contents
    file_type : str
        By which Drake's parser knows the format.
    where : str
        The file, for messages.

    Raises
    ------
    RobotError
        With Drake's own words, if it cannot read the copy.
    """
    try:
        return drake_plant(contents.copy, file_type)
    except Exception as error:  # the bindings raise whatever the parser's libraries throw
        lines = str(error).strip().splitlines() or ["no reason given"]
        # Without places in a copy that nobody sees.
        reason = re.sub(r"<(literal|data)-string>\S*\s*|\berror:\s*", "", lines[0]).strip()
        reason = reason if len(reason) <= _LONGEST else f"{reason[:_LONGEST]} ..."
        raise RobotError(f"cannot be understood: {reason}", where) from None


def drake_bodies(plant: Any) -> dict[str, Any]:
    """Return the bodies of a plant by their names, without the world."""
    from pydrake.multibody.tree import BodyIndex

    bodies = (plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies()))
    return {body.name(): body for body in bodies}


def with_geometry(contents: Contents, bodies: dict[str, Any]) -> Iterator[tuple[str, Any, str]]:
    """Iterate over the name, phi and source of each link, inertias from shapes put in."""
    for name in dict.fromkeys((*contents.inertials, *bodies)):
        inertial = contents.inertials.get(name, absent())
        if inertial.source == "geometry":
            phi = from_drake(bodies[name].default_spatial_inertia())
            yield name, phi, "geometry"
        else:
            yield name, inertial.phi, inertial.source


@dataclass(frozen=True, eq=False)
class Tree:
    """Joints in the order asked for, links in the order of the description, locked joints."""

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    locked: tuple[str, ...]


def assemble(
    contents: Contents, file_type: str, wanted: tuple[str, ...] | None, where: str
) -> Tree:
    """Walk the tree from the world; joints that are not wanted are locked at zero.

    Parameters
    ----------
    contents : Contents
    file_type : str
        By which Drake's parser knows the format.
    wanted : tuple of str, optional
        Joints to keep, in order; default: all moving ones, in the order of the description.
    where : str
        The file, for messages.

    Returns
    -------
    The links and the joints that move, those that are wanted in their order.

    Raises
    ------
    RobotError
        Naming a joint that is asked for and does not exist, or is of a type that is not
        supported; if the joints form no tree; or if Drake cannot read the copy.
    """
    from pydrake.math import RigidTransform

    wanted = _choose(contents, wanted, where)
    plant = understood(contents, file_type, where)
    bodies = drake_bodies(plant)
    below, roots = _connections(plant, bodies, where)
    # Where a body is: the joint that carries it, and its pose in that joint's frame.
    places: dict[str, tuple[int, Any]] = {WORLD: (-1, RigidTransform())}
    places |= {n: (-1, plant.GetDefaultFloatingBaseBodyPose(bodies[n])) for n in roots}
    joints: dict[int, Joint] = {}
    waiting = list(places)
    while waiting:
        parent = waiting.pop()
        for one in below.get(parent, ()):
            number, X = places[parent]
            X_PF = one.frame_on_parent().GetFixedPoseInBodyFrame()
            X_CM = one.frame_on_child().GetFixedPoseInBodyFrame()
            if one.type_name() == "weld":
                X_PF = X_PF @ one.X_FM()
            X = X @ X_PF @ X_CM.inverse()
            if one.name() in wanted:
                # The joint frame: axes of the child's frame, origin on the axis.
                offset = RigidTransform(X_CM.translation())
                index = wanted.index(one.name())
                effort = contents.efforts.get(one.name(), np.inf)
                continuous = one.name() in contents.continuous
                joints[index] = _joint(one, number, X @ offset, effort, continuous=continuous)
                number, X = index, offset.inverse()
            child = one.child_body().name()
            places[child] = (number, X)
            waiting.append(child)
    links = []
    for name, phi, source in with_geometry(contents, bodies):
        number, X = places[name]
        R, p = X.rotation().matrix(), X.translation()
        links.append(Link(name=name, joint=number, R=R, p=p, phi=phi, source=source))
    locked = tuple(name for name in contents.joints if name not in wanted)
    return Tree(tuple(joints[index] for index in range(len(wanted))), tuple(links), locked)


def _connections(
    plant: Any, bodies: dict[str, Any], where: str
) -> tuple[dict[str, list[Any]], list[str]]:
    """Return Drake's joints by the name of their parent body, and the bodies without a parent."""
    below: dict[str, list[Any]] = {}
    ends = []
    for one in (plant.get_joint(i) for i in plant.GetJointIndices()):
        if one.type_name() not in _KINDS:
            raise UnsupportedError(
                f"is of type '{one.type_name()}', which is not supported",
                f"{where}: joint '{one.name()}'",
                "use revolute, prismatic and fixed joints",
            )
        parent, child = one.parent_body().name(), one.child_body().name()
        below.setdefault(parent, []).append(one)
        ends.append((one.name(), parent, child))
    parents = refuse_closed_chains(ends, where)
    roots = [name for name in bodies if name not in parents]
    if len(roots) + (WORLD in below) > 1:
        loose = ", ".join(roots) + (" to the world" if WORLD in below else "")
        raise UnsupportedError(
            f"has several roots: nothing attaches {loose}",
            where,
            "join them by a fixed joint, or put each robot in its own file",
        )
    return below, roots


def _choose(contents: Contents, wanted: tuple[str, ...] | None, where: str) -> tuple[str, ...]:
    """Return the joints to keep, in order."""
    if not contents.joints:
        raise UnsupportedError(
            "has no revolute or prismatic joint", where, "there is nothing to identify"
        )
    if wanted is None:
        _refuse_mimics(contents, contents.joints, where)
        return contents.joints
    if not wanted:
        raise RobotError("no joints are asked for", where, closest("", contents.joints))
    for index, name in enumerate(wanted):
        if name not in contents.joints:
            raise RobotError(f"has no moving joint '{name}'", where, closest(name, contents.joints))
        if name in wanted[:index]:
            raise RobotError(f"joint '{name}' is asked for twice", where, "name each joint once")
    _refuse_mimics(contents, wanted, where)
    return wanted


def _refuse_mimics(contents: Contents, wanted: tuple[str, ...], where: str) -> None:
    """Refuse a joint that moves as another one; where neither is wanted, both stand still."""
    for name, leader in contents.mimics.items():
        if name in wanted or leader in wanted:
            raise UnsupportedError(
                "mimics another joint, which is not supported",
                f"{where}: joint '{name}'",
                "name the joints that were recorded, without these two (--joints, or joints = "
                "[...] in the study), or remove <mimic> to make it independent",
            )


def _joint(one: Any, parent: int, X: Any, effort: float, *, continuous: bool) -> Joint:
    """Return a joint of Drake's, whose frame has the pose X in that of the parent's joint."""
    kind = one.type_name()
    axis = one.revolute_axis() if kind == "revolute" else one.translation_axis()
    velocity = float(one.velocity_upper_limits()[0])
    return Joint(
        name=one.name(),
        kind=kind,
        parent=parent,
        R=X.rotation().matrix(),
        p=X.translation(),
        axis=one.frame_on_child().GetFixedPoseInBodyFrame().rotation().matrix() @ axis,
        lower=float(one.position_lower_limits()[0]),
        upper=float(one.position_upper_limits()[0]),
        velocity=velocity if velocity > 0.0 else np.inf,
        effort=effort,
        child=one.child_body().name(),
        continuous=continuous,
    )
