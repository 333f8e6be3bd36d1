"""Bodies, joints and inertias of an MJCF, and their sanitised copy.

The copy has its default classes applied, and a body with several joints as a chain of bodies
with one joint each (which is what it means).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.inertia import MassProperties
from dynident.robot.formats.elements import absent, digits, keep, stated, stated_dynamics
from dynident.robot.formats.format import Contents, Inertial, JointDynamics
from dynident.robot.formats.mjcf.attributes import (
    ORIENTATIONS,
    MjcfBody,
    MjcfModel,
    compiler_of,
)
from dynident.robot.formats.mjcf.geoms import heavy_geoms, sanitised_pose
from dynident.robot.formats.xmltree import Element, finite, only, reals

_REFUSED = ("include", "frame", "attach", "replicate", "composite", "flexcomp", "flex")
_NEUTRAL = {"coordinate": "local", "balanceinertia": "false", "inertiagrouprange": "0 5"}
_UNIT_INERTIA = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
_DYNAMICS = {"damping": "damping", "frictionloss": "friction", "armature": "rotor inertia"}


def read(root: Element, where: str) -> Contents:
    """Take an MJCF apart; see `Format`.

    Raises
    ------
    RobotError
        Naming the body or joint that is broken or not supported.
    """
    _refuse(root, where)
    model = MjcfModel.read(root, where)
    copy = Element("mujoco", {"model": root.get("model") or "robot"})
    copy.append(keep(Element("compiler", model.compiler), ("angle", "eulerseq")))
    world = Element("worldbody")
    copy.append(world)
    clean = {"": world}
    elements: dict[str, Element] = {}
    inertials: dict[str, Inertial] = {}
    joints: list[str] = []
    efforts: dict[str, float] = {}
    for body in model.bodies():
        at = f"{where}: body '{body.name}'"
        if body.name in elements or body.name == "world":
            raise RobotError(f"has two bodies named '{body.name}'", where, "rename one of them")
        elements[body.name] = body.element
        _refuse_body(body.element, at)
        own = Element("body", {"name": body.name})
        pose = sanitised_pose(model, body.element.attrib, at)
        parent = clean[body.parent]
        clean_joints = []
        for name, joint in body.joints():
            if name in joints:
                raise RobotError(f"has two joints named '{name}'", where, "rename one of them")
            joints.append(name)
            joint_at = f"{where}: joint '{name}'"
            attributes = model.attributes(joint, body.childclass, joint_at)
            clean_joints.append(_joint(model, name, attributes, joint_at))
            if "actuatorfrcrange" in attributes:
                span = finite(attributes["actuatorfrcrange"], 2, "actuatorfrcrange", joint_at)
                if np.any(span):
                    efforts[name] = float(np.max(np.abs(span)))
        # All but the last joint move a massless body of their own.
        for joint in clean_joints[:-1]:
            link = Element("body", {"name": f"{body.name}@{joint.get('name')}", **pose})
            link.extend([Element("inertial", _UNIT_INERTIA), joint])
            parent.append(link)
            parent, pose = link, {}
        own.attrib.update(pose)
        own.extend(clean_joints[-1:])
        parent.append(own)
        inertials[body.name], shown = _inertia(model, body, at)
        own.extend(shown)
        clean[body.name] = own
    if not elements:
        raise RobotError("has no bodies", where)
    gravity = None
    for option in root.findall("option"):
        if "gravity" in option.attrib:
            gravity = finite(option.get("gravity"), 3, "option gravity", where)
    return Contents(
        name=root.get("model") or "robot",
        copy=copy,
        inertials=inertials,
        elements=elements,
        joints=tuple(joints),
        efforts=efforts,
        gravity=gravity,
    )


def _refuse(root: Element, where: str) -> None:
    """Refuse what would change the robot and is not supported."""
    remedy = "save the compiled model from MuJoCo (mj_saveLastXML), which has none"
    for element in root.iter():
        if element.tag in _REFUSED:
            what = f"has a <{element.tag}> element, which is not supported"
            raise UnsupportedError(what, where, remedy)
    for constraint in root.findall("equality/*"):
        if constraint.get("active", "true") != "false":
            raise UnsupportedError(
                f"has an equality constraint <{constraint.tag}>: closed chains and "
                "coupled joints are not supported",
                where,
                "remove it",
            )
    compiler = compiler_of(root)
    changing = [key for key, value in _NEUTRAL.items() if compiler.get(key, value) != value]
    for key in ("settotalmass", "boundmass", "boundinertia"):
        if float(reals(compiler.get(key, "0"), 1, key, where)[0]) > 0.0:
            changing.append(key)
    for key in changing:
        what = f'has compiler {key}="{compiler[key]}", which is not supported'
        raise UnsupportedError(what, where, remedy)


def _refuse_body(body: Element, where: str) -> None:
    if body.get("mocap", "false") == "true":
        raise UnsupportedError("is a mocap body, which is not supported", where, "remove mocap")
    if float(reals(body.get("gravcomp", "0"), 1, "gravcomp", where)[0]) != 0.0:
        raise UnsupportedError("has gravcomp, which is not supported", where, "remove it")
    if body.find("freejoint") is not None:
        _refuse_free(where)


def _refuse_free(where: str) -> None:
    raise UnsupportedError(
        "has a free joint: a floating base is not supported",
        where,
        "remove the joint to fix the base to the world",
    )


def _joint(model: MjcfModel, name: str, attributes: dict[str, str], where: str) -> Element:
    kind = attributes.get("type", "hinge")
    if kind == "free":
        _refuse_free(where)
    if kind not in ("hinge", "slide"):
        raise UnsupportedError(
            f"is of type '{kind}', which is not supported", where, "use hinge and slide joints"
        )
    if float(reals(attributes.get("ref", "0"), 1, "ref", where)[0]) != 0.0:
        raise UnsupportedError(
            f'has ref="{attributes["ref"]}", which is not supported',
            where,
            "turn the body so that its zero needs no ref",
        )
    clean = Element("joint", {"name": name, "type": kind, "axis": "0 0 1"})
    clean.attrib.update({key: attributes[key] for key in ("pos", "axis") if key in attributes})
    finite(clean.get("pos", "0 0 0"), 3, "pos", where)
    if np.linalg.norm(finite(clean.get("axis"), 3, "axis", where)) < 1e-9:
        raise RobotError("has a zero axis", where, 'state its direction, as in axis="0 0 1"')
    limited = attributes.get("limited", "auto")
    if limited == "auto":
        automatic = model.compiler.get("autolimits", "true") == "true"
        limited = "true" if automatic and "range" in attributes else "false"
    if limited == "true":
        lower, upper = finite(attributes.get("range", "0 0"), 2, "range", where)
        if lower > upper:
            raise RobotError("has a lower limit above its upper limit", where, "swap them")
        clean.attrib.update({"limited": "true", "range": attributes.get("range", "0 0")})
    return clean


def _inertia(model: MjcfModel, body: MjcfBody, where: str) -> tuple[Inertial, list[Element]]:
    """Return the inertia of a body, and what stands for it in the copy."""
    element = only(body.element, "inertial", where)
    source = model.compiler.get("inertiafromgeom", "auto")
    unit = [Element("inertial", _UNIT_INERTIA)]
    if element is not None and source != "true":
        return _inertial(model, element.attrib, where), unit
    geoms = [] if source == "false" else list(heavy_geoms(model, body, where))
    return (Inertial(np.zeros(10), "geometry"), geoms) if geoms else (absent(), unit)


def _inertial(model: MjcfModel, attributes: dict[str, str], where: str) -> Inertial:
    for key in ("pos", "mass"):
        if key not in attributes:
            raise RobotError(f"has an <inertial> without {key}", where, f'add {key}="..."')
    mass = float(reals(attributes["mass"], 1, "inertial mass", where)[0])
    com = reals(attributes["pos"], 3, "inertial pos", where)
    if "fullinertia" in attributes and "diaginertia" in attributes:
        raise RobotError("has both diaginertia and fullinertia", where, "keep one")
    R = model.orientation(attributes, where)
    if "fullinertia" in attributes:
        if any(key in attributes for key in ORIENTATIONS):
            raise RobotError(
                "has fullinertia together with an orientation, which MuJoCo forbids",
                where,
                "remove the orientation, or use diaginertia",
            )
        xx, yy, zz, xy, xz, yz = reals(attributes["fullinertia"], 6, "fullinertia", where)
        return stated(mass, com, R, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if "diaginertia" not in attributes:
        raise RobotError(
            "has an <inertial> without diaginertia or fullinertia", where, "add one of them"
        )
    return stated(mass, com, R, np.diag(reals(attributes["diaginertia"], 3, "diaginertia", where)))


def joint_dynamics(root: Element, where: str) -> Iterator[JointDynamics]:
    """Iterate over what an MJCF states of its joints' dynamics; see `Format`."""
    model = MjcfModel.read(root, where)
    for body in model.bodies():
        for name, joint in body.joints():
            attributes = model.attributes(joint, body.childclass, where)
            for key, quantity in _DYNAMICS.items():
                if key in attributes:
                    kind, text = attributes.get("type"), attributes[key]
                    yield stated_dynamics(name, kind, quantity, text, where)


def detach(root: Element) -> None:
    """Remove all joints from an MJCF; see `Format`."""
    for section in root.findall("equality"):
        root.remove(section)
    for body in root.iter("body"):
        for tag in ("joint", "freejoint"):
            for element in body.findall(tag):
                body.remove(element)
        for key in ("mocap", "gravcomp"):
            body.attrib.pop(key, None)


def inertial_lines(properties: MassProperties, root: Element, where: str) -> list[str]:
    """Return the inertial element that states an inertia; see `Format`.

    Parameters
    ----------
    properties : MassProperties
    root : Element
    where : str
        The body, for messages.

    Raises
    ------
    RobotError
        If the model takes inertias from shapes.
    """
    if any(c.get("inertiafromgeom") == "true" for c in root.findall("compiler")):
        raise RobotError(
            'cannot state an inertia under compiler inertiafromgeom="true"',
            where,
            "remove inertiafromgeom",
        )
    mass, com, moments = digits(properties)
    full = " ".join(moments[name] for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    return [f'<inertial pos="{com}" mass="{mass}" fullinertia="{full}"/>']
