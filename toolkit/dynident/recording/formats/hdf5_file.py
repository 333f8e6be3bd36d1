"""HDF5 files in, and MATLAB files of version 7.3, which are such files."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable
from dynident.recording.formats.limits import ARRAYS, damaged, require_few, require_unpacked

_MATLAB_CLASS = "MATLAB_class"
_MATLAB_OWN = "#"
"""How the names begin under which MATLAB keeps what is not a variable of its own."""


def open_hdf5(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of an HDF5 file hold: its data sets, by their paths.

    A data set in a group is `group/name`, a field of a data set of records is `name.field`. What
    MATLAB wrote is turned back: there, the first index runs fastest.

    Parameters
    ----------
    data : content of the file.
    file : for messages.

    Raises
    ------
    RecordingError
        If it is none, h5py is not installed, or there are too many data sets.
        `ColumnTable.load` raises it for a damaged one, one that lies in another file, and if they
        are too large.
    """
    h5py = _h5py(file)
    try:
        source = h5py.File(io.BytesIO(data), "r")
        found: list[str] = []

        def note(name: str, kind: Any) -> object:
            if isinstance(kind, h5py.Dataset) and not name.startswith(_MATLAB_OWN):
                fields = kind.dtype.names
                found.extend([f"{name}.{one}" for one in fields] if fields else [name])
            require_few(len(found), "data sets", file)
            return None

        # Links that lead to other files are not followed.
        source.visititems(note)
    except Exception as error:
        raise damaged("an HDF5 file", file, error) from None

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        try:
            places = {name: _place(source, name) for name in wanted}
            sizes = [math.prod(one.shape or ()) * one.dtype.itemsize for one, _ in places.values()]
            require_unpacked(sum(sizes), ARRAYS, file)
            for one, _ in places.values():
                if one.is_virtual or one.external:
                    what = f"'{one.name}' lies in another file"
                    raise RecordingError(what, file, "write all data into one file")
            return {name: _array(source, *place) for name, place in places.items()}
        except Exception as error:
            raise damaged("the HDF5 file", file, error) from None

    return ColumnTable(file, tuple(found), load)


def _h5py(file: str) -> Any:
    try:
        import h5py  # pyright: ignore[reportMissingImports]
    except ImportError:
        what, remedy = "HDF5 files need h5py", "pip install 'dynident[hdf5]'"
        if file.lower().endswith(".mat"):
            what = "is a MATLAB file of version 7.3 (HDF5)"
            remedy = f"save it in MATLAB with save(..., '-v7'), or {remedy}"
        raise RecordingError(what, file, remedy) from None
    return h5py


def _place(source: Any, name: str) -> tuple[Any, str | None]:
    """The data set of a name, and the field of it."""
    if name in source:
        return source[name], None
    whole, _, one = name.rpartition(".")
    while whole and whole not in source:
        whole, _, more = whole.rpartition(".")
        one = f"{more}.{one}"
    return source[whole], one


def _array(source: Any, place: Any, field: str | None) -> np.ndarray:
    """Numbers of a data set; text as an array of text."""
    x = place[field] if field else place[()]
    kind = place.attrs.get(_MATLAB_CLASS, b"")
    if kind == b"char":
        return np.array([_text(row) for row in np.atleast_2d(np.asarray(x).T)])
    if kind == b"cell":
        require_few(x.size, "names", str(source.filename))
        return np.array([_text(np.asarray(source[one][()]).T.ravel()) for one in x.ravel()])
    x = np.asarray(x)
    if x.dtype.kind in "SO" and all(isinstance(one, bytes | str) for one in x.ravel()):
        texts = [one.decode() if isinstance(one, bytes) else one for one in x.ravel()]
        return np.array(texts).reshape(x.shape)
    return x.T if kind else x


def _text(codes: np.ndarray) -> str:
    """Characters of MATLAB, which are numbers in the file."""
    return "".join(chr(code) for code in codes.ravel()).rstrip("\0")
