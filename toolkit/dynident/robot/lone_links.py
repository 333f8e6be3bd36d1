"""The links of a description one by one, where its tree of joints is not supported."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy

import numpy as np

from dynident.robot import kinematics
from dynident.robot.contents import Inertial
from dynident.robot.reading import contents_of
from dynident.robot.tree import Description, Link
from dynident.robot.xmltree import Document, Element, parse


def lone_links(text: str, where: str) -> tuple[Description, tuple[Link, ...]]:
    """Return the links of a robot description, as if no joint held them together.

    Closed chains, mimic joints and floating bases change nothing in what a link's own inertial
    element says. Each link is placed at the world's origin.

    Raises
    ------
    RobotError
        If it is no robot description, or its links cannot be read either.
    """
    document = parse(text, where)
    root = deepcopy(document.root)
    strip = _STRIPPERS.get(root.tag)
    if strip is not None:
        strip(root)
    format_, contents = contents_of(Document(root, b"", {}), where)
    inertials = dict(contents.inertials)
    if any(one.source == "geometry" for one in inertials.values()):
        bodies = kinematics.parse(contents.copy, contents.suffix, where)
        for name, one in inertials.items():
            if one.source == "geometry":
                inertials[name] = Inertial(bodies.phi[name], "geometry")
    links = tuple(
        Link(name, -1, np.eye(3), np.zeros(3), one.phi, one.source)
        for name, one in inertials.items()
    )
    return Description(where, format_, text), links


def _strip_urdf(root: Element) -> None:
    """Weld every link to the first one: a URDF has one root."""
    for joint in root.findall("joint"):
        root.remove(joint)
    names = [link.get("name") or "" for link in root.findall("link")]
    for name in names[1:]:
        joint = Element("joint", {"name": f"to {name}", "type": "fixed"})
        joint.append(Element("parent", {"link": names[0]}))
        joint.append(Element("child", {"link": name}))
        root.append(joint)


def _strip_sdf(root: Element) -> None:
    for model in root.iter("model"):
        for tag in ("joint", "static", "frame", "pose"):
            for element in model.findall(tag):
                model.remove(element)
        for link in model.findall("link"):
            for tag in ("pose", "gravity"):
                for element in link.findall(tag):
                    link.remove(element)


def _strip_mjcf(root: Element) -> None:
    for section in root.findall("equality"):
        root.remove(section)
    for body in root.iter("body"):
        for tag in ("joint", "freejoint"):
            for element in body.findall(tag):
                body.remove(element)
        for key in ("mocap", "gravcomp"):
            body.attrib.pop(key, None)


_STRIPPERS: dict[str, Callable[[Element], None]] = {
    "robot": _strip_urdf,
    "sdf": _strip_sdf,
    "mujoco": _strip_mjcf,
}
