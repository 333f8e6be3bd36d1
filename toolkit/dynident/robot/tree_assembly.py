"""From bodies and connections to the one tree that everything else is built from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.robot.contents import Contents, Inertial, absent
from dynident.robot.kinematics import WORLD, Connection, Kinematics
from dynident.robot.tree import Array, Joint, Link
from dynident.robot.xmltree import closest


@dataclass(frozen=True, eq=False)
class Tree:
    """Joints in the order asked for, links in the order of the description, locked joints."""

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    locked: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a body is: the joint that carries it and its pose in that joint's frame."""

    joint: int
    X: Array


def choose(contents: Contents, wanted: tuple[str, ...] | None, where: str) -> tuple[str, ...]:
    """Return the joints to keep, in order; all moving ones by default.

    Raises
    ------
    RobotError
        Naming a joint that does not exist or is given twice, or if none is left.
    """
    if not contents.joints:
        raise UnsupportedError(
            "has no revolute or prismatic joint", where, "there is nothing to identify"
        )
    if wanted is None:
        return contents.joints
    if not wanted:
        raise RobotError("no joints are asked for", where, closest("", contents.joints))
    for index, name in enumerate(wanted):
        if name not in contents.joints:
            raise RobotError(f"has no moving joint '{name}'", where, closest(name, contents.joints))
        if name in wanted[:index]:
            raise RobotError(f"joint '{name}' is asked for twice", where, "name each joint once")
    return tuple(wanted)


def assemble(
    contents: Contents, kinematics: Kinematics, wanted: tuple[str, ...], where: str
) -> Tree:
    """Walk the tree from the world; joints that are not wanted are locked at zero."""
    below: dict[str, list[Connection]] = {}
    parented: set[str] = set()
    for connection in kinematics.connections:
        if connection.child in parented:
            raise UnsupportedError(
                f"has a second parent, by joint '{connection.name}': "
                "closed chains are not supported",
                f"{where}: link '{connection.child}'",
                "cut the loop by removing one of the joints",
            )
        parented.add(connection.child)
        below.setdefault(connection.parent, []).append(connection)
    roots = kinematics.roots
    attached = WORLD in below
    if len(roots) + attached > 1:
        loose = ", ".join(roots)
        raise UnsupportedError(
            f"has several roots: nothing attaches {loose}" + (" to the world" if attached else ""),
            where,
            "join them by a fixed joint, or put each robot in its own file",
        )
    places = {WORLD: _Place(-1, np.eye(4))}
    places.update({name: _Place(-1, X) for name, X in roots.items()})
    joints: dict[int, Joint] = {}
    waiting = list(places)
    while waiting:
        parent = waiting.pop()
        for connection in below.get(parent, ()):
            place = places[parent]
            X = place.X @ connection.X_PF @ _inverse(connection.X_CM)
            if connection.name in wanted:
                index = wanted.index(connection.name)
                joints[index] = _joint(connection, place.joint, X, contents)
                # The child's frame in the joint frame: same axes, shifted by the joint's offset.
                X = np.eye(4)
                X[:3, 3] = -connection.X_CM[:3, 3]
                place = _Place(index, X)
            else:
                place = _Place(place.joint, X)
            places[connection.child] = place
            waiting.append(connection.child)
    for name in kinematics.bodies:
        if name not in places:
            raise UnsupportedError(
                "is its own ancestor: closed chains are not supported",
                f"{where}: link '{name}'",
                "cut the loop by removing one of the joints",
            )
    return Tree(
        tuple(joints[index] for index in range(len(wanted))),
        tuple(_links(contents, kinematics, places)),
        tuple(name for name in contents.joints if name not in wanted),
    )


def _joint(connection: Connection, parent: int, X: Array, contents: Contents) -> Joint:
    shift = np.eye(4)
    shift[:3, 3] = connection.X_CM[:3, 3]
    X = X @ shift
    return Joint(
        connection.name,
        connection.kind,
        parent,
        X[:3, :3],
        X[:3, 3],
        connection.X_CM[:3, :3] @ connection.axis,
        connection.lower,
        connection.upper,
        connection.velocity,
        contents.efforts.get(connection.name, np.inf),
        connection.child,
    )


def _links(contents: Contents, kinematics: Kinematics, places: dict[str, _Place]) -> list[Link]:
    links = []
    for name in (*contents.inertials, *kinematics.bodies):
        if any(link.name == name for link in links):
            continue
        place = places[name]
        inertial = contents.inertials.get(name, absent())
        if inertial.source == "geometry":
            inertial = Inertial(kinematics.phi[name], "geometry")
        X = place.X
        links.append(Link(name, place.joint, X[:3, :3], X[:3, 3], inertial.phi, inertial.source))
    return links


def _inverse(X: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = X[:3, :3].T
    inverse[:3, 3] = -X[:3, :3].T @ X[:3, 3]
    return inverse
