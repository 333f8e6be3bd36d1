"""SDF (SDFormat), a single model of which is read.

The poses of links and joints relative to frames are left to Drake's parser; those of inertias
and shapes are in their link's frame.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.inertia import MassProperties
from dynident.robot.formats.elements import (
    LIMITS,
    MOVING,
    ShapeWords,
    absent,
    bounded,
    continuous_of,
    digits,
    from_quaternion,
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
from dynident.robot.tree import Array

# Beyond this a limit is a way of saying "none".
_NO_LIMIT = 1e15
_TRUE = ("true", "1")
_SHAPE_WORDS = ShapeWords(Element.findtext, mesh="uri", ellipsoid={"radii": 3})


def _read(root: Element, where: str) -> Contents:
    version = root.get("version") or ""
    if not re.fullmatch(r"\d+\.\d+", version):
        raise RobotError(
            f"has version '{version}'", where, 'state the SDF version, as in <sdf version="1.9">'
        )
    copy = keep(root, ("version",))
    worlds = root.findall("world")
    home, target, gravity = root, copy, None
    if worlds:
        home = worlds[0]
        target = Element("world", {"name": home.get("name") or "world"})
        copy.append(target)
        stated_gravity = only(home, "gravity", where)
        if stated_gravity is not None:
            gravity = finite(stated_gravity.text, 3, "gravity", where)
        target.extend(_frame(frame, where) for frame in home.findall("frame"))
    model = _one_model(root, worlds, home, where)
    name = model.get("name")
    if not name:
        raise RobotError("has a model without a name", where, "give it one")
    clean = keep(model, ("name", "canonical_link", "placement_frame"))
    target.append(clean)
    _copy_pose(model, clean, where)
    links = named(model, "link", where)
    if not links:
        raise RobotError("has no links", where, "is it the whole description? its links are <link>")
    inertials: dict[str, Inertial] = {}
    for link_name, link in links.items():
        at = f"{where}: link '{link_name}'"
        if (link.findtext("gravity") or "true").strip() in ("false", "0"):
            what = "is without gravity, which is not supported"
            raise UnsupportedError(what, at, "remove its <gravity>")
        inertials[link_name] = _inertial(link, at)
        clean_link = keep(link, ("name",))
        _copy_pose(link, clean_link, at)
        clean.append(clean_link)
    clean.extend(_frame(frame, where) for frame in model.findall("frame"))
    joints = named(model, "joint", where)
    edges, efforts = [], {}
    for joint_name, joint in joints.items():
        clean_joint, effort = _joint(joint, f"{where}: joint '{joint_name}'")
        clean.append(clean_joint)
        parent, child = (clean_joint.findtext(tag) or "" for tag in ("parent", "child"))
        edges.append((joint_name, parent, child))
        if effort is not None:
            efforts[joint_name] = effort
    refuse_closed_chains(edges, where)
    return Contents(
        name=name,
        copy=copy,
        inertials=inertials,
        elements=links,
        joints=tuple(n for n, joint in joints.items() if joint.get("type") in MOVING),
        efforts=efforts,
        gravity=gravity,
        mimics=mimics_of(joints, "axis"),
        continuous=continuous_of(joints),
    )


def _one_model(root: Element, worlds: list[Element], home: Element, where: str) -> Element:
    for element in root.iter("include"):
        uri = (element.findtext("uri") or "").strip()
        raise RobotError(f"includes another model ({uri})", where, "paste that model in its place")
    models = [model for place in (root, *worlds) for model in place.findall("model")]
    names = ", ".join(model.get("name") or "unnamed" for model in models)
    if not models:
        raise RobotError("has no <model>", where)
    if len(models) > 1 or len(worlds) > 1:
        raise UnsupportedError(f"has several models ({names})", where, "keep one model in the file")
    if worlds and home.find("joint") is not None:
        raise RobotError("has a joint outside its model", where, "move it into the model")
    for nested in models[0].findall("model"):
        what = f"has a nested model '{nested.get('name')}'"
        raise UnsupportedError(what, where, "merge it into the outer model")
    if (models[0].findtext("static") or "false").strip() in _TRUE:
        raise UnsupportedError("is static: nothing of it moves", where, "remove <static>")
    return models[0]


def _frame(frame: Element, where: str) -> Element:
    clean = keep(frame, ("name", "attached_to"))
    _copy_pose(frame, clean, f"{where}: frame '{frame.get('name')}'")
    return clean


def _copy_pose(element: Element, clean: Element, where: str) -> None:
    pose = only(element, "pose", where)
    if pose is None or not (pose.text or "").strip():
        return
    finite(pose.text, 7 if pose.get("rotation_format") == "quat_xyzw" else 6, "pose", where)
    _copy_text(pose, clean, ("relative_to", "degrees", "rotation_format"))


def _copy_text(element: Element, clean: Element, attributes: tuple[str, ...] = ()) -> None:
    copy = keep(element, attributes)
    copy.text = (element.text or "").strip()
    clean.append(copy)


def _placement(
    pose: Element | None, read: Callable[[str | None, int], Array]
) -> tuple[Array, Array]:
    """Return position (3,), m, and orientation (3, 3) of a <pose>, zero where it is absent."""
    if pose is None or not (pose.text or "").strip():
        return np.zeros(3), np.eye(3)
    if pose.get("rotation_format") == "quat_xyzw":
        values = read(pose.text, 7)
        return values[:3], from_quaternion(values[[6, 3, 4, 5]])
    values = read(pose.text, 6)
    rpy = np.deg2rad(values[3:]) if pose.get("degrees", "false") in _TRUE else values[3:]
    return values[:3], from_rpy(rpy)


def _inertial(link: Element, where: str) -> Inertial:
    inertial = only(link, "inertial", where)
    if inertial is None:
        return absent()
    if inertial.get("auto", "false") in _TRUE:
        raise UnsupportedError(
            "asks for its inertia to be computed from collisions, which is not supported",
            where,
            "state mass and inertia",
        )
    if inertial.find("fluid_added_mass") is not None:
        raise UnsupportedError("has <fluid_added_mass>, which is not supported", where, "remove it")
    pose = only(inertial, "pose", where)
    if pose is not None and (pose.text or "").strip() and pose.get("relative_to"):
        raise RobotError(
            "has an inertial pose relative to another frame", where, "state it in the link's frame"
        )
    com, R = _placement(pose, lambda text, count: reals(text, count, "inertial pose", where))
    mass, tensor = required(inertial, where, "<mass>...</mass>")

    def entry(key: str) -> float:
        value = only(tensor, key, where)
        # The moments must be stated; products of inertia may be left out where they are zero.
        if value is None and key in ("ixy", "ixz", "iyz"):
            return 0.0
        return float(reals(None if value is None else value.text, 1, f"inertia {key}", where)[0])

    return stated(float(reals(mass.text, 1, "mass", where)[0]), com, R, symmetric(entry))


def _joint(joint: Element, where: str) -> tuple[Element, float | None]:
    """Return the sanitised copy of a joint, and its effort limit."""
    kind = joint.get("type", "")
    if kind not in (*MOVING, "fixed"):
        raise UnsupportedError(
            f"is of type '{kind}', which is not supported",
            where,
            f"use joints of type {', '.join((*MOVING, 'fixed'))}",
        )
    clean = keep(joint, ("name", "type"))
    for tag in ("parent", "child"):
        end = only(joint, tag, where)
        if end is None or not (end.text or "").strip():
            raise RobotError(f"has no <{tag}>", where, f"name its {tag} link")
        _copy_text(end, clean)
    _copy_pose(joint, clean, where)
    axis = only(joint, "axis", where)
    if kind == "fixed":
        return clean, None
    if axis is None:
        raise RobotError("has no <axis>", where, "add <axis><xyz>0 0 1</xyz></axis>")
    clean_axis = Element("axis")
    clean.append(clean_axis)
    xyz = only(axis, "xyz", where)
    if xyz is not None:
        if np.linalg.norm(finite(xyz.text, 3, "axis xyz", where)) < 1e-9:
            raise RobotError("has a zero axis", where, "state its direction, as in 0 0 1")
        _copy_text(xyz, clean_axis, ("expressed_in",))
    for old_style in axis.findall("use_parent_model_frame")[:1]:
        _copy_text(old_style, clean_axis)
    limit = only(axis, "limit", where)
    if limit is None:
        return clean, None
    texts = {key: only(limit, key, where) for key in LIMITS}
    found = limits(
        {key: one.text or "" for key, one in texts.items() if one is not None},
        kind,
        where,
        unlimited=_NO_LIMIT,
    )
    effort = found.pop("effort", None)
    clean_limit = Element("limit")
    for key, value in found.items():
        # The parser refuses denormal numbers.
        entry = Element(key)
        entry.text = repr(value if abs(value) > 1e-300 else 0.0)
        clean_limit.append(entry)
    clean_axis.append(clean_limit)
    return clean, effort


def _shapes(root: Element, where: str) -> Iterator[Shape]:
    elements = (
        (link.get("name") or "", element)
        for link in root.iter("link")
        for tag in ("visual", "collision")
        for element in link.findall(tag)
        if element.find("geometry/empty") is None
    )
    return readable_shapes(elements, _shape)


def _shape(link: str, element: Element) -> Shape:
    pose = element.find("pose")
    if pose is not None and pose.get("relative_to") not in (None, "", link):
        raise RobotError("a shape whose pose is relative to another frame")
    p, R = _placement(pose, lambda text, count: bounded(text, count, "pose"))
    if not np.all(np.isfinite(R)):
        raise RobotError("pose without an orientation")
    return Shape(link=link, R=R, p=p, **_SHAPE_WORDS.solid(element))


def _joint_dynamics(root: Element, where: str) -> Iterator[JointDynamics]:
    for joint in root.iter("joint"):
        name, kind = joint.get("name") or "", joint.get("type")
        for axis in (*joint.findall("axis"), *joint.findall("axis2")):
            for quantity in ("damping", "friction"):
                for element in axis.findall(f"dynamics/{quantity}"):
                    yield stated_dynamics(name, kind, quantity, element.text, where)
        yield from rotors(joint, name, kind, where)


def _detach(root: Element) -> None:
    for model in root.iter("model"):
        for tag in ("joint", "static", "frame", "pose"):
            for element in model.findall(tag):
                model.remove(element)
        for link in model.findall("link"):
            for tag in ("pose", "gravity"):
                for element in link.findall(tag):
                    link.remove(element)


def _inertial_lines(properties: MassProperties, root: Element, where: str) -> list[str]:
    mass, com, moments = digits(properties)
    return [
        "<inertial>",
        f"  <pose>{com} 0 0 0</pose>",
        f"  <mass>{mass}</mass>",
        "  <inertia>",
        *(f"    <{name}>{value}</{name}>" for name, value in moments.items()),
        "  </inertia>",
        "</inertial>",
    ]


SDF = Format(
    name="sdf",
    root="sdf",
    link="link",
    drake="sdf",
    files=(".sdf", ".world"),
    read=_read,
    shapes=_shapes,
    joint_dynamics=_joint_dynamics,
    detach=_detach,
    inertial_lines=_inertial_lines,
)
