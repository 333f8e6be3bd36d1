"""Write a robot back: its own description with only the changed inertias replaced."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dynident import files
from dynident.errors import RobotError
from dynident.inertia import MassProperties, to_com
from dynident.robot.formats.reading import open_description
from dynident.robot.formats.xmltree import Document, Element
from dynident.robot.robot import Robot
from dynident.robot.tree import Link

# What a reloaded body may differ by, relative to its largest parameter.
_ROUND_TRIP = 1e-11


def write(robot: Robot, path: str | Path) -> Path:
    """Write the description of a robot with its current inertial parameters.

    Comments, geometry and formatting stay as they are; only the inertial elements of links whose
    parameters changed are replaced (or added, where there was none). Reloading the file gives
    the same inverse dynamics. Gravity is not written: it is no property of the robot.

    Parameters
    ----------
    robot : Robot
        Read from a description (URDF, SDF or MJCF), and perhaps changed since.
    path : path
        In the same format as the description.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    RobotError
        If the robot was not read from a description, or a link's parameters cannot be written:
        not finite, or a first moment without mass.
    FileError
        If the file cannot be written.
    """
    text = patched(robot)
    return files.write_text(path, text)


def patched(robot: Robot) -> str:
    """Return the text that `write` writes.

    Raises
    ------
    RobotError
        As `write` does.
    """
    if robot.description is None:
        raise RobotError(
            "was not read from a description, so there is nothing to patch",
            robot.name,
            "start from Robot.from_file",
        )
    text, where = robot.description.text, robot.description.path
    opened = open_description(text, where)
    document = opened.document
    given = {link.name: link for link in Robot.from_text(text, where, robot.names).links}
    patches = []
    for link in robot.links:
        old = given.get(link.name)
        if old is not None and np.array_equal(link.phi, old.phi, equal_nan=True):
            continue
        place = f"{where}: link '{link.name}'"
        element = opened.contents.elements.get(link.name)
        if element is None:
            raise RobotError(
                "stands for no element of the description, so its inertia cannot be written",
                place,
                "give each joint a link of its own",
            )
        lines = opened.format.inertial_lines(_writable(link, place), document.root, place)
        patches.append(_patch(document, element, lines))
    data = document.data
    for begin, end, new in sorted(patches, reverse=True):
        data = data[:begin] + new + data[end:]
    result = data.decode("utf-8")
    if patches:
        _check_round_trip(robot, result, where)
    return result


def _writable(link: Link, where: str) -> MassProperties:
    if not np.all(np.isfinite(link.phi)):
        raise RobotError("has inertial parameters that are not finite", where)
    if link.phi[0] == 0.0 and np.any(link.phi[1:4]):
        raise RobotError(
            "has a first moment but no mass, which a description cannot state",
            where,
            "choose standard parameters with mass that have the same base parameters "
            "(BaseParameters.lift with the description as prior)",
        )
    return to_com(link.phi)


def _check_round_trip(robot: Robot, text: str, where: str) -> None:
    reloaded = Robot.from_text(text, where, robot.names)
    before, after = robot.theta.reshape(-1, 10), reloaded.theta.reshape(-1, 10)
    for body, wanted, got in zip(robot.bodies, before, after, strict=True):
        if not np.all(np.isfinite(wanted)):
            continue
        if np.max(np.abs(wanted - got)) > _ROUND_TRIP * np.max(np.abs(wanted)):
            raise RobotError(
                "has too little mass for its first moment: its centre of mass is so far away that "
                "a description cannot state it with all digits",
                f"{where}: link '{body}'",
                "choose standard parameters near the description (BaseParameters.lift)",
            )


def _patch(document: Document, link: Element, lines: list[str]) -> tuple[int, int, bytes]:
    """Return (begin, end, replacement) in the bytes of the document."""
    data = document.data
    newline = "\r\n" if b"\r\n" in data else "\n"
    inertial = link.find("inertial")
    if inertial is not None:
        begin, _, end = document.spans[id(inertial)]
        indent = _indent(data, begin)
        return begin, end, _join(lines, indent, newline)
    begin, inner, end = document.spans[id(link)]
    outer = _indent(data, begin)
    opened = newline + outer + "  "
    body = opened.encode() + _join(lines, outer + "  ", newline)
    if inner == end:  # <link name="x"/> has to be opened
        tag = data[begin:inner].decode("utf-8")[: -len("/>")].rstrip()
        closing = f"{newline}{outer}</{link.tag}>".encode()
        return begin, end, f"{tag}>".encode() + body + closing
    return inner, inner, body


def _indent(data: bytes, position: int) -> str:
    """Return the blanks before a tag if nothing else stands before it on its line."""
    before = data[data.rfind(b"\n", 0, position) + 1 : position].decode("utf-8")
    return before if not before.strip() else ""


def _join(lines: list[str], indent: str, newline: str) -> bytes:
    return (newline + indent).join(lines).encode("utf-8")
