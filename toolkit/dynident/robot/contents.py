"""What a reader of one format hands on: a harmless copy for Drake, and the inertias as written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from dynident.inertia import from_com
from dynident.robot.tree import Array
from dynident.robot.xmltree import Element


@dataclass(frozen=True, eq=False)
class Inertial:
    """The inertia of one link: phi (10,) in the link's frame, and where it comes from."""

    phi: Array
    source: str


@dataclass(frozen=True, eq=False)
class Contents:
    """A description, taken apart.

    Attributes
    ----------
    name : str
        The robot's name.
    suffix : str
        The file type by which Drake's parser knows the copy: "urdf", "sdf" or "xml".
    copy : str
        The sanitised text: kinematics only, every inertia replaced by a harmless one.
    inertials : dict
        Link name -> `Inertial`, in the order of the description.
    elements : dict
        Link name -> the element that defines the link (for patching).
    joints : tuple of str
        Names of the moving joints in the order of the description.
    efforts : dict
        Joint name -> effort limit, where the description states a positive one.
    gravity : (3,) ndarray or None
        m/s^2, in the world's axes, if the description states it.
    """

    name: str
    suffix: str
    copy: str
    inertials: dict[str, Inertial]
    elements: dict[str, Element]
    joints: tuple[str, ...]
    efforts: dict[str, float] = field(default_factory=dict)
    gravity: Array | None = None


def absent() -> Inertial:
    """Return the inertia of a link about which the description says nothing."""
    return Inertial(np.zeros(10), "absent")


def stated(mass: float, com: Array, R: Array, inertia: Array) -> Inertial:
    """Return the inertia stated as mass, centre of mass and a tensor in axes R (about the com)."""
    # An identity rotation must not cost digits (nor turn inf * 0 into NaN).
    turned = inertia if np.array_equal(R, np.eye(3)) else R @ inertia @ R.T
    with np.errstate(invalid="ignore", over="ignore"):
        return Inertial(from_com(mass, com, turned), "inertial element")


def symmetric(read: Callable[[str], float]) -> Array:
    """Return the (3, 3) tensor from a reader of its six entries "ixx" .. "izz"."""
    xx, xy, xz, yy, yz, zz = (read(name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def keep(element: Element, attributes: tuple[str, ...]) -> Element:
    """Return a childless copy of an element with only these attributes."""
    kept = {name: element.attrib[name] for name in attributes if name in element.attrib}
    return Element(element.tag, kept)


def to_text(root: Element) -> str:
    """Return the text of an element tree."""
    return ElementTree.tostring(root, encoding="unicode")
