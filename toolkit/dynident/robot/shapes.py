"""Shapes as a URDF or SDF states them, and a harmless copy that has nothing else.

In the copy every link is a body of its own, under a name of ours: only poses in the link's frame
matter. A shape that cannot be used is kept out of it, with the reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from dynident.errors import DynidentError
from dynident.robot.contents import keep
from dynident.robot.tree import Array
from dynident.robot.xmltree import Element, finite

_LARGEST = 1e6
"""m: what is larger is no part of a robot, and may overflow a parser."""


class NotRead(Exception):
    """Why a shape was not read."""


@dataclass(frozen=True, eq=False)
class Shape:
    """One shape of a link.

    Attributes
    ----------
    link : str
    name : str
        Of the shape in the copy.
    mesh : str
        URI of its file, if it is a mesh.
    scale : (3,) ndarray
        Of the mesh.
    failure : str
        Why it is not in the copy, if it is not.
    element : Element or None
        What stands in the copy.
    """

    link: str
    name: str
    mesh: str = ""
    scale: Array = field(default_factory=lambda: np.ones(3))
    failure: str = ""
    element: Element | None = None


def used(shapes: tuple[Shape, ...]) -> Iterator[tuple[Shape, Element]]:
    """Iterate over the shapes that stand in the copy, named."""
    for shape in shapes:
        if shape.element is not None:
            shape.element.set("name", shape.name)
            yield shape, shape.element


def sizes_text(text: str | None, count: int, what: str) -> str:
    """Return positive sizes as they are to be written."""
    values = numbers(text, count, what)
    bad = values[~((values > 0.0) & (values <= _LARGEST))]
    if len(bad):
        raise NotRead(f"{what} = {bad[0]:g}" + (" is not positive" if bad[0] <= 0.0 else " m"))
    return " ".join(repr(float(value)) for value in values)


def numbers(text: str | None, count: int, what: str) -> Array:
    """Return finite numbers of the size of a robot."""
    try:
        values = finite(text, count, what, "")
    except DynidentError as error:
        raise NotRead(error.what) from None
    if not np.all(np.abs(values) <= _LARGEST):
        raise NotRead(f"{what} is beyond {_LARGEST:g} m")
    return values


# --- URDF ---------------------------------------------------------------------------------------


def read_urdf(root: Element, where: str) -> Iterator[Shape]:
    """Iterate over the shapes of a URDF."""
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                shape = Shape(link.get("name") or "", "")
                try:
                    yield _urdf_shape(shape, element)
                except NotRead as failure:
                    yield replace(shape, failure=str(failure))


_URDF = {
    "box": (("size", 3),),
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "ellipsoid": (("a", 1), ("b", 1), ("c", 1)),
}


def _urdf_shape(shape: Shape, element: Element) -> Shape:
    copy = Element("collision")
    origin = element.find("origin")
    if origin is not None:
        for key in ("xyz", "rpy"):
            if key in origin.attrib:
                numbers(origin.get(key), 3, f"origin {key}")
        copy.append(keep(origin, ("xyz", "rpy")))
    found = [kind for geometry in element.findall("geometry") for kind in geometry]
    if not found:
        raise NotRead("a shape without geometry")
    kind = found[0].tag.removeprefix("drake:")
    geometry = Element("geometry")
    copy.append(geometry)
    if kind == "mesh":
        uri = found[0].get("filename") or ""
        scale = mesh_scale(found[0].get("scale"))
        geometry.append(Element("sphere", {"radius": "0.1"}))
        return replace(shape, mesh=uri or "without a file", scale=scale, element=copy)
    if kind not in _URDF:
        raise NotRead(f"shape '{kind}'")
    prefix = "drake:" if kind in ("capsule", "ellipsoid") else ""
    sizes = {key: sizes_text(found[0].get(key), n, f"{kind} {key}") for key, n in _URDF[kind]}
    geometry.append(Element(prefix + kind, sizes))
    return replace(shape, element=copy)


def mesh_scale(text: str | None) -> Array:
    """Return the scale (3,) of a mesh; one number stands for three."""
    words = (text or "1 1 1").split()
    return numbers(" ".join(words * (3 if len(words) == 1 else 1)), 3, "mesh scale")


def write_urdf(root: Element, shapes: tuple[Shape, ...]) -> Element:
    """Return the copy of a URDF that has the shapes alone."""
    copy = Element("robot", {"name": "shapes"})
    links: dict[str, Element] = {}
    for shape, element in used(shapes):
        if shape.link not in links:
            links[shape.link] = Element("link", {"name": f"link{len(links)}"})
            copy.append(links[shape.link])
        links[shape.link].append(element)
    return copy


# --- SDF ----------------------------------------------------------------------------------------

_SDF = {
    "box": (("size", 3),),
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "ellipsoid": (("radii", 3),),
}


def read_sdf(root: Element, where: str) -> Iterator[Shape]:
    """Iterate over the shapes of an SDF."""
    for link in root.iter("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                shape = Shape(link.get("name") or "", "")
                try:
                    read = _sdf_shape(shape, element)
                except NotRead as failure:
                    read = replace(shape, failure=str(failure))
                if read is not None:
                    yield read


def _sdf_shape(shape: Shape, element: Element) -> Shape | None:
    copy = Element("collision")
    pose = element.find("pose")
    if pose is not None and (pose.text or "").strip():
        if pose.get("relative_to") not in (None, "", shape.link):
            raise NotRead("a shape whose pose is relative to another frame")
        count = 7 if pose.get("rotation_format") == "quat_xyzw" else 6
        values = numbers(pose.text, count, "pose")
        if count == 7 and np.linalg.norm(values[3:]) < 1e-6:
            raise NotRead("pose without an orientation")
        own = keep(pose, ("degrees", "rotation_format"))
        own.text = pose.text
        copy.append(own)
    found = [kind for geometry in element.findall("geometry") for kind in geometry]
    if not found:
        raise NotRead("a shape without geometry")
    kind = found[0].tag
    if kind == "empty":
        return None
    geometry = Element("geometry")
    copy.append(geometry)
    if kind == "mesh":
        uri = (found[0].findtext("uri") or "").strip()
        geometry.append(_sdf_element("sphere", {"radius": "0.1"}))
        scale = mesh_scale(found[0].findtext("scale"))
        return replace(shape, mesh=uri or "without a file", scale=scale, element=copy)
    if kind not in _SDF:
        raise NotRead(f"shape '{kind}'")
    sizes = {key: sizes_text(found[0].findtext(key), n, f"{kind} {key}") for key, n in _SDF[kind]}
    geometry.append(_sdf_element(kind, sizes))
    return replace(shape, element=copy)


def _sdf_element(kind: str, sizes: dict[str, str]) -> Element:
    element = Element(kind)
    for key, text in sizes.items():
        entry = Element(key)
        entry.text = text
        element.append(entry)
    return element


def write_sdf(root: Element, shapes: tuple[Shape, ...]) -> Element:
    """Return the copy of an SDF that has the shapes alone."""
    copy = keep(root, ("version",))
    model = Element("model", {"name": "shapes"})
    copy.append(model)
    model.extend(write_urdf(root, shapes))
    return copy
