"""Shapes as an MJCF states them, and the harmless copy; see `shapes`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

import numpy as np

from dynident.errors import DynidentError
from dynident.robot.mjcf_defaults import Angles, Defaults
from dynident.robot.shapes import NotRead, Shape, mesh_scale, numbers, sizes_text, used
from dynident.robot.xmltree import Element

_ORIENTATION = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_MJCF = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}


def read_mjcf(root: Element, where: str) -> Iterator[Shape]:
    """Iterate over the shapes of an MJCF."""
    defaults = Defaults.read(root, where)
    compiler: dict[str, str] = {}
    for element in root.findall("compiler"):
        compiler.update(element.attrib)
    angles = Angles.read(compiler, where)
    assets = {
        mesh.get("name") or PurePosixPath(mesh.get("file") or "").stem: defaults.attributes(
            mesh, "main", where
        )
        for section in root.findall("asset")
        for mesh in section.findall("mesh")
    }
    meshes = _Meshes(assets, compiler.get("meshdir") or compiler.get("assetdir") or "")
    count = 0

    def walk(section: Element, childclass: str) -> Iterator[Shape]:
        nonlocal count
        for body in section.findall("body"):
            count += 1
            name = body.get("name") or f"body_{count}"
            own = body.get("childclass") or childclass
            for geom in body.findall("geom"):
                try:
                    attributes = defaults.attributes(geom, own, where)
                    yield _mjcf_shape(Shape(name, ""), attributes, meshes, angles)
                except NotRead as failure:
                    yield Shape(name, "", failure=str(failure))
                except DynidentError as error:
                    yield Shape(name, "", failure=error.what)
            yield from walk(body, own)

    for world in root.findall("worldbody"):
        yield from walk(world, world.get("childclass") or "main")


@dataclass(frozen=True, eq=False)
class _Meshes:
    assets: dict[str, dict[str, str]]
    folder: str

    def place(self, shape: Shape, name: str) -> Shape:
        asset = self.assets.get(name)
        if not asset or not asset.get("file"):
            raise NotRead(f"mesh {name}: has no file")
        if "refpos" in asset or "refquat" in asset:
            raise NotRead(f"mesh {name}: has a reference frame of its own")
        file = asset["file"]
        path = f"{self.folder.rstrip('/')}/{file}" if self.folder else file
        return replace(shape, mesh=path, scale=mesh_scale(asset.get("scale")))


def _mjcf_shape(shape: Shape, attributes: dict[str, str], meshes: _Meshes, angles: Angles) -> Shape:
    kind = attributes.get("type", "mesh" if "mesh" in attributes else "sphere")
    copy = Element("geom", {"type": kind})
    shape = replace(shape, element=copy)
    if "pos" in attributes:
        numbers(attributes["pos"], 3, "geom pos")
    if not np.all(np.isfinite(angles.orientation(attributes, ""))):
        raise NotRead("a geom whose orientation is not finite")
    for key in ("pos", *_ORIENTATION):
        if key in attributes:
            copy.set(key, attributes[key])
    if kind == "mesh":
        copy.set("type", "sphere")
        copy.set("size", "0.1")
        return meshes.place(shape, attributes.get("mesh", ""))
    if kind not in _MJCF or "mesh" in attributes:
        raise NotRead(f"shape '{kind}'" + (" fitted to a mesh" if "mesh" in attributes else ""))
    needed = _MJCF[kind]
    if "fromto" in attributes:
        ends = numbers(attributes["fromto"], 6, "geom fromto")
        if np.linalg.norm(ends[3:] - ends[:3]) < 1e-9:
            raise NotRead("geom fromto without length")
        copy.set("fromto", attributes["fromto"])
        needed = 2 if kind in ("ellipsoid", "box") else 1
    words = attributes.get("size", "").split()
    copy.set("size", sizes_text(" ".join(words[:needed]), needed, f"{kind} size"))
    return shape


def write_mjcf(root: Element, shapes: tuple[Shape, ...]) -> Element:
    """Return the copy of an MJCF that has the shapes alone."""
    copy = Element("mujoco", {"model": "shapes"})
    settings: dict[str, str] = {}
    for element in root.findall("compiler"):
        settings.update({k: v for k, v in element.attrib.items() if k in ("angle", "eulerseq")})
    copy.append(Element("compiler", settings))
    world = Element("worldbody")
    copy.append(world)
    bodies: dict[str, Element] = {}
    for shape, element in used(shapes):
        if shape.link not in bodies:
            bodies[shape.link] = Element("body", {"name": f"link{len(bodies)}"})
            harmless = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
            bodies[shape.link].append(Element("inertial", harmless))
            world.append(bodies[shape.link])
        bodies[shape.link].append(element)
    return copy
