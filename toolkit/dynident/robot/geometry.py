"""The shapes of links: visual and collision geometry as points whose convex hull holds them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dynident.errors import DynidentError
from dynident.robot.formats.format import Shape
from dynident.robot.formats.reading import shapes
from dynident.robot.hull import circumscribed
from dynident.robot.meshes import find_mesh, mesh_points
from dynident.robot.tree import Array, Description


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

    What cannot be read (a negative radius, a missing mesh file) is reported in `not_read`.

    Raises
    ------
    RobotError
        If the description is no XML.
    """
    folder = Path(description.path).absolute().parent
    found: dict[str, list[Shape]] = {}
    for shape in shapes(description):
        found.setdefault(shape.link, []).append(shape)
    return {link: _geometry(own, folder) for link, own in found.items()}


def _geometry(found: list[Shape], folder: Path) -> LinkGeometry:
    points, not_read, meshes = [np.zeros((0, 3))], [], []
    for shape in found:
        if shape.failure:
            not_read.append(shape.failure)
            continue
        if shape.mesh:
            try:
                own = mesh_points(find_mesh(shape.mesh, folder)) * shape.scale
            except DynidentError as error:
                not_read.append(f"mesh {Path(shape.mesh).name}: {error.what}")
                continue
            meshes.append(shape.mesh)
        else:
            own = circumscribed(shape.kind, shape.sizes)
        points.append(own @ shape.R.T + shape.p)
    distinct = (tuple(dict.fromkeys(words)) for words in (not_read, meshes))
    return LinkGeometry(np.vstack(points), *distinct)
