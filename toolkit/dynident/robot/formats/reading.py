"""Any description in: its tree, its links one by one, its shapes, its joints' dynamics."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from dynident.errors import RobotError
from dynident.robot.formats.format import Contents, Format, JointDynamics, Shape
from dynident.robot.formats.mjcf import MJCF
from dynident.robot.formats.sdf import SDF
from dynident.robot.formats.tree_assembly import (
    Tree,
    assemble,
    drake_bodies,
    understood,
    with_geometry,
)
from dynident.robot.formats.urdf import URDF
from dynident.robot.formats.xmltree import Document, Element, is_number, parse
from dynident.robot.tree import Description, Link

FORMATS = {one.name: one for one in (URDF, SDF, MJCF)}
"""The formats that are read and written, by the name that `Description.format` holds."""
MOST_LINKS = 4096
"""Links of a robot: far more than any has, few enough to be read in seconds."""


@dataclass(frozen=True, eq=False)
class Opened:
    """A description, parsed: its document, format and contents."""

    document: Document
    format: Format
    contents: Contents


def open_description(text: str, where: str) -> Opened:
    """Return a description, parsed.

    Raises
    ------
    RobotError
        If it is not XML, not a robot description, or not a supported one.
    """
    document = parse(text, where)
    format_ = _format_of(document.root, where)
    return Opened(document, format_, _contents(format_, document.root, where))


def _contents(format_: Format, root: Element, where: str) -> Contents:
    """What a description holds, if it is not of too many links: counted before any is read."""
    count = sum(1 for _ in root.iter(format_.link))
    if count > MOST_LINKS:
        what = f"has {count} links, and {MOST_LINKS} is the limit"
        raise RobotError(what, where, "leave out links that do not move, or split the robot")
    return format_.read(root, where)


def _format_of(root: Element, where: str) -> Format:
    for one in FORMATS.values():
        if root.tag == one.root:
            return one
    raise RobotError(
        f"is not a robot description: its root element is <{root.tag}>",
        where,
        "URDF has <robot>, SDF <sdf>, MJCF <mujoco>",
    )


def read_tree(text: str, where: str, joints: tuple[str, ...] | None) -> tuple[Opened, Tree]:
    """Return a description with its tree of joints and links.

    Parameters
    ----------
    text : str
    where : str
        The file, for messages.
    joints : tuple of str, optional
        Joints to keep, in order; default: all moving ones.

    Returns
    -------
    The parsed description, and the tree of the joints that are kept.

    Raises
    ------
    RobotError
        If it is no robot description, is broken, or has what is not supported.
    """
    opened = open_description(text, where)
    return opened, assemble(opened.contents, opened.format.drake, joints, where)


def lone_links(text: str, where: str) -> tuple[Description, tuple[Link, ...]]:
    """Return the links of a robot description, as if no joint held them together.

    Closed chains, mimic joints and floating bases change nothing in what a link's own inertial
    element says. Each link is placed at the world's origin.

    Raises
    ------
    RobotError
        If it is no robot description, or its links cannot be read either.
    """
    root = deepcopy(parse(text, where).root)
    format_ = _format_of(root, where)
    format_.detach(root)
    contents = _contents(format_, root, where)
    bodies = {}
    if any(one.source == "geometry" for one in contents.inertials.values()):
        bodies = drake_bodies(understood(contents, format_.drake, where))
    links = tuple(
        Link(name=name, joint=-1, R=np.eye(3), p=np.zeros(3), phi=phi, source=source)
        for name, phi, source in with_geometry(contents, bodies)
        if name in contents.inertials
    )
    return Description(where, format_.name, text), links


def _parsed(description: Description) -> tuple[Format, Element]:
    return FORMATS[description.format], parse(description.text, description.path).root


def shapes(description: Description) -> Iterator[Shape]:
    """Iterate over the shapes of a description; RobotError if it is no XML."""
    format_, root = _parsed(description)
    return format_.shapes(root, description.path)


def joint_dynamics(description: Description) -> tuple[JointDynamics, ...]:
    """Return what a description states of friction, damping and rotor inertia, in its order.

    `Robot` does not hold these: in a model they are effects. They are read for a check.

    URDF: `<dynamics damping friction>` and `drake:rotor_inertia`; SDF: `<axis><dynamics>` and
    `drake:rotor_inertia`; MJCF: damping, frictionloss and armature, default classes applied.

    Raises
    ------
    RobotError
        If a value is not a number.
    """
    format_, root = _parsed(description)
    return tuple(format_.joint_dynamics(root, description.path))


def broken_numbers(description: Description) -> dict[str, tuple[str, ...]]:
    """Return, by link, the stated inertial numbers that are not finite, as in "inertia ixx = nan".

    A NaN in one number shows in all that depend on it, once they are taken about another point:
    the file itself knows which one it was.
    """
    format_, root = _parsed(description)
    found: dict[str, tuple[str, ...]] = {}
    for number, link in enumerate(root.iter(format_.link), start=1):
        names = [name for inertial in link.findall("inertial") for name in _broken(inertial)]
        if names:
            found[link.get("name") or f"body_{number}"] = tuple(names)
    return found


def _broken(inertial: Element) -> Iterator[str]:
    for element in inertial.iter():
        tag = "" if element.tag == "inertial" else element.tag
        for key, text in (*element.attrib.items(), ("", element.text if tag else "")):
            name = " ".join(filter(None, (tag, "" if tag and key == "value" else key)))
            yield from (f"{name} = {word}" for word in (text or "").split() if _is_broken(word))


def _is_broken(word: str) -> bool:
    return is_number(word) and not np.isfinite(float(word))
