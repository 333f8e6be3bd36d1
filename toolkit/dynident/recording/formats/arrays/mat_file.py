"""MATLAB files in. Those of version 7.3 are HDF5 files; others are unpacked as a whole."""

from __future__ import annotations

import io
import math
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from dynident import files
from dynident.errors import RecordingError
from dynident.recording.formats.arrays.hdf5_file import open_hdf5
from dynident.recording.formats.column_table import ColumnTable
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    ARRAYS,
    CUT,
    damaged,
    require_distinct,
    require_few,
    require_unpacked,
)

_MAT_HEADER, _MAT_COMPRESSED = 128, 15
_DEEPEST = 4
"""Structures in each other that are looked into."""
_MOST_DEFLATED = 1032
"""Bytes that one compressed byte can become."""


def open_mat(source: FileSource, file: str) -> ColumnTable:
    """Return the table that a MATLAB file holds; a field of a structure is `name.field`.

    Parameters
    ----------
    source : the file.
    file : for messages.

    Raises
    ------
    RecordingError
        If it is none, or of version 7.3 and h5py is not installed. `ColumnTable.load` raises it
        for a damaged variable.
    """
    import scipy.io

    with source.open() as stream:
        start = stream.read(19)
    if start == b"MATLAB 7.3 MAT-file" or start[:8] == b"\x89HDF\r\n\x1a\n":
        return _open_mat_73(source, file)
    if source.size > ARRAYS.stored:
        # SciPy unpacks it as a whole.
        raise files.too_large(file, source.size, ARRAYS.stored, CUT)
    data = source.read()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = scipy.io.whosmat(io.BytesIO(data))
    except Exception as error:
        raise damaged("a MATLAB file", file, error) from None
    variables = [name for name, _, _ in found]
    require_few(len(variables), "variables", file)
    require_distinct(variables, "variable", file)
    sizes = {name: 8 * math.prod(shape) for name, shape, _ in found}
    structures = [name for name, shape, kind in found if kind == "struct" and math.prod(shape) == 1]

    def read(wanted: Sequence[str]) -> dict[str, Any]:
        require_unpacked(_unpacked_mat(data), ARRAYS, file)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return scipy.io.loadmat(io.BytesIO(data), variable_names=list(wanted))
        except Exception as error:
            raise damaged("the MATLAB file", file, error) from None

    fields = _fields(read(structures), structures) if structures else {}
    names = [one for name in variables for one in fields.get(name, (name,))]
    require_few(len(names), "variables", file)
    of = {one: name for name in variables for one in fields.get(name, (name,))}

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        needed = list(dict.fromkeys(of[name] for name in wanted))
        require_unpacked(sum(sizes[name] for name in needed), ARRAYS, file)
        content = read(needed)
        try:
            return {name: np.asarray(_at(content[of[name]], name)) for name in wanted}
        except Exception as error:
            raise damaged("the MATLAB file", file, error) from None

    return ColumnTable(file, tuple(names), load)


def _fields(content: Mapping[str, Any], structures: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Names of the fields of each structure, those of structures in it too."""
    return {name: tuple(_below(content.get(name), name, _DEEPEST)) for name in structures}


def _below(x: Any, name: str, levels: int) -> Iterator[str]:
    fields = getattr(getattr(x, "dtype", None), "names", None)
    if not fields or not levels or x.size != 1:
        yield name
        return
    for field in fields:
        yield from _below(x[field].item(), f"{name}.{field}", levels - 1)


def _at(x: Any, name: str) -> Any:
    """What is under the name of a variable, or of a field of it."""
    for field in name.split(".")[1:]:
        x = x[field].item()
    return x


def _open_mat_73(source: FileSource, file: str) -> ColumnTable:
    try:
        return open_hdf5(source, file)
    except RecordingError as error:
        if "cannot be read" not in error.what:
            raise
        what = "cannot be read as a MATLAB file of version 7.3 (HDF5)"
        remedy = "save it in MATLAB with save(..., '-v7'), or is it incomplete?"
        raise RecordingError(what, file, remedy) from None


def _unpacked_mat(data: bytes) -> int:
    """Bytes that the compressed variables of a MATLAB file unpack to; more than allowed ends it.

    What a variable says of its size need not be so, and is not what is then unpacked.
    """
    if len(data) * _MOST_DEFLATED < ARRAYS.unpacked:
        return 0
    order = "little" if data[126:128] == b"IM" else "big"
    place, total = _MAT_HEADER, 0
    while place + 8 <= len(data) and total <= ARRAYS.unpacked:
        kind, size = (int.from_bytes(data[place + k : place + k + 4], order) for k in (0, 4))
        if kind == _MAT_COMPRESSED:
            unpack = zlib.decompressobj()
            rest = data[place + 8 : place + 8 + size]
            while rest and total <= ARRAYS.unpacked:
                try:
                    total += len(unpack.decompress(rest, 1 << 24))
                except zlib.error:
                    break  # who reads it says so
                rest = unpack.unconsumed_tail
        place += 8 + size
    return total
