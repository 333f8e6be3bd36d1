"""NPZ, MAT and Parquet files in, also one of several records. Nothing is ever unpickled."""

from __future__ import annotations

import difflib
import io
import warnings
import zipfile
from collections.abc import Sequence

import numpy as np

from dynident.errors import DynidentError, RecordingError
from dynident.recording.formats.column_names import ColumnTable

COLUMNS = "columns"
"""Array of text, in the same file, that names the columns of every record."""
_COMPLETE = "is the file complete, and of this format?"


def open_npz(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of an NPZ file hold, one array a name.

    Raises
    ------
    RecordingError
        If it is no NPZ file. `Table.load` raises it for an array of Python objects (they would
        have to be unpickled, which can run any code) and for a damaged one.
    """
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise RecordingError("is not an NPZ file", file, _COMPLETE)
    try:
        archive = np.load(io.BytesIO(data), allow_pickle=False)
        names = tuple(archive.files)
    except Exception as error:
        raise _damaged("an NPZ file", file, error) from None

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        found = {}
        for name in wanted:
            try:
                found[name] = archive[name]
            except Exception as error:
                if "allow_pickle" in str(error):
                    what = f"'{name}' holds Python objects, which are never loaded"
                    remedy = "save it as an array of doubles"
                    raise RecordingError(what, file, remedy) from None
                raise _damaged(f"the array '{name}'", file, error) from None
            if not isinstance(found[name], np.ndarray):
                raise RecordingError(f"'{name}' is not an array", file, "save it with numpy.savez")
        return found

    return ColumnTable(file, names, load)


def open_mat(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of a MATLAB file (version 4 to 7.2) hold.

    Raises
    ------
    RecordingError
        If it is none, or of version 7.3. `Table.load` raises it for a damaged variable.
    """
    import scipy.io

    if data[:19] == b"MATLAB 7.3 MAT-file" or data[:8] == b"\x89HDF\r\n\x1a\n":
        what = "is a MATLAB file of version 7.3 (HDF5)"
        raise RecordingError(what, file, "save it in MATLAB with save(..., '-v7')")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            names = tuple(name for name, _, _ in scipy.io.whosmat(io.BytesIO(data)))
    except Exception as error:
        raise _damaged("a MATLAB file", file, error) from None
    repeated = [name for name in names if names.count(name) > 1]
    if repeated:
        raise RecordingError(f"the variable '{repeated[0]}' is there twice", file)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = scipy.io.loadmat(io.BytesIO(data), variable_names=list(wanted))
                return {name: np.asarray(found[name]) for name in wanted}
        except Exception as error:
            raise _damaged("the MATLAB file", file, error) from None

    return ColumnTable(file, names, load)


def open_parquet(data: bytes, file: str) -> ColumnTable:
    """Return the table that the bytes of a Parquet file hold.

    Raises
    ------
    RecordingError
        If it is none, a name is in it twice, or pyarrow is not installed. `Table.load` raises it
        for a damaged column.
    """
    parquet = pyarrow_parquet(file)
    try:
        source = parquet.ParquetFile(io.BytesIO(data))
        names = tuple(source.schema_arrow.names)
    except Exception as error:
        raise _damaged("a Parquet file", file, error) from None
    for name in names:
        if names.count(name) > 1:
            raise RecordingError(
                f"the column '{name}' is there {names.count(name)} times",
                file,
                "name each column once",
            )

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        try:
            content = source.read(columns=list(dict.fromkeys(wanted)))
            return {name: content.column(name).to_numpy() for name in wanted}
        except Exception as error:
            raise _damaged("the Parquet file", file, error) from None

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


def _damaged(what: str, file: str, error: Exception) -> DynidentError:
    """One line for whatever a library says of a broken file."""
    reason = " ".join(str(error).split()) or type(error).__name__
    reason = reason if len(reason) <= 120 else reason[:117] + "..."
    return RecordingError(
        f"cannot be read as {what.removeprefix('the ')} ({reason})", file, _COMPLETE
    )


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

    return ColumnTable(where, names, load)


def _column_names(table: ColumnTable) -> tuple[str, ...]:
    array = table.load([COLUMNS])[COLUMNS]
    if array.dtype.kind != "U" or not array.size:
        what = f"'{COLUMNS}' does not hold names (it is {array.dtype})"
        raise RecordingError(what, table.file, "save it as an array of text")
    # MATLAB pads the rows of a table of letters to one length.
    names = tuple(str(name).strip() for name in array.ravel())
    for name in names:
        if names.count(name) > 1:
            what = f"'{COLUMNS}' holds the name '{name}' twice"
            raise RecordingError(what, table.file, "name each column once")
    return names
