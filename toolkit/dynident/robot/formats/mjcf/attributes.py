"""What an MJCF means by its elements: default classes, names, angles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dynident.errors import RobotError
from dynident.robot.formats.elements import from_quaternion, unit
from dynident.robot.formats.xmltree import Element, closest, reals
from dynident.robot.tree import Array

_TAGS = ("joint", "geom", "mesh")
ORIENTATIONS = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
_Classes = dict[str, dict[str, dict[str, str]]]


@dataclass(frozen=True, eq=False)
class MjcfBody:
    """A body: its name (made up where it has none), element, parent's name, and default class."""

    name: str
    element: Element
    parent: str
    childclass: str

    def joints(self) -> Iterator[tuple[str, Element]]:
        """Iterate over the names (made up where there are none) and elements of its joints."""
        found = self.element.findall("joint")
        for number, joint in enumerate(found, start=1):
            suffix = "_joint" if len(found) == 1 else f"_joint_{number}"
            yield joint.get("name") or self.name + suffix, joint


@dataclass(frozen=True, eq=False, kw_only=True)
class MjcfModel:
    """An MJCF with its settings.

    Attributes
    ----------
    root : Element
    compiler : dict
        Attributes of all compiler elements.
    classes : dict
        Default class -> element tag -> attributes, inheritance resolved.
    angle : float
        Factor from its angles to rad.
    sequence : str
        Of Euler angles: lower case turns about the axes that turn along, upper case about fixed
        ones.
    """

    root: Element
    compiler: dict[str, str]
    classes: _Classes
    angle: float
    sequence: str

    @staticmethod
    def read(root: Element, where: str) -> MjcfModel:
        """Read the settings.

        Raises
        ------
        RobotError
            If one is unknown.
        """
        compiler = compiler_of(root)
        unit = compiler.get("angle", "degree")
        if unit not in ("degree", "radian"):
            raise RobotError(f"has compiler angle '{unit}'", where, "use degree or radian")
        sequence = compiler.get("eulerseq", "xyz")
        if len(sequence) != 3 or set(sequence) - set("xyzXYZ"):
            raise RobotError(f"has compiler eulerseq '{sequence}'", where, "use three of xyzXYZ")
        return MjcfModel(
            root=root,
            compiler=compiler,
            classes=_classes(root, where),
            angle=np.pi / 180.0 if unit == "degree" else 1.0,
            sequence=sequence,
        )

    def bodies(self) -> Iterator[MjcfBody]:
        """Iterate over the bodies, each after its parent, in the order of the text."""
        count = 0

        def walk(section: Element, parent: str, inherited: str) -> Iterator[MjcfBody]:
            nonlocal count
            for element in section.findall("body"):
                count += 1
                name = element.get("name") or f"body_{count}"
                childclass = element.get("childclass") or inherited
                yield MjcfBody(name, element, parent, childclass)
                yield from walk(element, name, childclass)

        for world in self.root.findall("worldbody"):
            yield from walk(world, "", world.get("childclass") or "main")

    def attributes(self, element: Element, childclass: str, where: str) -> dict[str, str]:
        """Return an element's attributes with those of its default class filled in.

        Parameters
        ----------
        element : Element
            A joint, geom or mesh.
        childclass : str
            The class of its body, which holds where it names none.
        where : str
            For messages.

        Raises
        ------
        RobotError
            If there is no such class.
        """
        name = element.get("class") or childclass
        if name not in self.classes:
            raise RobotError(
                f"uses an unknown default class '{name}'", where, closest(name, self.classes)
            )
        return {**self.classes[name][element.tag], **element.attrib}

    def orientation(self, attributes: dict[str, str], where: str) -> Array:
        """Return the (3, 3) orientation stated by quat, axisangle, xyaxes, zaxis or euler.

        NaN passes into the result.

        Raises
        ------
        RobotError
            If a direction has length zero, or there are two statements.
        """
        given = [name for name in ORIENTATIONS if name in attributes]
        if not given:
            return np.eye(3)
        if len(given) > 1:
            raise RobotError(
                f"states its orientation twice ({' and '.join(given)})", where, "keep one"
            )
        kind = given[0]
        values = reals(attributes[kind], ORIENTATIONS[kind], kind, where)
        directions = []
        if kind == "xyaxes":
            directions = [values[:3], values[3:], np.cross(values[:3], values[3:])]
        elif kind != "euler":
            directions = [values[:3] if kind == "axisangle" else values]
        if any(np.max(np.abs(direction)) < 1e-12 for direction in directions):
            raise RobotError(f"{kind} = '{attributes[kind]}' has no direction", where)
        if kind == "quat":
            return from_quaternion(values)
        if kind == "axisangle":
            return Rotation.from_rotvec(values[3] * self.angle * unit(values[:3])).as_matrix()
        if kind == "xyaxes":
            x, _, z = (unit(direction) for direction in directions)
            return np.column_stack([x, np.cross(z, x), z])
        if kind == "zaxis":
            return from_z(values)
        R = np.eye(3)
        for axis, value in zip(self.sequence, values * self.angle, strict=True):
            turn = Rotation.from_euler(axis.lower(), value).as_matrix()
            R = R @ turn if axis.islower() else turn @ R
        return R


def compiler_of(root: Element) -> dict[str, str]:
    """Return the attributes of all compiler elements."""
    return {k: v for element in root.findall("compiler") for k, v in element.attrib.items()}


def from_z(z: Array) -> Array:
    """Return the shortest turn (3, 3) that brings the z axis to this direction (3,)."""
    z = unit(z)
    axis = np.cross([0.0, 0.0, 1.0], z)
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return Rotation.from_rotvec(np.arctan2(length, z[2]) * axis / length).as_matrix()


def _classes(root: Element, where: str) -> _Classes:
    """Return the default classes of all <default> sections."""
    classes: _Classes = {"main": {tag: {} for tag in _TAGS}}

    def add(section: Element, names: set[str], inherited: dict[str, dict[str, str]]) -> None:
        settings = {tag: dict(inherited[tag]) for tag in _TAGS}
        for tag in _TAGS:
            for element in section.findall(tag):
                settings[tag].update(element.attrib)
        classes.update(dict.fromkeys(names, settings))
        for child in section.findall("default"):
            if not child.get("class"):
                raise RobotError("has a nested <default> without a class", where, "name its class")
            add(child, {child.attrib["class"]}, settings)

    for section in root.findall("default"):
        # The outermost class may have a name of its own.
        add(section, {"main", section.get("class") or "main"}, classes["main"])
    return classes
