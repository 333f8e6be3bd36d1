"""Any description in, one `Robot` out."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from dynident.errors import RobotError
from dynident.robot import kinematics, mjcf, sdf, urdf
from dynident.robot import tree_assembly as assemble
from dynident.robot.contents import Contents
from dynident.robot.robot import GRAVITY, Robot
from dynident.robot.tree import Description
from dynident.robot.xmltree import Document, parse

_READERS = {
    "robot": ("urdf", urdf.read),
    "sdf": ("sdf", sdf.read),
    "mujoco": ("mjcf", mjcf.read),
}


def take_apart(text: str, where: str) -> tuple[Document, str, Contents]:
    """Return the document, its format and its contents.

    Raises
    ------
    RobotError
        If it is not XML, not a robot description, or not a supported one.
    """
    document = parse(text, where)
    return document, *contents_of(document, where)


def contents_of(document: Document, where: str) -> tuple[str, Contents]:
    """Return the format of a document and its contents; see `take_apart`."""
    tag = document.root.tag
    if tag not in _READERS:
        raise RobotError(
            f"is not a robot description: its root element is <{tag}>",
            where,
            "URDF has <robot>, SDF <sdf>, MJCF <mujoco>",
        )
    format_, reader = _READERS[tag]
    return format_, reader(document, where)


def read(text: str, where: str, joints: Sequence[str] | None, gravity: ArrayLike | None) -> Robot:
    """Read a robot; see `Robot.from_file`."""
    _, format_, contents = take_apart(text, where)
    wanted = assemble.choose(contents, None if joints is None else tuple(joints), where)
    bodies = kinematics.parse(contents.copy, contents.suffix, where)
    tree = assemble.assemble(contents, bodies, wanted, where)
    if gravity is None:
        gravity = GRAVITY if contents.gravity is None else contents.gravity
    return Robot(
        contents.name,
        tree.joints,
        tree.links,
        gravity,  # type: ignore[arg-type]
        Description(where, format_, text),
        tree.locked,
    )
