"""Parquet files in, some rows at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.column_table import ColumnTable, joined, rows_at_once
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    ARRAYS,
    damaged,
    require_distinct,
    require_few,
    require_streamed,
    require_unpacked,
)

_BUFFER = 1 << 18
"""Bytes of a column that are read at a time; without it a whole row group is."""


def open_parquet(source: FileSource, file: str) -> ColumnTable:
    """Return the table that a Parquet file holds.

    Parameters
    ----------
    source : the file.
    file : for messages.

    Raises
    ------
    RecordingError
        If it is none, a name is in it twice, or pyarrow is not installed. `ColumnTable.load` and
        `ColumnTable.parts` raise it for a damaged column.
    """
    pyarrow_parquet(file)
    with _opened(source, file) as parquet:
        names = tuple(parquet.schema_arrow.names)
        samples = parquet.metadata.num_rows
    require_few(len(names), "columns", file)
    require_distinct(names, "column", file)

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        require_streamed(8 * samples * len(wanted), source.size, file)
        import pyarrow

        with _opened(source, file) as parquet:
            columns, seen = list(dict.fromkeys(wanted)), 0
            batches = parquet.iter_batches(rows_at_once(8 * len(columns)), columns=columns)
            for batch in batches:
                seen += batch.num_rows
                table = pyarrow.Table.from_batches([batch])
                yield {name: table.column(name).to_numpy() for name in columns}
            if not seen:
                yield {name: np.empty(0) for name in columns}
        # Else Arrow keeps what it has unpacked, for what it reads next.
        pyarrow.default_memory_pool().release_unused()

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        require_unpacked(8 * samples * len(wanted), ARRAYS, file)
        return joined(parts(wanted))

    return ColumnTable(file, names, load, parts=parts)


@contextmanager
def _opened(source: FileSource, file: str) -> Iterator[Any]:
    with source.open() as stream:
        try:
            with pyarrow_parquet(file).ParquetFile(
                stream, buffer_size=_BUFFER, pre_buffer=False
            ) as found:
                yield found
        except Exception as error:
            raise damaged("a Parquet file", file, error) from None


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
