"""What is to be checked: links and moving bodies, each with its extent and its geometry."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from dynident.consistency.rules import Array, Body
from dynident.inertia import LARGEST, to_com
from dynident.robot import Description, Link, Robot
from dynident.robot.formats.reading import broken_numbers, joint_dynamics
from dynident.robot.geometry import LinkGeometry, link_geometry
from dynident.robot.hull import Hull

_GRAVITY = 9.81


@dataclass(frozen=True, eq=False, kw_only=True)
class CheckedBody:
    """One thing to check.

    Attributes
    ----------
    body : Body
    kind : str
        "link" or "moving body".
    carrier : str
        Of a link: the moving body that it belongs to; empty where it is fixed to the world.
    links : tuple of str
        Of a moving body: the links that it is made of.
    source : str
        Where its parameters come from, as in `Link`.
    not_checked : tuple of str
        Geometry that was not read.
    """

    body: Body
    kind: str
    carrier: str
    links: tuple[str, ...]
    source: str
    not_checked: tuple[str, ...]


@dataclass(frozen=True)
class Scale:
    """What is typical of a robot: the mass of a link, kg, and its extent, m."""

    mass: float
    length: float

    def of(self, unit: str) -> float:
        """Return the size of a quantity in that unit, made of mass, length and gravity."""
        time = float(np.sqrt(self.length / _GRAVITY))
        units = {"kg": self.mass, "m": self.length, "s": time, "rad": 1.0}
        units["N"] = self.mass * _GRAVITY
        size, above = 1.0, True
        for part in unit.replace("/", " / ").split():
            if part == "/":
                above = False
                continue
            name, _, power = part.partition("^")
            size *= units.get(name, 1.0) ** (float(power or 1.0) * (1.0 if above else -1.0))
        return size


def of_links(
    links: tuple[Link, ...],
    description: Description | None,
    robot: Robot | None,
    rotors: frozenset[str] = frozenset(),
) -> tuple[tuple[CheckedBody, ...], Scale]:
    """Return every link that has inertial parameters, then every moving body of several links.

    Parameters
    ----------
    links : tuple of Link
    description : Description or None
        For the geometry.
    robot : Robot or None
        The tree that carries the links, if it is known.
    rotors : joints with a rotor inertia of their own, which can do without mass.

    Returns
    -------
    The bodies, and what is typical of the robot's links.
    """
    geometry: dict[str, LinkGeometry] = {}
    broken: dict[str, tuple[str, ...]] = {}
    if description is not None:
        geometry, broken = link_geometry(description), broken_numbers(description)
        rotors |= {
            one.joint
            for one in joint_dynamics(description)
            if one.quantity == "rotor inertia" and 0.0 < one.value < np.inf
        }
    reaches = _reaches(robot) if robot is not None else {}
    hulls = {name: Hull(one.points) for name, one in geometry.items() if len(one.points)}
    known = [hull.extent for hull in hulls.values()] or [x for x in reaches.values() if x > 0.0]
    masses = [float(link.phi[0]) for link in links if 0.0 < link.phi[0] < LARGEST]
    scale = Scale(
        float(np.quantile(masses, 0.5, method="lower")) if masses else 1.0,
        float(np.median(known)) if known else 0.0,
    )
    onward = _onward(robot) if robot is not None else {}
    subjects = []
    for link in links:
        if link.source == "absent":
            continue
        shapes = geometry.get(link.name, LinkGeometry())
        hull = hulls.get(link.name)
        length, length_from = _length(
            link.phi, hull, reaches.get(link.joint, 0.0), scale.length, not shapes.not_read
        )
        body = Body(
            name=link.name,
            phi=link.phi,
            length=length,
            length_from=length_from,
            typical_mass=scale.mass,
            hull=hull,
            whole=not shapes.not_read,
            broken_numbers=broken.get(link.name, ()) if link.source != "set" else (),
            onward=onward.get(link.name),
        )
        carrier = robot.bodies[link.joint] if robot is not None and link.joint >= 0 else ""
        subjects.append(
            CheckedBody(
                body=body,
                kind="link",
                carrier=carrier,
                links=(),
                source=link.source,
                not_checked=shapes.not_read,
            )
        )
    if robot is not None:
        subjects += _moving(robot, reaches, scale, rotors, subjects)
    # Lengths are made of the extents that are known, here of none.
    if scale.length == 0.0:
        scale = replace(scale, length=float(np.median([s.body.length for s in subjects] or [1.0])))
    return tuple(subjects), scale


def _length(
    phi: Array, hull: Hull | None, reach: float, typical: float, whole: bool
) -> tuple[float, str]:
    """Return the extent of a body and what it was taken from."""
    if hull is not None and hull.extent > 0.0 and whole:
        return hull.extent, "geometry"
    reach = max(reach, hull.extent if hull is not None else 0.0)
    if reach > 0.0:
        return (reach, "joints") if reach >= typical else (typical, "robot")
    if typical > 0.0:
        return typical, "robot"
    # Nothing is left but the inertia itself: the extent of a box that has it.
    if np.all(np.abs(phi) < LARGEST) and phi[0] != 0.0:
        properties = to_com(phi)
        size = float(np.sqrt(6.0 * abs(np.trace(properties.inertia_com) / phi[0])))
        size = max(size, 2.0 * float(np.linalg.norm(properties.com)))
        if np.isfinite(size) and size > 0.0:
            return size, "inertia"
    return 1.0, "inertia"


def _reaches(robot: Robot) -> dict[int, float]:
    """Return by joint (-1: the world) how far the joints on its moving body are from its origin."""
    reaches: dict[int, float] = {}
    for joint in robot.joints:
        far = float(np.linalg.norm(joint.p))
        reaches[joint.parent] = max(reaches.get(joint.parent, 0.0), far)
    for link in robot.links:
        if link.joint >= 0:
            far = float(np.linalg.norm(link.p))
            reaches[link.joint] = max(reaches.get(link.joint, 0.0), far)
    # From the world's origin to the first joint is no link.
    reaches.pop(-1, None)
    return reaches


def _onward(robot: Robot) -> dict[str, Array]:
    """Return where the next joint is on each link that is a moving body by itself."""
    of_body, ahead = _by_body(robot), defaultdict(list)
    for joint in robot.joints:
        ahead[joint.parent].append(joint.p)
    return {
        link.name: max(
            (link.R.T @ (p - link.p) for p in ahead[number]),
            key=lambda p: float(np.linalg.norm(p)),
        )
        for number, (link, *others) in of_body.items()
        if not others and ahead[number] and number >= 0
    }


def _by_body(robot: Robot) -> dict[int, list[Link]]:
    """Return the links of each moving body, by its joint's number; -1 is the world."""
    found: dict[int, list[Link]] = defaultdict(list)
    for link in robot.links:
        found[link.joint].append(link)
    return found


def _moving(
    robot: Robot,
    reaches: dict[int, float],
    scale: Scale,
    rotors: frozenset[str],
    links: list[CheckedBody],
) -> list[CheckedBody]:
    """Return the moving bodies of several links, and those that nothing gives mass."""
    theta = robot.theta.reshape(-1, 10)
    extents: dict[str, float] = {}
    for one in links:
        extents[one.carrier] = max(extents.get(one.carrier, 0.0), one.body.length)
    of_body, carries = _by_body(robot), _carries_something(robot)
    found = []
    for number, (name, joint, phi) in enumerate(
        zip(robot.bodies, robot.joints, theta, strict=True)
    ):
        weightless = joint.name not in rotors and not carries[number]
        parts = tuple(
            link.name for link in of_body[number] if link.source != "absent" and np.any(link.phi)
        )
        if len(parts) < 2 and not weightless:
            continue
        length, length_from = _length(
            phi,
            None,
            max(reaches.get(number, 0.0), extents.get(name, 0.0)),
            scale.length,
            True,
        )
        body = Body(
            name=name,
            phi=phi,
            length=length,
            length_from=length_from,
            typical_mass=scale.mass,
            weightless=weightless,
        )
        found.append(
            CheckedBody(
                body=body,
                kind="moving body",
                carrier=name,
                links=parts,
                source="sum",
                not_checked=(),
            )
        )
    return found


def _carries_something(robot: Robot) -> list[bool]:
    """Return whether each joint has a body with any parameter on its own or beyond it."""
    found = [False] * robot.n
    for number in np.flatnonzero(robot.theta.reshape(-1, 10).any(axis=1)):
        at = int(number)
        while at >= 0 and not found[at]:
            found[at] = True
            at = robot.joints[at].parent
    return found
