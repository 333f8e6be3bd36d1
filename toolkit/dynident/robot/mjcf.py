"""Read an MJCF: a harmless copy of its kinematics, and its inertial elements as written.

The copy has its default classes applied, and a body with several joints as a chain of bodies
with one joint each (which is what it means).
"""

from __future__ import annotations

import numpy as np

from dynident.errors import RobotError, UnsupportedError
from dynident.robot.contents import Contents, Inertial, absent, stated, to_text
from dynident.robot.mjcf_defaults import Angles, Defaults
from dynident.robot.tree import Array
from dynident.robot.xmltree import Document, Element, finite, only, reals

_POSE = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
_SHAPE = ("type", "size", "fromto", "mass", "density", *_POSE)
_SHAPES = ("sphere", "capsule", "ellipsoid", "cylinder", "box")
_REFUSED = ("include", "frame", "attach", "replicate", "composite", "flexcomp", "flex")
_HARMLESS = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}


def read(document: Document, where: str) -> Contents:
    """Take an MJCF apart.

    Raises
    ------
    RobotError
        Naming the body or joint that is broken or not supported.
    """
    return _MjcfReader(document.root, where).read()


class _MjcfReader:
    def __init__(self, root: Element, where: str) -> None:
        self.root, self.where = root, where
        self.compiler: dict[str, str] = {}
        for element in root.findall("compiler"):
            self.compiler.update(element.attrib)
        self._refuse()
        self.angles = Angles.read(self.compiler, where)
        self.defaults = Defaults.read(root, where)
        self.inertials: dict[str, Inertial] = {}
        self.elements: dict[str, Element] = {}
        self.joints: list[str] = []
        self.efforts: dict[str, float] = {}

    def read(self) -> Contents:
        name = self.root.get("model") or "robot"
        copy = Element("mujoco", {"model": name})
        settings = {k: v for k, v in self.compiler.items() if k in ("angle", "eulerseq")}
        copy.append(Element("compiler", settings))
        world = Element("worldbody")
        copy.append(world)
        for section in self.root.findall("worldbody"):
            for body in section.findall("body"):
                self._body(body, world, section.get("childclass") or "main")
        if not self.elements:
            raise RobotError("has no bodies", self.where)
        gravity: Array | None = None
        for option in self.root.findall("option"):
            if "gravity" in option.attrib:
                gravity = finite(option.get("gravity"), 3, "option gravity", self.where)
        return Contents(
            name,
            "xml",
            to_text(copy),
            self.inertials,
            self.elements,
            tuple(self.joints),
            self.efforts,
            gravity,
        )

    def _refuse(self) -> None:
        """Refuse what would change the robot and is not supported."""
        for element in self.root.iter():
            if element.tag in _REFUSED:
                raise UnsupportedError(
                    f"has a <{element.tag}> element, which is not supported",
                    self.where,
                    "save the compiled model from MuJoCo (mj_saveLastXML), which has none",
                )
        for section in self.root.findall("equality"):
            for constraint in section:
                if constraint.get("active", "true") != "false":
                    raise UnsupportedError(
                        f"has an equality constraint <{constraint.tag}>: closed chains and "
                        "coupled joints are not supported",
                        self.where,
                        "remove it",
                    )
        neutral = {
            "coordinate": ("local",),
            "balanceinertia": ("false",),
            "inertiagrouprange": ("0 5",),
        }
        for key, values in neutral.items():
            if self.compiler.get(key, values[0]) not in values:
                self._refuse_compiler(key)
        for key in ("settotalmass", "boundmass", "boundinertia"):
            if float(reals(self.compiler.get(key, "0"), 1, key, self.where)[0]) > 0.0:
                self._refuse_compiler(key)

    def _refuse_compiler(self, key: str) -> None:
        raise UnsupportedError(
            f'has compiler {key}="{self.compiler[key]}", which is not supported',
            self.where,
            "save the compiled model from MuJoCo (mj_saveLastXML), which has none",
        )

    def _body(self, body: Element, parent: Element, childclass: str) -> None:
        name = body.get("name") or f"body_{len(self.elements) + 1}"
        where = f"{self.where}: body '{name}'"
        if name in self.elements or name == "world":
            raise RobotError(f"has two bodies named '{name}'", self.where, "rename one of them")
        if body.get("mocap", "false") == "true":
            raise UnsupportedError("is a mocap body, which is not supported", where, "remove mocap")
        if float(reals(body.get("gravcomp", "0"), 1, "gravcomp", where)[0]) != 0.0:
            raise UnsupportedError("has gravcomp, which is not supported", where, "remove it")
        childclass = body.get("childclass") or childclass
        self.elements[name] = body
        pose = self._pose(dict(body.attrib), where)
        joints = self._joints(body, name, childclass, where)
        # All but the last joint move a massless body of their own.
        for joint in joints[:-1]:
            link = Element("body", {"name": f"{name}@{joint.get('name')}", **pose})
            link.extend([Element("inertial", _HARMLESS), joint])
            parent.append(link)
            parent, pose = link, {}
        clean = Element("body", {"name": name, **pose})
        clean.extend(joints[-1:])
        parent.append(clean)
        self._inertia(body, clean, name, childclass, where)
        for child in body.findall("body"):
            self._body(child, clean, childclass)

    def _pose(self, attributes: dict[str, str], where: str) -> dict[str, str]:
        finite(attributes.get("pos", "0 0 0"), 3, "pos", where)
        if not np.all(np.isfinite(self.angles.orientation(attributes, where))):
            raise RobotError("has an orientation that is not finite", where)
        return {key: attributes[key] for key in _POSE if key in attributes}

    def _joints(self, body: Element, name: str, childclass: str, where: str) -> list[Element]:
        if body.find("freejoint") is not None:
            self._refuse_free(where)
        found = body.findall("joint")
        clean = []
        for number, joint in enumerate(found, start=1):
            suffix = "_joint" if len(found) == 1 else f"_joint_{number}"
            joint_name = joint.get("name") or name + suffix
            if joint_name in self.joints:
                raise RobotError(
                    f"has two joints named '{joint_name}'", self.where, "rename one of them"
                )
            at = f"{self.where}: joint '{joint_name}'"
            attributes = self.defaults.attributes(joint, childclass, at)
            clean.append(self._joint(joint_name, attributes, at))
            self.joints.append(joint_name)
        return clean

    def _refuse_free(self, where: str) -> None:
        raise UnsupportedError(
            "has a free joint: a floating base is not supported",
            where,
            "remove the joint to fix the base to the world",
        )

    def _joint(self, name: str, attributes: dict[str, str], where: str) -> Element:
        kind = attributes.get("type", "hinge")
        if kind == "free":
            self._refuse_free(where)
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
        clean = Element("joint", {"name": name, "type": kind})
        if "pos" in attributes:
            finite(attributes["pos"], 3, "pos", where)
            clean.set("pos", attributes["pos"])
        axis = finite(attributes.get("axis", "0 0 1"), 3, "axis", where)
        if np.linalg.norm(axis) < 1e-9:
            raise RobotError("has a zero axis", where, 'state its direction, as in axis="0 0 1"')
        clean.set("axis", attributes.get("axis", "0 0 1"))
        limited = attributes.get("limited", "auto")
        if limited == "auto":
            automatic = self.compiler.get("autolimits", "true") == "true"
            limited = "true" if automatic and "range" in attributes else "false"
        if limited == "true":
            lower, upper = finite(attributes.get("range", "0 0"), 2, "range", where)
            if lower > upper:
                raise RobotError("has a lower limit above its upper limit", where, "swap them")
            clean.set("limited", "true")
            clean.set("range", attributes.get("range", "0 0"))
        if "actuatorfrcrange" in attributes:
            span = finite(attributes["actuatorfrcrange"], 2, "actuatorfrcrange", where)
            if np.max(np.abs(span)) > 0.0:
                self.efforts[name] = float(np.max(np.abs(span)))
        return clean

    def _inertia(
        self, body: Element, clean: Element, name: str, childclass: str, where: str
    ) -> None:
        element = only(body, "inertial", where)
        source = self.compiler.get("inertiafromgeom", "auto")
        if element is not None and source != "true":
            self.inertials[name] = self._inertial(element.attrib, where)
            clean.append(Element("inertial", _HARMLESS))
            return
        shapes = [] if source == "false" else self._shapes(body, childclass, where)
        if not shapes:
            self.inertials[name] = absent()
            clean.append(Element("inertial", _HARMLESS))
            return
        self.inertials[name] = Inertial(np.zeros(10), "geometry")
        clean.extend(shapes)

    def _shapes(self, body: Element, childclass: str, where: str) -> list[Element]:
        shapes = []
        for geom in body.findall("geom"):
            attributes = self.defaults.attributes(geom, childclass, where)
            density = finite(attributes.get("density", "1000"), 1, "geom density", where)[0]
            if "mass" in attributes:
                density = finite(attributes["mass"], 1, "geom mass", where)[0]
            kind = attributes.get("type", "mesh" if "mesh" in attributes else "sphere")
            if density == 0.0 or kind == "plane":
                continue
            if kind not in _SHAPES or "mesh" in attributes or "shellinertia" in attributes:
                raise UnsupportedError(
                    f"has no <inertial>, and its inertia would come from a geom of type '{kind}', "
                    "which is not supported",
                    where,
                    "give the body an <inertial>",
                )
            if density < 0.0:
                raise RobotError("has a geom with negative mass or density", where)
            size = "0.1" if "fromto" in attributes else "0.1 0.1 0.1"
            sizes = (attributes.get("size") or size).split()
            if not np.all(finite(" ".join(sizes), len(sizes), "geom size", where) > 0.0):
                raise RobotError("has a geom without size", where)
            if "fromto" in attributes:
                finite(attributes["fromto"], 6, "geom fromto", where)
            self._pose(attributes, where)
            kept = {key: attributes[key] for key in _SHAPE if key in attributes}
            shapes.append(Element("geom", kept))
        return shapes

    def _inertial(self, attributes: dict[str, str], where: str) -> Inertial:
        for key in ("pos", "mass"):
            if key not in attributes:
                raise RobotError(f"has an <inertial> without {key}", where, f'add {key}="..."')
        mass = float(reals(attributes["mass"], 1, "inertial mass", where)[0])
        com = reals(attributes["pos"], 3, "inertial pos", where)
        if "fullinertia" in attributes and "diaginertia" in attributes:
            raise RobotError("has both diaginertia and fullinertia", where, "keep one")
        R = self.angles.orientation(attributes, where)
        if "fullinertia" in attributes:
            if any(key in attributes for key in _POSE[1:]):
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
        return stated(
            mass, com, R, np.diag(reals(attributes["diaginertia"], 3, "diaginertia", where))
        )
