"""What a format of robot descriptions has to offer, and the records in which it hands on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from dynident.inertia import MassProperties
from dynident.robot.formats.xmltree import Element
from dynident.robot.tree import Array


@dataclass(frozen=True, eq=False)
class Inertial:
    """The inertia of one link: phi (10,) in the link's frame, and where it comes from."""

    phi: Array
    source: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Contents:
    """A description, taken apart.

    Attributes
    ----------
    name : str
        The robot's name.
    copy : Element
        The sanitised copy: kinematics only, every stated inertia left out or replaced by 1.
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
    mimics : dict
        Joint name -> the joint that it follows, as the fingers of a gripper do.
    continuous : frozenset of str
        Names of the joints that turn without end, as the description says.
    """

    name: str
    copy: Element
    inertials: dict[str, Inertial]
    elements: dict[str, Element]
    joints: tuple[str, ...]
    efforts: dict[str, float]
    gravity: Array | None = None
    mimics: dict[str, str] = field(default_factory=dict)
    continuous: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape:
    """One visual or collision shape of a link.

    Attributes
    ----------
    link : str
    R, p : (3, 3), (3,) ndarray
        Its pose in the link's frame; p in m.
    kind : str
        "box", "sphere", "ellipsoid", "cylinder", "capsule", or "mesh".
    sizes : tuple of float
        m: the edges of a box, the radius of a sphere, the semi-axes of an ellipsoid, radius and
        length (along z, of a capsule without its caps) of the others.
    mesh : str
        URI of its file, if it is a mesh.
    scale : (3,) ndarray
        Of the mesh.
    failure : str
        Why it was not read, if it was not.
    """

    link: str
    R: Array = field(default_factory=lambda: np.eye(3))
    p: Array = field(default_factory=lambda: np.zeros(3))
    kind: str = ""
    sizes: tuple[float, ...] = ()
    mesh: str = ""
    scale: Array = field(default_factory=lambda: np.ones(3))
    failure: str = ""


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


@dataclass(frozen=True, kw_only=True)
class Format:
    """One format: all functions take the root element, and the name of the file for messages.

    Attributes
    ----------
    name : str
        As in `Description.format`.
    root : str
        Tag of the root element, by which the format is known.
    link : str
        Tag of the elements that hold an inertial element.
    drake : str
        The file type by which Drake's parser knows the format.
    files : tuple of str
        Endings of file names that promise this format.
    read : (root, where) -> Contents
        Raises RobotError, which names the link or joint that is broken or not supported.
    shapes : (root, where) -> iterator of Shape
        Those that cannot be read tell why.
    joint_dynamics : (root, where) -> iterator of JointDynamics
        In the order of the file.
    detach : root -> None
        Remove all joints from the tree of elements, so that every link can be read by itself.
    inertial_lines : (properties, root, where) -> list of str
        The inertial element that states an inertia, line by line; RobotError if there is none.
    takes_massless : bool
        Whether Drake's parser of the format takes a stated mass of zero.
    for_pinocchio : root -> None, or None
        Complete a sanitised copy by what Pinocchio's own parser demands; None if it has none.
    """

    name: str
    root: str
    link: str
    drake: str
    files: tuple[str, ...]
    read: Callable[[Element, str], Contents]
    shapes: Callable[[Element, str], Iterator[Shape]]
    joint_dynamics: Callable[[Element, str], Iterator[JointDynamics]]
    detach: Callable[[Element], None]
    inertial_lines: Callable[[MassProperties, Element, str], list[str]]
    takes_massless: bool = True
    for_pinocchio: Callable[[Element], None] | None = None
