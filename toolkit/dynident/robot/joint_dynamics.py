"""What a description says of friction, damping and rotor inertia at its joints.

`Robot` does not hold these: in a model they are effects. They are read for a check.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dynident.robot.mjcf_defaults import Defaults
from dynident.robot.tree import Description
from dynident.robot.xmltree import Element, parse, reals


@dataclass(frozen=True)
class JointDynamics:
    """One number that a description states of a joint.

    Attributes
    ----------
    joint : str
    quantity : str
        "damping", "friction" or "rotor inertia".
    value : float
        As it is written, NaN and negative values included.
    unit : str
        SI, of a turning or a sliding joint.
    """

    joint: str
    quantity: str
    value: float
    unit: str


_UNITS = {
    "damping": ("N m s/rad", "N s/m"),
    "friction": ("N m", "N"),
    "rotor inertia": ("kg m^2", "kg"),
}
_ROTOR = "drake:rotor_inertia"


def joint_dynamics(description: Description) -> tuple[JointDynamics, ...]:
    """Return what a description states of its joints' dynamics, in the order of the file.

    URDF: `<dynamics damping friction>` and `drake:rotor_inertia`; SDF: `<axis><dynamics>` and
    `drake:rotor_inertia`; MJCF: damping, frictionloss and armature, default classes applied.

    Raises
    ------
    RobotError
        If a value is not a number.
    """
    root = parse(description.text, description.path).root
    return tuple(_READERS[description.format](root, description.path))


def _stated(
    joint: str, kind: str | None, quantity: str, text: str | None, where: str
) -> JointDynamics:
    words = (text or "").split()
    # MuJoCo reads further numbers as coefficients of higher powers of the speed.
    values = reals(text, max(1, len(words)), quantity, f"{where}: joint '{joint}'")
    broken = values[~(values >= 0.0)]
    unit = _UNITS[quantity][kind in ("prismatic", "slide")]
    return JointDynamics(joint, quantity, float(broken[0] if len(broken) else values[0]), unit)


def _urdf(root: Element, where: str) -> Iterator[JointDynamics]:
    kinds: dict[str, str | None] = {}
    for joint in root.findall("joint"):
        name, kind = joint.get("name") or "", joint.get("type")
        kinds[name] = kind
        for dynamics in joint.findall("dynamics"):
            for quantity in ("damping", "friction"):
                if quantity in dynamics.attrib:
                    yield _stated(name, kind, quantity, dynamics.get(quantity), where)
        for element in joint.findall(_ROTOR):
            yield _stated(name, kind, "rotor inertia", _number(element), where)
    for transmission in root.findall("transmission"):
        carrier = transmission.find("joint")
        name = "" if carrier is None else carrier.get("name") or ""
        for element in transmission.iter(_ROTOR):
            yield _stated(name, kinds.get(name), "rotor inertia", _number(element), where)


def _number(element: Element) -> str | None:
    """Both ways of stating a number: an attribute, and the element's text."""
    return element.get("value", element.text)


def _sdf(root: Element, where: str) -> Iterator[JointDynamics]:
    for joint in root.iter("joint"):
        name, kind = joint.get("name") or "", joint.get("type")
        for axis in (*joint.findall("axis"), *joint.findall("axis2")):
            for quantity in ("damping", "friction"):
                for element in axis.findall(f"dynamics/{quantity}"):
                    yield _stated(name, kind, quantity, element.text, where)
        for element in joint.findall(_ROTOR):
            yield _stated(name, kind, "rotor inertia", _number(element), where)


_MJCF = {"damping": "damping", "frictionloss": "friction", "armature": "rotor inertia"}


def _mjcf(root: Element, where: str) -> Iterator[JointDynamics]:
    defaults = Defaults.read(root, where)
    count = 0

    def walk(body: Element, childclass: str) -> Iterator[JointDynamics]:
        nonlocal count
        if body.tag == "body":
            count += 1  # nameless bodies and joints are named as the reader names them
        childclass = body.get("childclass") or childclass
        joints = body.findall("joint")
        for index, joint in enumerate(joints, start=1):
            suffix = "joint" if len(joints) == 1 else f"joint_{index}"
            name = joint.get("name") or f"{body.get('name') or f'body_{count}'}_{suffix}"
            attributes = defaults.attributes(joint, childclass, where)
            for key, quantity in _MJCF.items():
                if key in attributes:
                    kind = attributes.get("type")
                    yield _stated(name, kind, quantity, attributes[key], where)
        for child in body.findall("body"):
            yield from walk(child, childclass)

    for section in root.findall("worldbody"):
        yield from walk(section, "main")


_READERS = {"urdf": _urdf, "sdf": _sdf, "mjcf": _mjcf}


def carries_rotor(dynamics: tuple[JointDynamics, ...]) -> frozenset[str]:
    """Return the joints that have a rotor inertia of their own."""
    return frozenset(
        one.joint
        for one in dynamics
        if one.quantity == "rotor inertia" and np.isfinite(one.value) and one.value > 0.0
    )
