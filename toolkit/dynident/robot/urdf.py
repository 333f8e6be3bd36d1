"""Read a URDF: a harmless copy of its kinematics, and its inertial elements as written."""

from __future__ import annotations

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.robot.chains import Chains
from dynident.robot.contents import Contents, Inertial, absent, keep, stated, symmetric, to_text
from dynident.robot.rotations import from_rpy
from dynident.robot.tree import Array
from dynident.robot.xmltree import Document, Element, attribute, finite, only, reals, require_unique

_MOVING = ("revolute", "continuous", "prismatic")
_MENDS = {
    "floating": "fix the base: remove the floating joint, or make it fixed",
    "planar": "write it as two prismatic joints and a revolute one",
    "ball": "write it as three revolute joints",
    "universal": "write it as two revolute joints",
    "screw": "screw joints are not supported; write it as a revolute or a prismatic joint",
}


def read(document: Document, where: str) -> Contents:
    """Take a URDF apart.

    Raises
    ------
    RobotError
        Naming the link or joint that is broken or not supported.
    """
    root = document.root
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            raise RobotError(
                f"is a xacro file (it has <{element.tag}>)",
                where,
                "expand it first: xacro FILE.xacro > FILE.urdf",
            )
    name = root.get("name") or "robot"
    copy = Element("robot", {"name": name})
    inertials: dict[str, Inertial] = {}
    elements: dict[str, Element] = {}
    links = root.findall("link")
    if not links:
        raise RobotError("has no links", where)
    require_unique((_name(link, "link", where) for link in links), "link", where)
    for link in links:
        link_name = _name(link, "link", where)
        inertials[link_name] = _inertial(link, f"{where}: link '{link_name}'")
        elements[link_name] = link
        copy.append(Element("link", {"name": link_name}))
    joints = root.findall("joint")
    require_unique((_name(joint, "joint", where) for joint in joints), "joint", where)
    moving, efforts = [], {}
    chains = Chains(where)
    for joint in joints:
        joint_name = _name(joint, "joint", where)
        clean = _joint(joint, f"{where}: joint '{joint_name}'", inertials)
        copy.append(clean)
        parent, child = (clean.find(tag) for tag in ("parent", "child"))
        assert parent is not None and child is not None
        chains.attach(joint_name, parent.attrib["link"], child.attrib["link"])
        if joint.get("type") in _MOVING:
            moving.append(joint_name)
            limit = joint.find("limit")
            effort = float(limit.get("effort", "0")) if limit is not None else 0.0
            if effort > 0.0:
                efforts[joint_name] = effort
    chains.refuse_loops()
    _one_root(list(inertials), chains.parents, where)
    return Contents(name, "urdf", to_text(copy), inertials, elements, tuple(moving), efforts)


def _name(element: Element, what: str, where: str) -> str:
    name = element.get("name")
    if not name:
        raise RobotError(f"has a {what} without a name", where, "give it one")
    return name


def _inertial(link: Element, where: str) -> Inertial:
    inertial = only(link, "inertial", where)
    if inertial is None:
        return absent()
    xyz, R = np.zeros(3), np.eye(3)
    origin = only(inertial, "origin", where)
    if origin is not None:
        xyz = reals(origin.get("xyz", "0 0 0"), 3, "inertial origin xyz", where)
        R = from_rpy(reals(origin.get("rpy", "0 0 0"), 3, "inertial origin rpy", where))
    mass = only(inertial, "mass", where)
    if mass is None:
        raise RobotError("has an <inertial> without <mass>", where, 'add <mass value="..."/>')
    tensor = only(inertial, "inertia", where)
    if tensor is None:
        raise RobotError("has an <inertial> without <inertia>", where, "zeros make a point mass")

    def entry(key: str) -> float:
        # The moments must be stated; products of inertia may be left out where they are zero.
        if key not in tensor.attrib and key in ("ixy", "ixz", "iyz"):
            return 0.0
        return attribute(tensor, key, "inertia", where)

    return stated(attribute(mass, "value", "mass", where), xyz, R, symmetric(entry))


def _joint(joint: Element, where: str, links: dict[str, Inertial]) -> Element:
    kind = joint.get("type", "")
    if kind in _MENDS:
        raise UnsupportedError(f"is of type '{kind}', which is not supported", where, _MENDS[kind])
    if kind not in (*_MOVING, "fixed"):
        raise RobotError(
            f"is of unknown type '{kind}'", where, f"use one of {', '.join((*_MOVING, 'fixed'))}"
        )
    if joint.find("mimic") is not None:
        raise UnsupportedError(
            "mimics another joint, which is not supported",
            where,
            "remove <mimic> to make it independent, or make the joint fixed",
        )
    clean = keep(joint, ("name", "type"))
    for tag in ("parent", "child"):
        end = only(joint, tag, where)
        if end is None:
            raise RobotError(f"has no <{tag}>", where, f'add <{tag} link="..."/>')
        link = end.get("link", "")
        if link not in links and link != "world":
            raise RobotError(f"names a {tag} link '{link}' that does not exist", where)
        clean.append(keep(end, ("link",)))
    origin = only(joint, "origin", where)
    if origin is not None:
        for key in ("xyz", "rpy"):
            if key in origin.attrib:
                finite(origin.get(key), 3, f"origin {key}", where)
        clean.append(keep(origin, ("xyz", "rpy")))
    if kind == "fixed":
        return clean
    axis = only(joint, "axis", where)
    if axis is not None:
        _axis(axis, where)
        clean.append(keep(axis, ("xyz",)))
    limit = only(joint, "limit", where)
    if limit is not None:
        clean.append(_limit(limit, where, kind))
    return clean


def _axis(axis: Element, where: str) -> Array:
    direction = finite(axis.get("xyz"), 3, "axis xyz", where)
    if np.linalg.norm(direction) < 1e-9:
        raise RobotError("has a zero axis", where, 'state its direction, as in xyz="0 0 1"')
    return direction


def _limit(limit: Element, where: str, kind: str) -> Element:
    for key in ("lower", "upper", "velocity", "effort"):
        if key in limit.attrib and np.isnan(attribute(limit, key, "limit", where)):
            raise RobotError(f"limit {key} is NaN", where)
    # A continuous joint has no position limits, whatever the element says; an infinite limit or a
    # speed of zero is none.
    clean = Element("limit")
    lower, upper = float(limit.get("lower", "-inf")), float(limit.get("upper", "inf"))
    if kind != "continuous":
        if lower > upper:
            raise RobotError("has a lower limit above its upper limit", where, "swap them")
        for key, value in (("lower", lower), ("upper", upper)):
            if np.isfinite(value):
                clean.set(key, repr(value))
    velocity = float(limit.get("velocity", "0"))
    if 0.0 < velocity < np.inf:
        clean.set("velocity", repr(velocity))
    return clean


def _one_root(links: list[str], parents: dict[str, str], where: str) -> None:
    roots = [name for name in links if name not in parents]
    if "world" in parents.values() and "world" not in roots:
        roots.append("world")
    if len(roots) > 1:
        raise UnsupportedError(
            f"has several roots ({', '.join(roots)}); one robot has one root",
            where,
            "join them by a fixed joint, or put each robot in its own file",
        )
