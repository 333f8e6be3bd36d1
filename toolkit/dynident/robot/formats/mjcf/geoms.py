"""Geoms of an MJCF: as shapes, and as what gives a body its inertia."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

import numpy as np

from dynident.errors import DynidentError, RobotError, UnsupportedError
from dynident.robot.formats.elements import bounded, mesh_scale, sizes
from dynident.robot.formats.format import Shape
from dynident.robot.formats.mjcf.attributes import (
    ORIENTATIONS,
    MjcfBody,
    MjcfModel,
    from_z,
)
from dynident.robot.formats.xmltree import Element, finite

_SIZES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
_POSE = ("pos", *ORIENTATIONS)
_HEAVY = ("type", "size", "fromto", "mass", "density", *_POSE)


def _kind(attributes: dict[str, str]) -> str:
    return attributes.get("type", "mesh" if "mesh" in attributes else "sphere")


def sanitised_pose(model: MjcfModel, attributes: dict[str, str], where: str) -> dict[str, str]:
    """Return the attributes that state a pose.

    Parameters
    ----------
    model : MjcfModel
    attributes : dict
        Of a body or a geom.
    where : str
        For messages.

    Raises
    ------
    RobotError
        If the pose is no number, not finite, or stated twice.
    """
    finite(attributes.get("pos", "0 0 0"), 3, "pos", where)
    if not np.all(np.isfinite(model.orientation(attributes, where))):
        raise RobotError("has an orientation that is not finite", where)
    return {key: attributes[key] for key in _POSE if key in attributes}


def heavy_geoms(model: MjcfModel, body: MjcfBody, where: str) -> Iterator[Element]:
    """Iterate over sanitised copies of the geoms that have mass, from which a body has its inertia.

    Parameters
    ----------
    model : MjcfModel
    body : MjcfBody
    where : str
        The body, for messages.

    Yields
    ------
    Copies of geoms, with the attributes of their defaults.

    Raises
    ------
    RobotError
        If one is broken, or of a kind whose inertia is not computed.
    """
    for geom in body.element.findall("geom"):
        attributes = model.attributes(geom, body.childclass, where)
        density = finite(attributes.get("density", "1000"), 1, "geom density", where)[0]
        if "mass" in attributes:
            density = finite(attributes["mass"], 1, "geom mass", where)[0]
        kind = _kind(attributes)
        if density == 0.0 or kind == "plane":
            continue
        if kind not in _SIZES or "mesh" in attributes or "shellinertia" in attributes:
            raise UnsupportedError(
                f"has no <inertial>, and its inertia would come from a geom of type '{kind}', "
                "which is not supported",
                where,
                "give the body an <inertial>",
            )
        if density < 0.0:
            raise RobotError("has a geom with negative mass or density", where)
        size = "0.1" if "fromto" in attributes else "0.1 0.1 0.1"
        words = (attributes.get("size") or size).split()
        if not np.all(finite(" ".join(words), len(words), "geom size", where) > 0.0):
            raise RobotError("has a geom without size", where)
        if "fromto" in attributes:
            finite(attributes["fromto"], 6, "geom fromto", where)
        sanitised_pose(model, attributes, where)
        yield Element("geom", {key: attributes[key] for key in _HEAVY if key in attributes})


def shapes(root: Element, where: str) -> Iterator[Shape]:
    """Iterate over the shapes of an MJCF; see `Format`."""
    model = MjcfModel.read(root, where)
    meshes = {
        mesh.get("name") or PurePosixPath(mesh.get("file") or "").stem: model.attributes(
            mesh, "main", where
        )
        for mesh in root.findall("asset/mesh")
    }
    for body in model.bodies():
        for geom in body.element.findall("geom"):
            try:
                attributes = model.attributes(geom, body.childclass, where)
                yield _shape(model, body.name, attributes, meshes)
            except DynidentError as error:
                yield Shape(link=body.name, failure=error.what)


def _shape(
    model: MjcfModel, link: str, attributes: dict[str, str], meshes: dict[str, dict[str, str]]
) -> Shape:
    kind = _kind(attributes)
    p, R = bounded(attributes.get("pos", "0 0 0"), 3, "geom pos"), model.orientation(attributes, "")
    if not np.all(np.isfinite(R)):
        raise RobotError("a geom whose orientation is not finite")
    if kind == "mesh":
        name = attributes.get("mesh", "")
        asset = meshes.get(name, {})
        if not asset.get("file"):
            raise RobotError(f"mesh {name}: has no file")
        if "refpos" in asset or "refquat" in asset:
            raise RobotError(f"mesh {name}: has a reference frame of its own")
        folder = model.compiler.get("meshdir") or model.compiler.get("assetdir") or ""
        path = f"{folder.rstrip('/')}/{asset['file']}" if folder else asset["file"]
        scale = mesh_scale(asset.get("scale"))
        return Shape(link=link, R=R, p=p, kind=kind, mesh=path, scale=scale)
    if kind not in _SIZES or "mesh" in attributes:
        raise RobotError(f"shape '{kind}'" + (" fitted to a mesh" if "mesh" in attributes else ""))
    between, needed = attributes.get("fromto"), _SIZES[kind]
    length = 0.0
    if between is not None:
        if kind not in ("capsule", "cylinder"):
            raise RobotError(f"shape '{kind}' between two points")
        ends = bounded(between, 6, "geom fromto")
        length = float(np.linalg.norm(ends[3:] - ends[:3]))
        if length < 1e-9:
            raise RobotError("geom fromto without length")
        R, p, needed = from_z(ends[3:] - ends[:3]), (ends[:3] + ends[3:]) / 2.0, 1
    words = attributes.get("size", "").split()
    size = sizes(" ".join(words[:needed]), needed, f"{kind} size")
    if kind == "box":
        size = tuple(2.0 * half for half in size)
    elif kind in ("capsule", "cylinder"):
        size = (size[0], length or 2.0 * size[1])
    return Shape(link=link, R=R, p=p, kind=kind, sizes=size)
