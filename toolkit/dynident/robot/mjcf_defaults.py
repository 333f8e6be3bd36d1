"""Attributes of MJCF elements once the default classes are applied, and orientations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.errors import RobotError
from dynident.robot.rotations import about, from_axis_angle, from_quaternion
from dynident.robot.tree import Array
from dynident.robot.xmltree import Element, closest, reals

_TAGS = ("joint", "geom", "mesh")
_ORIENTATIONS = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}


@dataclass(frozen=True)
class Defaults:
    """Default classes: name -> element tag -> attributes, inheritance resolved."""

    classes: dict[str, dict[str, dict[str, str]]]

    @staticmethod
    def read(root: Element, where: str) -> Defaults:
        """Collect the classes of all <default> sections."""
        classes: dict[str, dict[str, dict[str, str]]] = {"main": {tag: {} for tag in _TAGS}}

        def walk(section: Element, inherited: dict[str, dict[str, str]], outermost: bool) -> None:
            name = section.get("class") or ("main" if outermost else "")
            if not name:
                raise RobotError("has a nested <default> without a class", where, "name its class")
            known = classes.get(name, {}) if outermost else {}
            settings = {tag: {**inherited[tag], **known.get(tag, {})} for tag in _TAGS}
            for tag in _TAGS:
                for element in section.findall(tag):
                    settings[tag].update(element.attrib)
            classes[name] = settings
            if outermost:
                classes["main"] = settings
            for child in section.findall("default"):
                walk(child, settings, False)

        for section in root.findall("default"):
            walk(section, classes["main"], True)
        return Defaults(classes)

    def attributes(self, element: Element, childclass: str, where: str) -> dict[str, str]:
        """Return an element's attributes with those of its class filled in."""
        name = element.get("class") or childclass
        if name not in self.classes:
            raise RobotError(
                f"uses an unknown default class '{name}'", where, closest(name, self.classes)
            )
        return {**self.classes[name][element.tag], **element.attrib}


@dataclass(frozen=True)
class Angles:
    """How the compiler element reads angles: factor to rad, and the sequence of Euler angles."""

    factor: float
    sequence: str

    @staticmethod
    def read(compiler: dict[str, str], where: str) -> Angles:
        """Read `angle` and `eulerseq` of the compiler element."""
        unit = compiler.get("angle", "degree")
        if unit not in ("degree", "radian"):
            raise RobotError(f"has compiler angle '{unit}'", where, "use degree or radian")
        sequence = compiler.get("eulerseq", "xyz")
        if len(sequence) != 3 or set(sequence) - set("xyzXYZ"):
            raise RobotError(f"has compiler eulerseq '{sequence}'", where, "use three of xyzXYZ")
        return Angles(np.pi / 180.0 if unit == "degree" else 1.0, sequence)

    def orientation(self, attributes: dict[str, str], where: str) -> Array:
        """Return the (3, 3) orientation stated by quat, axisangle, xyaxes, zaxis or euler.

        NaN passes into the result; a direction of length zero, or two statements, are refused.
        """
        given = [name for name in _ORIENTATIONS if name in attributes]
        if not given:
            return np.eye(3)
        if len(given) > 1:
            raise RobotError(
                f"states its orientation twice ({' and '.join(given)})", where, "keep one"
            )
        kind = given[0]
        values = reals(attributes[kind], _ORIENTATIONS[kind], kind, where)
        directions = []
        if kind == "xyaxes":
            directions = [values[:3], values[3:], np.cross(values[:3], values[3:])]
        elif kind != "euler":
            directions = [values[:3] if kind == "axisangle" else values]
        if any(np.linalg.norm(direction) < 1e-12 for direction in directions):
            raise RobotError(f"{kind} = '{attributes[kind]}' has no direction", where)
        if kind == "quat":
            return from_quaternion(values)
        if kind == "axisangle":
            return from_axis_angle(values[:3], values[3] * self.factor)
        if kind == "xyaxes":
            return _from_xy(values[:3], values[3:])
        if kind == "zaxis":
            return _from_z(values)
        R = np.eye(3)
        for axis, angle in zip(self.sequence, values * self.factor, strict=True):
            # Lower case turns about the axes that turn along, upper case about fixed ones.
            turn = about(axis.lower(), angle)
            R = R @ turn if axis.islower() else turn @ R
        return R


def _from_xy(x: Array, y: Array) -> Array:
    x = x / np.linalg.norm(x)
    y = y - (x @ y) * x
    y = y / np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def _from_z(z: Array) -> Array:
    """The shortest turn that brings the z axis to this direction."""
    z = z / np.linalg.norm(z)
    axis = np.cross([0.0, 0.0, 1.0], z)
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return from_axis_angle(axis, float(np.arctan2(length, z[2])))
