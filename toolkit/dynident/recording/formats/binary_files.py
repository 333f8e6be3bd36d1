"""NPZ, MAT and Parquet files in, also one of several records. Nothing is ever unpickled."""

from __future__ import annotations

import difflib
import io
import math
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable
from dynident.recording.formats.hdf5_file import open_hdf5
from dynident.recording.formats.limits import (
    ARRAYS,
    COMPLETE,
    damaged,
    require_distinct,
    require_few,
    require_unpacked,
)

COLUMNS = "columns"
"""Array of text, in the same file, that names the columns of every record."""
_MAT_HEADER, _MAT_COMPRESSED = 128, 15
_MOST_DEFLATED = 1032
"""Bytes that one compressed byte can become."""


def open_npz(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of an NPZ file hold, one array a name.

    Raises
    ------
    RecordingError
        If it is no NPZ file. `ColumnTable.load` raises it for an array of Python objects (they
        would have to be unpickled, which can run any code) and for a damaged one.
    """
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise RecordingError("is not an NPZ file", file, COMPLETE)
    try:
        archive = np.load(io.BytesIO(data), allow_pickle=False)
        names = tuple(archive.files)
        sizes = {one.filename: one.file_size for one in archive.zip.infolist()}
    except Exception as error:
        raise damaged("an NPZ file", file, error) from None
    require_few(len(names), "arrays", file)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        size = sum(sizes.get(f"{name}.npy", sizes.get(name, 0)) for name in wanted)
        require_unpacked(size, ARRAYS, file)
        found = {}
        for name in wanted:
            try:
                found[name] = archive[name]
            except Exception as error:
                if "allow_pickle" in str(error):
                    what = f"'{name}' holds Python objects, which are never loaded"
                    remedy = "save it as an array of doubles"
                    raise RecordingError(what, file, remedy) from None
                raise damaged(f"the array '{name}'", file, error) from None
            if not isinstance(found[name], np.ndarray):
                raise RecordingError(f"'{name}' is not an array", file, "save it with numpy.savez")
        return found

    return ColumnTable(file, names, load)


def open_mat(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of a MATLAB file hold.

    Raises
    ------
    RecordingError
        If it is none, or of version 7.3 and h5py is not installed. `ColumnTable.load` raises it
        for a damaged variable.
    """
    import scipy.io

    if data[:19] == b"MATLAB 7.3 MAT-file" or data[:8] == b"\x89HDF\r\n\x1a\n":
        return _open_mat_73(data, file)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sizes = {}
            names = []
            for name, shape, _ in scipy.io.whosmat(io.BytesIO(data)):
                names.append(name)
                sizes[name] = 8 * math.prod(shape)
    except Exception as error:
        raise damaged("a MATLAB file", file, error) from None
    require_few(len(names), "variables", file)
    require_distinct(names, "variable", file)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        require_unpacked(sum(sizes[name] for name in wanted), ARRAYS, file)
        require_unpacked(_unpacked_mat(data), ARRAYS, file)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = scipy.io.loadmat(io.BytesIO(data), variable_names=list(wanted))
                return {name: np.asarray(found[name]) for name in wanted}
        except Exception as error:
            raise damaged("the MATLAB file", file, error) from None

    return ColumnTable(file, tuple(names), load)


def _open_mat_73(data: bytes, file: str) -> ColumnTable:
    try:
        return open_hdf5(data, file)
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


def open_parquet(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of a Parquet file hold.

    Raises
    ------
    RecordingError
        If it is none, a name is in it twice, or pyarrow is not installed. `ColumnTable.load`
        raises it for a damaged column.
    """
    parquet = pyarrow_parquet(file)
    try:
        source = parquet.ParquetFile(io.BytesIO(data))
        names = tuple(source.schema_arrow.names)
    except Exception as error:
        raise damaged("a Parquet file", file, error) from None
    require_few(len(names), "columns", file)
    require_distinct(names, "column", file)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        require_unpacked(8 * source.metadata.num_rows * len(wanted), ARRAYS, file)
        try:
            content = source.read(columns=list(dict.fromkeys(wanted)))
            return {name: content.column(name).to_numpy() for name in wanted}
        except Exception as error:
            raise damaged("the Parquet file", file, error) from None

    return ColumnTable(file, names, load)


def pyarrow_parquet(file: str):
    """Return the module `pyarrow.parquet`, which is an optional dependency.

    Raises
    ------
    RecordingError
        If it is not installed.
    """
    try:
        import pyarrow.parquet as parquet
    except ImportError:
        remedy = "pip install 'dynident[parquet]'"
        raise RecordingError("Parquet files need pyarrow", file, remedy) from None
    return parquet


def pick(table: ColumnTable, record: str) -> ColumnTable:
    """Return one record of a file as a table of its own.

    Parameters
    ----------
    table : of a file with one two-dimensional array for each record (a row a sample), and their
        columns named by the array `columns`.
    record : name of the array.

    Raises
    ------
    RecordingError
        If there is no such record, it is no table of numbers, or its columns are not named.
    """
    if COLUMNS not in table.names:
        what = f"record '{record}' is asked for, and no array '{COLUMNS}' names its columns"
        remedy = "records are for NPZ and MAT files; else map the columns, as name[0]"
        raise RecordingError(what, table.file, remedy)
    records = [name for name in table.names if name != COLUMNS]
    if record not in records:
        close = difflib.get_close_matches(record, records, 1)
        shown = ", ".join(records[:20]) + (", ..." if len(records) > 20 else "")
        remedy = f"did you mean '{close[0]}'?" if close else f"it holds {shown or 'none'}"
        raise RecordingError(f"no record '{record}'", table.file, remedy)
    names = _column_names(table)
    where = f"{table.file}, record {record}"

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        x = table.load([record])[record]
        if x.ndim != 2 or x.shape[1] != len(names):
            what = f"has the shape {x.shape}, and {len(names)} columns are named"
            raise RecordingError(what, where, "save one row a sample and one column a name")
        return {name: x[:, names.index(name)] for name in wanted}

    others = [name for name in records if name != record]
    also = (f"{len(others)} other record{'s' * (len(others) != 1)}",) if others else ()
    return replace(table, file=where, names=names, load=load, skipped=lambda _: also)


def _column_names(table: ColumnTable) -> tuple[str, ...]:
    array = table.load([COLUMNS])[COLUMNS]
    if array.dtype.kind != "U" or not array.size:
        what = f"'{COLUMNS}' does not hold names (it is {array.dtype})"
        raise RecordingError(what, table.file, "save it as an array of text")
    # MATLAB pads the rows of a table of letters to one length.
    names = tuple(str(name).strip() for name in array.ravel())
    require_few(len(names), "columns", table.file)
    for name in names:
        if names.count(name) > 1:
            what = f"'{COLUMNS}' holds the name '{name}' twice"
            raise RecordingError(what, table.file, "name each column once")
    return names
