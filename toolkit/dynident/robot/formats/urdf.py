"""URDF, read as it is written: no default inertia, and any limit or effort may be absent.

Drake's and Pinocchio's parsers replace a broken inertia, and demand meshes that are not there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.inertia import MassProperties
from dynident.robot.formats.elements import (
    MOVING,
    ShapeWords,
    absent,
    bounded,
    continuous_of,
    digits,
    from_rpy,
    keep,
    limits,
    mimics_of,
    named,
    readable_shapes,
    refuse_closed_chains,
    required,
    rotors,
    stated,
    stated_dynamics,
    symmetric,
)
from dynident.robot.formats.format import Contents, Format, Inertial, JointDynamics, Shape
from dynident.robot.formats.xmltree import Element, finite, only, reals

_REMEDIES = {
    "floating": "fix the base: remove the floating joint, or make it fixed",
    "planar": "write it as two prismatic joints and a revolute one",
    "ball": "write it as three revolute joints",
    "universal": "write it as two revolute joints",
    "screw": "screw joints are not supported; write it as a revolute or a prismatic joint",
}
_SHAPE_WORDS = ShapeWords(Element.get, mesh="filename", ellipsoid={"a": 1, "b": 1, "c": 1})


def _read(root: Element, where: str) -> Contents:
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            raise RobotError(
                f"is a xacro file (it has <{element.tag}>)",
                where,
                "expand it first: xacro FILE.xacro > FILE.urdf",
            )
    name = root.get("name") or "robot"
    copy = Element("robot", {"name": name})
    links = named(root, "link", where)
    if not links:
        raise RobotError("has no links", where, "is it the whole description? its links are <link>")
    inertials = {n: _inertial(link, f"{where}: link '{n}'") for n, link in links.items()}
    copy.extend(Element("link", {"name": link}) for link in links)
    joints = named(root, "joint", where)
    edges, efforts = [], {}
    for joint_name, joint in joints.items():
        at = f"{where}: joint '{joint_name}'"
        clean = _joint(joint, at)
        copy.append(clean)
        parent, child = (_end(joint, tag, links, at) for tag in ("parent", "child"))
        clean.extend((parent, child))
        edges.append((joint_name, parent.attrib["link"], child.attrib["link"]))
        effort = _limit(joint, clean, at)
        if effort is not None:
            efforts[joint_name] = effort
    parents = refuse_closed_chains(edges, where)
    _require_one_root(links, parents, where)
    return Contents(
        name=name,
        copy=copy,
        inertials=inertials,
        elements=links,
        joints=tuple(n for n, joint in joints.items() if joint.get("type") in MOVING),
        efforts=efforts,
        mimics=mimics_of(joints, "."),
        continuous=continuous_of(joints),
    )


def _inertial(link: Element, where: str) -> Inertial:
    inertial = only(link, "inertial", where)
    if inertial is None:
        return absent()
    xyz, R = np.zeros(3), np.eye(3)
    origin = only(inertial, "origin", where)
    if origin is not None:
        xyz = reals(origin.get("xyz", "0 0 0"), 3, "inertial origin xyz", where)
        R = from_rpy(reals(origin.get("rpy", "0 0 0"), 3, "inertial origin rpy", where))
    mass, tensor = required(inertial, where, '<mass value="..."/>')

    def number(element: Element, name: str) -> float:
        if name not in element.attrib:
            # The moments must be stated; products of inertia may be left out where they are zero.
            if name in ("ixy", "ixz", "iyz"):
                return 0.0
            raise RobotError(f"{element.tag} has no '{name}'", where)
        return float(reals(element.get(name), 1, f"{element.tag} {name}", where)[0])

    inertia = symmetric(lambda name: number(tensor, name))
    return stated(number(mass, "value"), xyz, R, inertia)


def _joint(joint: Element, where: str) -> Element:
    """Return the sanitised copy of a joint, without its ends and limits."""
    kind = joint.get("type", "")
    if kind in _REMEDIES:
        what = f"is of type '{kind}', which is not supported"
        raise UnsupportedError(what, where, _REMEDIES[kind])
    if kind not in (*MOVING, "fixed"):
        remedy = f"use one of {', '.join((*MOVING, 'fixed'))}"
        raise RobotError(f"is of unknown type '{kind}'", where, remedy)
    clean = keep(joint, ("name", "type"))
    origin = only(joint, "origin", where)
    if origin is not None:
        for key in ("xyz", "rpy"):
            finite(origin.get(key, "0 0 0"), 3, f"origin {key}", where)
        clean.append(keep(origin, ("xyz", "rpy")))
    axis = only(joint, "axis", where) if kind != "fixed" else None
    if axis is not None:
        if np.linalg.norm(finite(axis.get("xyz"), 3, "axis xyz", where)) < 1e-9:
            raise RobotError("has a zero axis", where, 'state its direction, as in xyz="0 0 1"')
        clean.append(keep(axis, ("xyz",)))
    return clean


def _end(joint: Element, tag: str, links: dict[str, Element], where: str) -> Element:
    end = only(joint, tag, where)
    if end is None:
        raise RobotError(f"has no <{tag}>", where, f'add <{tag} link="..."/>')
    link = end.get("link", "")
    if link not in links and link != "world":
        raise RobotError(f"names a {tag} link '{link}' that does not exist", where)
    return Element(tag, {"link": link})


def _limit(joint: Element, clean: Element, where: str) -> float | None:
    """Copy the limits of a joint, checked, and return that of its effort."""
    kind = joint.get("type", "")
    limit = only(joint, "limit", where) if kind != "fixed" else None
    if limit is None:
        return None
    found = limits(limit.attrib, kind, where)
    effort = found.pop("effort", None)
    clean.append(Element("limit", {key: repr(value) for key, value in found.items()}))
    return effort


def _require_one_root(links: dict[str, Element], parents: dict[str, str], where: str) -> None:
    roots = [name for name in links if name not in parents]
    if "world" in parents.values() and "world" not in roots:
        roots.append("world")
    if len(roots) > 1:
        raise UnsupportedError(
            f"has several roots ({', '.join(roots)}); one robot has one root",
            where,
            "join them by a fixed joint, or put each robot in its own file",
        )


def _shapes(root: Element, where: str) -> Iterator[Shape]:
    elements = (
        (link.get("name") or "", element)
        for link in root.findall("link")
        for tag in ("visual", "collision")
        for element in link.findall(tag)
    )
    return readable_shapes(elements, _shape)


def _shape(link: str, element: Element) -> Shape:
    origin = element.find("origin")
    xyz, rpy = (
        bounded("0 0 0" if origin is None else origin.get(key, "0 0 0"), 3, f"origin {key}")
        for key in ("xyz", "rpy")
    )
    return Shape(link=link, R=from_rpy(rpy), p=xyz, **_SHAPE_WORDS.solid(element))


def _joint_dynamics(root: Element, where: str) -> Iterator[JointDynamics]:
    kinds: dict[str, str | None] = {}
    for joint in root.findall("joint"):
        name, kind = joint.get("name") or "", joint.get("type")
        kinds[name] = kind
        for dynamics in joint.findall("dynamics"):
            for quantity in ("damping", "friction"):
                if quantity in dynamics.attrib:
                    yield stated_dynamics(name, kind, quantity, dynamics.get(quantity), where)
        yield from rotors(joint, name, kind, where)
    for transmission in root.findall("transmission"):
        carrier = transmission.find("joint")
        name = "" if carrier is None else carrier.get("name") or ""
        yield from rotors(transmission, name, kinds.get(name), where)


def _detach(root: Element) -> None:
    # A URDF has one root: every link is welded to the first one.
    for joint in root.findall("joint"):
        root.remove(joint)
    first, *others = [link.get("name") or "" for link in root.findall("link")] or [""]
    for name in others:
        joint = Element("joint", {"name": f"to {name}", "type": "fixed"})
        joint.append(Element("parent", {"link": first}))
        joint.append(Element("child", {"link": name}))
        root.append(joint)


def _inertial_lines(properties: MassProperties, root: Element, where: str) -> list[str]:
    mass, com, moments = digits(properties)
    inertia = " ".join(f'{name}="{value}"' for name, value in moments.items())
    return [
        "<inertial>",
        f'  <origin xyz="{com}" rpy="0 0 0"/>',
        f'  <mass value="{mass}"/>',
        f"  <inertia {inertia}/>",
        "</inertial>",
    ]


def _for_pinocchio(root: Element) -> None:
    """Add what urdfdom demands and others do not: all limits, and a link for the world."""
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is None and joint.get("type") in ("revolute", "prismatic"):
            limit = Element("limit")
            joint.append(limit)
        if limit is not None:
            wide = {"lower": "-1e9", "upper": "1e9", "velocity": "1e9", "effort": "1e9"}
            limit.attrib.update({**wide, **limit.attrib})
    if any(parent.get("link") == "world" for parent in root.iter("parent")) and not any(
        link.get("name") == "world" for link in root.findall("link")
    ):
        root.append(Element("link", {"name": "world"}))


URDF = Format(
    name="urdf",
    root="robot",
    link="link",
    drake="urdf",
    files=(".urdf",),
    read=_read,
    shapes=_shapes,
    joint_dynamics=_joint_dynamics,
    detach=_detach,
    inertial_lines=_inertial_lines,
    for_pinocchio=_for_pinocchio,
)
