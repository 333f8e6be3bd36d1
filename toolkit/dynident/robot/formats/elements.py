"""Pieces from which the formats build their readers: inertias, limits, shapes, joint dynamics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dynident.errors import DynidentError, RobotError, UnsupportedError
from dynident.inertia import MassProperties, from_com
from dynident.robot.formats.format import Inertial, JointDynamics, Shape
from dynident.robot.formats.xmltree import Element, finite, only, reals
from dynident.robot.tree import Array

MOVING = ("revolute", "continuous", "prismatic")
LIMITS = ("lower", "upper", "velocity", "effort")
_LARGEST = 1e6
"""m: what is larger is no part of a robot."""


def keep(element: Element, attributes: tuple[str, ...]) -> Element:
    """Return a childless copy of an element with only these attributes."""
    return Element(
        element.tag, {key: element.attrib[key] for key in attributes if key in element.attrib}
    )


def named(root: Element, tag: str, where: str) -> dict[str, Element]:
    """Return the children of an element by their names, in order.

    Parameters
    ----------
    root : Element
    tag : str
        Of the children.
    where : str
        For messages.

    Raises
    ------
    RobotError
        If one has no name, or the name of another.
    """
    found: dict[str, Element] = {}
    for element in root.findall(tag):
        name = element.get("name")
        if not name:
            raise RobotError(f"has a {tag} without a name", where, "give it one")
        if name in found:
            raise RobotError(f"has two {tag}s named '{name}'", where, "rename one of them")
        found[name] = element
    return found


def mimics_of(joints: Mapping[str, Element], place: str) -> dict[str, str]:
    """Return the moving joints that follow another one, and which.

    Parameters
    ----------
    joints : dict
        Name -> element of a joint.
    place : str
        Where in it the element `<mimic joint="...">` is.
    """
    found = {}
    for name, joint in joints.items():
        mimic = joint.find(f"{place}/mimic")
        if mimic is not None and joint.get("type") in MOVING:
            found[name] = mimic.get("joint", "")
    return found


def continuous_of(joints: Mapping[str, Element]) -> frozenset[str]:
    """Return the names of the joints that turn without end.

    Parameters
    ----------
    joints : dict
        Name -> element of a joint.
    """
    return frozenset(name for name, one in joints.items() if one.get("type") == "continuous")


def refuse_closed_chains(joints: Iterable[tuple[str, str, str]], where: str) -> dict[str, str]:
    """Return child -> parent, of joints as (name, parent, child).

    Raises
    ------
    RobotError
        If a link has two parents, or is its own ancestor.
    """
    remedy = "cut the loop by removing one of the joints"
    parents: dict[str, str] = {}
    for joint, parent, child in joints:
        if child in parents:
            raise UnsupportedError(
                f"has a second parent, by joint '{joint}': closed chains are not supported",
                f"{where}: link '{child}'",
                remedy,
            )
        parents[child] = parent
    rooted: set[str] = set()  # links from which the way up is known to end
    for name in parents:
        way: dict[str, None] = {}
        while name in parents and name not in rooted:
            way[name] = None
            name = parents[name]
            if name in way:
                what = "is its own ancestor: closed chains are not supported"
                raise UnsupportedError(what, f"{where}: link '{name}'", remedy)
        rooted.update(way)
    return parents


def limits(
    stated: Mapping[str, str], kind: str, where: str, unlimited: float = np.inf
) -> dict[str, float]:
    """Return the limits of a joint that are some.

    Parameters
    ----------
    stated : mapping
        The texts of "lower", "upper", "velocity" and "effort", as far as they are stated.
    kind : str
        A "continuous" joint has no position limits, whatever the description says.
    where : str
        The joint, for messages.
    unlimited : float
        From this magnitude on, a limit is a way of saying "none", as are speeds and efforts that
        are not positive.

    Raises
    ------
    RobotError
        If a limit is no number or NaN, or the lower one is above the upper one.
    """
    values: dict[str, float] = {}
    for key in LIMITS:
        if key not in stated:
            continue
        values[key] = float(reals(stated[key], 1, f"limit {key}", where)[0])
        if np.isnan(values[key]):
            raise RobotError(f"limit {key} is NaN", where)
    if kind == "continuous":
        values = {key: values[key] for key in values if key not in ("lower", "upper")}
    if values.get("lower", -np.inf) > values.get("upper", np.inf):
        raise RobotError("has a lower limit above its upper limit", where, "swap them")
    return {
        key: value
        for key, value in values.items()
        if abs(value) < unlimited and (key in ("lower", "upper") or value > 0.0)
    }


# --- inertias -----------------------------------------------------------------------------------


def absent() -> Inertial:
    """Return the inertia of a link about which the description says nothing."""
    return Inertial(np.zeros(10), "absent")


def stated(mass: float, com: Array, R: Array, inertia: Array) -> Inertial:
    """Return the inertia stated as mass, centre of mass and a tensor in axes R (about the com).

    Parameters
    ----------
    mass : float
        kg.
    com : (3,) ndarray
        m, in the link's frame.
    R : (3, 3) ndarray
        Orientation of the tensor's axes in the link's frame.
    inertia : (3, 3) ndarray
        kg m^2. NaN, infinite and negative values pass.
    """
    # An identity rotation must not cost digits (nor turn inf * 0 into NaN).
    turned = inertia if np.array_equal(R, np.eye(3)) else R @ inertia @ R.T
    with np.errstate(invalid="ignore", over="ignore"):
        return Inertial(from_com(mass, com, turned), "inertial element")


def required(inertial: Element, where: str, example: str) -> tuple[Element, Element]:
    """Return the <mass> and the <inertia> of an inertial element.

    Parameters
    ----------
    inertial : Element
    where : str
        The link, for messages.
    example : str
        How the format states a mass.

    Returns
    -------
    The <mass>, and the <inertia>.

    Raises
    ------
    RobotError
        If one is absent, or there are two.
    """
    mass, tensor = only(inertial, "mass", where), only(inertial, "inertia", where)
    if mass is None:
        raise RobotError("has an <inertial> without <mass>", where, f"add {example}")
    if tensor is None:
        raise RobotError("has an <inertial> without <inertia>", where, "zeros make a point mass")
    return mass, tensor


def symmetric(read: Callable[[str], float | None]) -> Array:
    """Return the (3, 3) tensor from a reader of its six entries "ixx" .. "izz"."""
    xx, xy, xz, yy, yz, zz = (read(name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)


def digits(properties: MassProperties) -> tuple[str, str, dict[str, str]]:
    """Return mass, centre of mass and the six moments with all their digits."""
    inertia = properties.inertia_com
    moments = {
        f"i{'xyz'[i]}{'xyz'[j]}": repr(float(inertia[i, j])) for i in range(3) for j in range(i, 3)
    }
    return repr(properties.mass), " ".join(repr(float(x)) for x in properties.com), moments


# --- orientations -------------------------------------------------------------------------------


def from_rpy(rpy: Array) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll), angles in rad; NaN passes."""
    return Rotation.from_euler("xyz", rpy).as_matrix()


def unit(vector: Array) -> Array:
    """Return a vector at length 1, however large or small it is; NaN if it has no direction."""
    largest = np.max(np.abs(vector))
    if not 0.0 < largest < np.inf:
        return np.full_like(vector, np.nan)
    return vector / largest / np.linalg.norm(vector / largest)


def from_quaternion(wxyz: Array) -> Array:
    """Return the rotation of a quaternion (w, x, y, z), normalised first; see `unit`."""
    wxyz = unit(wxyz)
    if np.any(np.isnan(wxyz)):  # which SciPy takes for a norm of zero, and refuses
        return np.full((3, 3), np.nan)
    return Rotation.from_quat(wxyz, scalar_first=True).as_matrix()


# --- shapes -------------------------------------------------------------------------------------

_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
}


@dataclass(frozen=True)
class ShapeWords:
    """How a format states shapes.

    Attributes
    ----------
    text : (element, key) -> str or None
        How it states a number.
    mesh : str
        Key of a mesh's address.
    ellipsoid : dict
        Keys of an ellipsoid's semi-axes, and how many numbers each has.
    """

    text: Callable[[Element, str], str | None]
    mesh: str
    ellipsoid: dict[str, int]

    def solid(self, element: Element) -> dict[str, Any]:
        """Return kind, sizes, mesh and scale of the shape under a visual or collision element.

        Raises
        ------
        RobotError
            If there is none, or it is of another kind, or broken.
        """
        found = [kind for geometry in element.findall("geometry") for kind in geometry]
        if not found:
            raise RobotError("a shape without geometry")
        kind = found[0].tag.removeprefix("drake:")
        if kind == "mesh":
            uri = (self.text(found[0], self.mesh) or "").strip() or "without a file"
            return {"kind": kind, "mesh": uri, "scale": mesh_scale(self.text(found[0], "scale"))}
        keys = {**_SIZES, "ellipsoid": self.ellipsoid}.get(kind)
        if keys is None:
            raise RobotError(f"shape '{kind}'")
        lengths = (sizes(self.text(found[0], key), n, f"{kind} {key}") for key, n in keys.items())
        return {"kind": kind, "sizes": tuple(size for some in lengths for size in some)}


def readable_shapes(
    elements: Iterable[tuple[str, Element]], read: Callable[[str, Element], Shape]
) -> Iterator[Shape]:
    """Iterate over the shapes of (link, element); what cannot be read becomes a failure."""
    for link, element in elements:
        try:
            yield read(link, element)
        except DynidentError as error:
            yield Shape(link=link, failure=error.what)


def bounded(text: str | None, count: int, what: str) -> Array:
    """Read finite numbers, none beyond 1e6 m.

    Parameters
    ----------
    text, count, what
        As in `finite`.

    Returns
    -------
    (count,)

    Raises
    ------
    RobotError
        Without a place: shapes that cannot be read are collected.
    """
    values = finite(text, count, what, "")
    if not np.all(np.abs(values) <= _LARGEST):
        raise RobotError(f"{what} is beyond {_LARGEST:g} m")
    return values


def sizes(text: str | None, count: int, what: str) -> tuple[float, ...]:
    """Read positive lengths, m.

    Parameters
    ----------
    text, count, what
        As in `bounded`.

    Returns
    -------
    `count` of them.

    Raises
    ------
    RobotError
        Likewise.
    """
    values = bounded(text, count, what)
    for bad in values[~(values > 0.0)]:
        raise RobotError(f"{what} = {bad:g} is not positive")
    return tuple(float(value) for value in values)


def mesh_scale(text: str | None) -> Array:
    """Return the scale (3,) of a mesh; one number stands for three."""
    words = (text or "1 1 1").split()
    return bounded(" ".join(words * (3 if len(words) == 1 else 1)), 3, "mesh scale")


# --- joint dynamics -----------------------------------------------------------------------------

_UNITS = {
    "damping": ("N m s/rad", "N s/m"),
    "friction": ("N m", "N"),
    "rotor inertia": ("kg m^2", "kg"),
}


def stated_dynamics(
    joint: str, kind: str | None, quantity: str, text: str | None, where: str
) -> JointDynamics:
    """Return what a description states of a joint's dynamics.

    Parameters
    ----------
    joint, kind : str
        Name and type of the joint.
    quantity : str
        "damping", "friction" or "rotor inertia".
    text : str or None
        As it is written.
    where : str
        The file, for messages.

    Raises
    ------
    RobotError
        If the text is not a number.
    """
    words = (text or "").split()
    # MuJoCo reads further numbers as coefficients of higher powers of the speed.
    values = reals(text, max(1, len(words)), quantity, f"{where}: joint '{joint}'")
    broken = values[~(values >= 0.0)]
    unit = _UNITS[quantity][kind in ("prismatic", "slide")]
    return JointDynamics(joint, quantity, float(broken[0] if len(broken) else values[0]), unit)


def rotors(element: Element, joint: str, kind: str | None, where: str) -> Iterator[JointDynamics]:
    """Iterate over the rotor inertias below an element, which Drake states as an extension.

    Parameters
    ----------
    element : Element
        A joint or a transmission.
    joint, kind, where
        As in `stated_dynamics`.

    Yields
    ------
    One for each that is stated.
    """
    for rotor in element.iter("drake:rotor_inertia"):
        # Both ways of stating a number: an attribute, and the element's text.
        text = rotor.get("value", rotor.text)
        yield stated_dynamics(joint, kind, "rotor inertia", text, where)
