"""HDF5 files in, and MATLAB files of version 7.3, which are such files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident import files
from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable, is_lying, rows_together
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    ARRAYS,
    AT_ONCE,
    LARGEST_CHUNK,
    damaged,
    require_few,
    require_streamed,
    require_unpacked,
)

_MATLAB_CLASS = "MATLAB_class"
_MATLAB_OWN = "#"
"""How the names begin under which MATLAB keeps what is not a variable of its own."""


def open_hdf5(source: FileSource, file: str) -> ColumnTable:
    """Return the table that an HDF5 file holds: its data sets, by their paths.

    A data set in a group is `group/name`, a field of a data set of records is `name.field`. What
    MATLAB wrote is turned back: there, the first index runs fastest.

    Parameters
    ----------
    source : the file.
    file : for messages.

    Raises
    ------
    RecordingError
        If it is none, h5py is not installed, or there are too many data sets.
        `ColumnTable.load` and `ColumnTable.parts` raise it for a damaged one, one that lies in
        another file, and if they are too large.
    """
    h5py = _h5py(file)
    found: list[str] = []

    def note(name: str, kind: Any) -> object:
        if isinstance(kind, h5py.Dataset) and not name.startswith(_MATLAB_OWN):
            fields = kind.dtype.names
            found.extend([f"{name}.{one}" for one in fields] if fields else [name])
        require_few(len(found), "data sets", file)
        return None

    with _opened(source, file, "an HDF5 file") as content:
        # Links that lead to other files are not followed.
        content.visititems(note)

    def places(content: Any, wanted: Sequence[str]) -> dict[str, tuple[Any, str | None]]:
        found = {name: _place(content, name) for name in wanted}
        for one, _ in found.values():
            if one.is_virtual or one.external:
                what = f"'{one.name}' lies in another file"
                raise RecordingError(what, file, "write all data into one file")
        return found

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        with _opened(source, file, "the HDF5 file") as content:
            found = places(content, wanted)
            require_unpacked(sum(_size(one) for one, _ in found.values()), ARRAYS, file)
            return {name: _array(content, *place) for name, place in found.items()}

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        readers: dict[str, _DataSetRows] | None = None
        with _opened(source, file, "the HDF5 file") as content:
            found = places(content, wanted)
            size = sum(_size(one) for one, _ in found.values())
            require_streamed(size, source.size, file)
            if size > AT_ONCE:
                readers = _readers(found, file)
            if readers is not None:
                yield from rows_together(readers)
        if readers is None:
            yield load(wanted)

    return ColumnTable(file, tuple(found), load, parts=parts)


@contextmanager
def _opened(source: FileSource, file: str, kind: str) -> Iterator[Any]:
    h5py = _h5py(file)
    with source.open() as stream:
        try:
            with h5py.File(stream, "r") as content:
                yield content
        except Exception as error:
            raise damaged(kind, file, error) from None


def _size(place: Any) -> int:
    return math.prod(place.shape or ()) * place.dtype.itemsize


def _readers(
    places: Mapping[str, tuple[Any, str | None]], file: str
) -> dict[str, _DataSetRows] | None:
    """Readers of the rows of data sets; None where one is no table of numbers with as many rows."""
    found: dict[str, _DataSetRows] = {}
    for name, (place, field) in places.items():
        kind = place.dtype[field] if field else place.dtype
        if kind.kind not in "fiub" or place.ndim not in (1, 2):
            return None
        turned = _MATLAB_CLASS in place.attrs and place.ndim == 2
        shape = place.shape[::-1] if turned else place.shape
        lying = is_lying(shape)
        # The number of the index that runs over samples, as the file has it.
        axis = int(lying != turned)
        chunk = place.chunks[axis] if place.chunks else 1
        reader = _DataSetRows(place, field, kind, axis, lying, chunk)
        if place.chunks and math.prod(place.chunks) * place.dtype.itemsize > LARGEST_CHUNK:
            what = f"'{name}' is in chunks of more than {files.size_in_words(LARGEST_CHUNK)}"
            raise RecordingError(what, file, "write it in smaller ones")
        found[name] = reader
    return found if len({one.rows for one in found.values()}) == 1 else None


@dataclass(eq=False)
class _DataSetRows:
    """Rows of a data set as they come; see `RowReader`.

    Attributes
    ----------
    place : the data set.
    field : of its records, or None.
    kind : of the numbers.
    axis : number of the index that runs over the rows.
    lying : whether it is a vector in one row of a table.
    chunk : rows that are unpacked together.
    """

    place: Any
    field: str | None
    kind: np.dtype
    axis: int
    lying: bool
    chunk: int
    _start: int = 0
    _ahead: np.ndarray | None = None

    @property
    def rows(self) -> int:
        return self.place.shape[self.axis]

    @property
    def row_size(self) -> int:
        return self.kind.itemsize * math.prod(self.place.shape) // self.rows

    def take(self, count: int) -> np.ndarray:
        """Return the next rows; whole chunks are read, so that none is unpacked twice."""
        have = [] if self._ahead is None else [self._ahead]
        lacking = count - sum(map(len, have))
        if lacking > 0:
            step = -(-lacking // self.chunk) * self.chunk
            stop = min(self._start + step, self.rows)
            have.append(self._some(slice(self._start, stop)))
            self._start = stop
        whole = have[0] if len(have) == 1 else np.concatenate(have)
        self._ahead = whole[count:] if len(whole) > count else None
        return whole[:count]

    def _some(self, rows: slice) -> np.ndarray:
        place = self.place.fields(self.field) if self.field else self.place
        x = np.asarray(place[(slice(None),) * self.axis + (rows,)])
        if self.lying:
            return x.ravel()
        return x.T if self.axis else x


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
