"""Corner points of the mesh files that robot descriptions name: STL and OBJ.

`trimesh` drops the points of faces that it cannot use, NaN among them, without a word, and takes
1.5 s to load; Assimp (in `coal`, below Pinocchio) refuses what has no faces. Only points matter.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dynident import files
from dynident.errors import DynidentError, FileError
from dynident.robot.tree import Array

_LARGEST = 100_000_000
"""Bytes beyond which a mesh is not read: finer than any link needs."""


def find_mesh(uri: str, folder: Path) -> Path:
    """Find the file that a URI in a robot description names.

    `package://NAME/PATH` and `model://NAME/PATH` are looked for in the folders above the
    description; other paths are relative to its folder.

    Raises
    ------
    FileError
        If it is nowhere.
    """
    scheme, found, path = uri.strip().partition("://")
    if not found:
        scheme, path = "", uri.strip()
    if scheme in ("", "file"):
        candidates = [folder / path]
    elif scheme in ("package", "model"):
        name, _, rest = path.partition("/")
        above = (folder, *folder.parents)
        candidates = [parent / path for parent in above]
        candidates += [parent / rest for parent in above if parent.name == name]
    else:
        raise FileError(f"is a {scheme} address", uri, "name a file")
    for candidate in candidates:
        try:
            if candidate.is_file():
                return candidate
        except (OSError, ValueError):  # a name that no file system takes
            continue
    raise FileError("no such file", uri)


def mesh_points(path: Path) -> Array:
    """Return the corner points (k, 3) of a mesh, in the file's units.

    Raises
    ------
    FileError
        If the file cannot be read, is of another format, or is damaged.
    """
    reader = {".stl": _stl, ".obj": _obj}.get(path.suffix.lower())
    if reader is None:
        raise FileError(f"'{path.suffix}' files are not read", str(path), "use .stl or .obj")
    try:
        points = reader(files.read_bytes(path, _LARGEST, "simplify the mesh"))
    except DynidentError:
        raise
    except (OSError, ValueError, IndexError):
        raise FileError("is damaged", str(path)) from None
    if not len(points) or not np.all(np.isfinite(points)):
        raise FileError("has no points, or some that are not finite", str(path))
    return np.unique(points, axis=0)


_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _stl(data: bytes) -> Array:
    # Binary files may begin with "solid" too; their length gives them away.
    if len(data) >= 84:
        count = int.from_bytes(data[80:84], "little")
        if len(data) == 84 + count * _TRIANGLE.itemsize:
            triangles = np.frombuffer(data, _TRIANGLE, count, 84)
            return triangles["corners"].reshape(-1, 3).astype(float)
    return _lines(data, b"vertex")


def _obj(data: bytes) -> Array:
    return _lines(data, b"v")


def _lines(data: bytes, keyword: bytes) -> Array:
    found = [words[1:4] for line in data.splitlines() if (words := line.split())[:1] == [keyword]]
    return np.array(found, dtype=float).reshape(-1, 3)
