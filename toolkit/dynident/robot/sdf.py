"""Read an SDF: a harmless copy of its kinematics, and its inertial elements as written."""

from __future__ import annotations

import re

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.robot.chains import Chains
from dynident.robot.contents import Contents, Inertial, absent, keep, stated, symmetric, to_text
from dynident.robot.rotations import from_quaternion, from_rpy
from dynident.robot.tree import Array
from dynident.robot.xmltree import Document, Element, finite, only, reals, require_unique

_MOVING = ("revolute", "continuous", "prismatic")
_POSE = ("relative_to", "degrees", "rotation_format")
# Beyond this a limit is a way of saying "none".
_NO_LIMIT = 1e15


def read(document: Document, where: str) -> Contents:
    """Take an SDF apart.

    Raises
    ------
    RobotError
        Naming the link or joint that is broken or not supported.
    """
    root = document.root
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
        gravity = _gravity(home, where)
        target.extend(_frame(frame, where) for frame in home.findall("frame"))
    model = _one_model(root, worlds, home, where)
    name = _name(model, "model", where)
    clean = keep(model, ("name", "canonical_link", "placement_frame"))
    target.append(clean)
    _pose(model, clean, where)
    inertials: dict[str, Inertial] = {}
    elements: dict[str, Element] = {}
    links = model.findall("link")
    if not links:
        raise RobotError("has no links", where)
    require_unique((_name(link, "link", where) for link in links), "link", where)
    for link in links:
        link_name = _name(link, "link", where)
        link_where = f"{where}: link '{link_name}'"
        if (link.findtext("gravity") or "true").strip() in ("false", "0"):
            raise UnsupportedError(
                "is without gravity, which is not supported", link_where, "remove its <gravity>"
            )
        inertials[link_name] = _inertial(link, link_where)
        elements[link_name] = link
        clean_link = keep(link, ("name",))
        _pose(link, clean_link, link_where)
        clean.append(clean_link)
    clean.extend(_frame(frame, where) for frame in model.findall("frame"))
    joints = model.findall("joint")
    require_unique((_name(joint, "joint", where) for joint in joints), "joint", where)
    moving, efforts = [], {}
    chains = Chains(where)
    for joint in joints:
        joint_name = _name(joint, "joint", where)
        clean_joint = _joint(joint, f"{where}: joint '{joint_name}'")
        clean.append(clean_joint)
        parent, child = (clean_joint.findtext(tag) or "" for tag in ("parent", "child"))
        chains.attach(joint_name, parent, child)
        if joint.get("type") in _MOVING:
            moving.append(joint_name)
            effort = float(joint.findtext("axis/limit/effort") or "0")
            if 0.0 < effort < _NO_LIMIT:
                efforts[joint_name] = effort
    chains.refuse_loops()
    return Contents(
        name, "sdf", to_text(copy), inertials, elements, tuple(moving), efforts, gravity
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
    if models[0].find("model") is not None:
        nested = models[0].find("model")
        assert nested is not None
        raise UnsupportedError(
            f"has a nested model '{nested.get('name')}'", where, "merge it into the outer model"
        )
    if (models[0].findtext("static") or "false").strip() in ("true", "1"):
        raise UnsupportedError("is static: nothing of it moves", where, "remove <static>")
    return models[0]


def _name(element: Element, what: str, where: str) -> str:
    name = element.get("name")
    if not name:
        raise RobotError(f"has a {what} without a name", where, "give it one")
    return name


def _gravity(world: Element, where: str) -> Array | None:
    gravity = only(world, "gravity", where)
    return None if gravity is None else finite(gravity.text, 3, "gravity", where)


def _pose(element: Element, clean: Element, where: str) -> None:
    """Copy the pose of an element, checked."""
    pose = only(element, "pose", where)
    if pose is None or not (pose.text or "").strip():
        return
    finite(pose.text, 7 if pose.get("rotation_format") == "quat_xyzw" else 6, "pose", where)
    copy = keep(pose, _POSE)
    copy.text = pose.text
    clean.append(copy)


def _frame(frame: Element, where: str) -> Element:
    clean = keep(frame, ("name", "attached_to"))
    _pose(frame, clean, f"{where}: frame '{frame.get('name')}'")
    return clean


def _inertial(link: Element, where: str) -> Inertial:
    inertial = only(link, "inertial", where)
    if inertial is None:
        return absent()
    if inertial.get("auto", "false") in ("true", "1"):
        raise UnsupportedError(
            "asks for its inertia to be computed from collisions, which is not supported",
            where,
            "state mass and inertia",
        )
    if inertial.find("fluid_added_mass") is not None:
        raise UnsupportedError("has <fluid_added_mass>, which is not supported", where, "remove it")
    com, R = np.zeros(3), np.eye(3)
    pose = only(inertial, "pose", where)
    if pose is not None and (pose.text or "").strip():
        com, R = _read_pose(pose, where)
    mass = only(inertial, "mass", where)
    if mass is None:
        raise RobotError("has an <inertial> without <mass>", where, "add <mass>...</mass>")
    tensor = only(inertial, "inertia", where)
    if tensor is None:
        raise RobotError("has an <inertial> without <inertia>", where, "zeros make a point mass")

    def entry(key: str) -> float:
        value = only(tensor, key, where)
        # The moments must be stated; products of inertia may be left out where they are zero.
        if value is None and key in ("ixy", "ixz", "iyz"):
            return 0.0
        return float(reals(None if value is None else value.text, 1, f"inertia {key}", where)[0])

    return stated(float(reals(mass.text, 1, "mass", where)[0]), com, R, symmetric(entry))


def _read_pose(pose: Element, where: str) -> tuple[Array, Array]:
    if pose.get("relative_to"):
        raise RobotError(
            "has an inertial pose relative to another frame", where, "state it in the link's frame"
        )
    if pose.get("rotation_format") == "quat_xyzw":
        values = reals(pose.text, 7, "inertial pose", where)
        return values[:3], from_quaternion(values[[6, 3, 4, 5]])
    values = reals(pose.text, 6, "inertial pose", where)
    degrees = pose.get("degrees", "false") in ("true", "1")
    return values[:3], from_rpy(np.deg2rad(values[3:]) if degrees else values[3:])


def _joint(joint: Element, where: str) -> Element:
    kind = joint.get("type", "")
    if kind not in (*_MOVING, "fixed"):
        raise UnsupportedError(
            f"is of type '{kind}', which is not supported",
            where,
            f"use joints of type {', '.join((*_MOVING, 'fixed'))}",
        )
    clean = keep(joint, ("name", "type"))
    for tag in ("parent", "child"):
        end = only(joint, tag, where)
        if end is None or not (end.text or "").strip():
            raise RobotError(f"has no <{tag}>", where, f"name its {tag} link")
        copy = Element(tag)
        copy.text = (end.text or "").strip()
        clean.append(copy)
    _pose(joint, clean, where)
    axis = only(joint, "axis", where)
    if kind == "fixed":
        return clean
    if axis is None:
        raise RobotError("has no <axis>", where, "add <axis><xyz>0 0 1</xyz></axis>")
    if axis.find("mimic") is not None:
        raise UnsupportedError(
            "mimics another joint, which is not supported",
            where,
            "remove <mimic> to make it independent, or make the joint fixed",
        )
    clean.append(_axis(axis, kind, where))
    return clean


def _axis(axis: Element, kind: str, where: str) -> Element:
    clean = Element("axis")
    xyz = only(axis, "xyz", where)
    if xyz is not None:
        if np.linalg.norm(finite(xyz.text, 3, "axis xyz", where)) < 1e-9:
            raise RobotError("has a zero axis", where, "state its direction, as in 0 0 1")
        copy = keep(xyz, ("expressed_in",))
        copy.text = xyz.text
        clean.append(copy)
    old_style = axis.find("use_parent_model_frame")
    if old_style is not None:
        copy = Element(old_style.tag)
        copy.text = old_style.text
        clean.append(copy)
    limit = only(axis, "limit", where)
    if limit is None:
        return clean
    values: dict[str, float] = {}
    for key in ("lower", "upper", "velocity", "effort"):
        element = only(limit, key, where)
        if element is not None:
            values[key] = float(reals(element.text, 1, f"limit {key}", where)[0])
            if np.isnan(values[key]):
                raise RobotError(f"limit {key} is NaN", where)
    if values.get("lower", -np.inf) > values.get("upper", np.inf):
        raise RobotError("has a lower limit above its upper limit", where, "swap them")
    limits = Element("limit")
    for key in ("lower", "upper", "velocity"):
        wanted = key == "velocity" or kind != "continuous"
        if (
            wanted
            and abs(values.get(key, np.inf)) < _NO_LIMIT
            and not (key == "velocity" and values[key] <= 0.0)
        ):
            entry = Element(key)
            # The parser refuses denormal numbers.
            entry.text = repr(values[key] if abs(values[key]) > 1e-300 else 0.0)
            limits.append(entry)
    clean.append(limits)
    return clean
