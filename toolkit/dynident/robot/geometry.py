"""The shapes of links: visual and collision geometry as points whose convex hull holds them.

Drake knows the conventions of the formats (poses, angles, capsules between two points); it is
shown a copy that has the shapes alone, with sizes that were checked. Meshes stand in it as a small
ball: their files are read here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dynident.errors import DynidentError
from dynident.robot.contents import to_text
from dynident.robot.hull import circumscribed
from dynident.robot.kinematics import quiet
from dynident.robot.meshes import find_mesh, mesh_points
from dynident.robot.mjcf_shapes import read_mjcf, write_mjcf
from dynident.robot.shapes import NotRead, Shape, read_sdf, read_urdf, write_sdf, write_urdf
from dynident.robot.tree import Array, Description
from dynident.robot.xmltree import parse

_FORMATS = {
    "urdf": (read_urdf, write_urdf, "urdf"),
    "sdf": (read_sdf, write_sdf, "sdf"),
    "mjcf": (read_mjcf, write_mjcf, "xml"),
}


@dataclass(frozen=True, eq=False)
class LinkGeometry:
    """The shapes of one link.

    Attributes
    ----------
    points : (k, 3) ndarray
        m, in the link's frame: every shape that was read lies in their convex hull.
    not_read : tuple of str
        Why a shape was not read, for each that was not.
    meshes : tuple of str
        Mesh files among what was read.
    """

    points: Array = field(default_factory=lambda: np.zeros((0, 3)))
    not_read: tuple[str, ...] = ()
    meshes: tuple[str, ...] = ()


def link_geometry(description: Description) -> dict[str, LinkGeometry]:
    """Return the geometry of every link that has any, by the link's name.

    What cannot be read (a negative radius, a missing or unknown mesh file) is told in `not_read`.

    Raises
    ------
    RobotError
        If the description is no XML.
    """
    root = parse(description.text, description.path).root
    read, write, suffix = _FORMATS[description.format]
    found = tuple(
        replace(shape, name=f"shape{index}")
        for index, shape in enumerate(read(root, description.path))
    )
    placed = {}
    if any(shape.element is not None for shape in found):
        placed = _placed(to_text(write(root, found)), suffix)
    folder = Path(description.path).absolute().parent
    points: dict[str, list[Array]] = {}
    not_read: dict[str, list[str]] = {}
    meshes: dict[str, list[str]] = {}
    for shape in found:
        for store in (points, not_read, meshes):
            store.setdefault(shape.link, [])
        try:
            if shape.failure:
                raise NotRead(shape.failure)
            if shape.name not in placed:
                raise NotRead("a shape that cannot be understood")
            X, own = placed[shape.name]
            if shape.mesh:
                own = _mesh(shape, folder)
                meshes[shape.link].append(shape.mesh)
            points[shape.link].append(own @ X[:3, :3].T + X[:3, 3])
        except NotRead as failure:
            not_read[shape.link].append(str(failure))
    return {
        link: LinkGeometry(
            np.vstack([np.zeros((0, 3)), *own]),
            tuple(dict.fromkeys(not_read[link])),
            tuple(dict.fromkeys(meshes[link])),
        )
        for link, own in points.items()
    }


def _mesh(shape: Shape, folder: Path) -> Array:
    try:
        return mesh_points(find_mesh(shape.mesh, folder)) * shape.scale
    except DynidentError as error:
        raise NotRead(f"mesh {Path(shape.mesh).name}: {error.what}") from None


def _placed(copy: str, suffix: str) -> dict[str, tuple[Array, Array]]:
    """Return pose (4, 4) and circumscribed points (k, 3) of each shape that Drake has read."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.framework import DiagramBuilder

    plant, scene = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    try:
        with quiet():
            Parser(plant).AddModelsFromString(copy, suffix)
    except Exception:  # the bindings raise whatever the parser's libraries throw
        return {}
    inspector = scene.model_inspector()
    placed: dict[str, tuple[Array, Array]] = {}
    for geometry in inspector.GetAllGeometryIds():
        name = inspector.GetName(geometry).rpartition("::")[2]
        pose = np.array(inspector.GetPoseInFrame(geometry).GetAsMatrix4())
        points = circumscribed(inspector.GetShape(geometry))
        if points is not None:
            placed[name] = (pose, points)
    return placed
