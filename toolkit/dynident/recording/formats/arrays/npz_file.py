"""NPZ files in, whole arrays or some rows of them at a time. Nothing is ever unpickled."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.formats.arrays.array_header import (
    NUMBERS,
    ArrayHeader,
    read_array_header,
)
from dynident.recording.formats.column_table import (
    ColumnTable,
    RowReader,
    is_lying,
    rows_together,
)
from dynident.recording.formats.file_source import FileSource
from dynident.recording.formats.limits import (
    ARRAYS,
    AT_ONCE,
    COMPLETE,
    damaged,
    require_few,
    require_streamed,
    require_unpacked,
)

_BLOCK = 1 << 20


def open_npz(source: FileSource, file: str) -> ColumnTable:
    """Return the table that an NPZ file holds, one array a name.

    Parameters
    ----------
    source : the file.
    file : for messages.

    Raises
    ------
    RecordingError
        If it is no NPZ file. `ColumnTable.load` and `ColumnTable.parts` raise it for an array of
        Python objects (they would have to be unpickled, which can run any code) and for a damaged
        one.
    """
    with source.open() as stream:
        if not zipfile.is_zipfile(stream):
            raise RecordingError("is not an NPZ file", file, COMPLETE)
    with _opened(source, file) as archive:
        names = tuple(archive.files)
        sizes = {one.filename: one.file_size for one in archive.zip.infolist()}
    require_few(len(names), "arrays", file)

    def size(wanted: Sequence[str]) -> int:
        return sum(sizes.get(f"{name}.npy", sizes.get(name, 0)) for name in wanted)

    def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
        require_unpacked(size(wanted), ARRAYS, file)
        with _opened(source, file) as archive:
            return {name: _array(archive, name, file) for name in wanted}

    def parts(wanted: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        require_streamed(size(wanted), source.size, file)
        readers: dict[str, RowReader] | None = None
        with _opened(source, file) as archive, ExitStack() as members:
            if size(wanted) > AT_ONCE:
                readers = _readers(archive, wanted, members)
            if readers is not None:
                yield from rows_together(readers)
        if readers is None:
            yield load(wanted)

    return ColumnTable(file, names, load, parts=parts)


@contextmanager
def _opened(source: FileSource, file: str) -> Iterator[Any]:
    with source.open() as stream:
        try:
            with np.load(stream, allow_pickle=False) as archive:
                yield archive
        except Exception as error:
            raise damaged("an NPZ file", file, error) from None


def _array(archive: Any, name: str, file: str) -> np.ndarray:
    try:
        found = archive[name]
    except Exception as error:
        if "allow_pickle" in str(error):
            what = f"'{name}' holds Python objects, which are never loaded"
            remedy = "save it as an array of doubles"
            raise RecordingError(what, file, remedy) from None
        raise damaged(f"the array '{name}'", file, error) from None
    if not isinstance(found, np.ndarray):
        raise RecordingError(f"'{name}' is not an array", file, "save it with numpy.savez")
    return found


def _readers(archive: Any, names: Sequence[str], members: ExitStack) -> dict[str, RowReader] | None:
    """Readers of the rows of arrays; None where one is no table of numbers with as many rows."""
    found: dict[str, RowReader] = {}
    for name in names:
        member = f"{name}.npy" if f"{name}.npy" in archive.zip.NameToInfo else name
        stream = members.enter_context(archive.zip.open(member))
        header = _header(stream)
        if header is None:
            return None
        streams = [stream]
        rows, *widths = header.shape if not is_lying(header.shape) else header.shape[1:]
        width = widths[0] if widths else 1
        if header.by_columns and width > 1:
            # Each column is read from a place of its own.
            for k in range(1, width):
                one = members.enter_context(archive.zip.open(member))
                _header(one)
                _skip(one, k * rows * header.dtype.itemsize)
                streams.append(one)
        found[name] = _MemberRows(streams, header.dtype, rows, tuple(widths))
    if len({one.rows for one in found.values()}) > 1:
        return None
    return found


def _skip(stream: IO[bytes], size: int) -> None:
    """Read on, so that the sum of what was read is still checked at the end."""
    while size > 0:
        size -= len(stream.read(min(size, _BLOCK))) or size


def _header(stream: IO[bytes]) -> ArrayHeader | None:
    """What an array says of itself; None where it is none of rows of numbers."""
    header = read_array_header(stream)
    if header is None or header.dtype.kind not in NUMBERS or len(header.shape) not in (1, 2):
        return None
    return header


@dataclass(frozen=True, eq=False)
class _MemberRows:
    """Rows of one array in an archive as they come; see `RowReader`.

    Attributes
    ----------
    streams : one at the beginning of the rows, or of each column.
    dtype : of the numbers.
    rows : how many there are.
    widths : () of a vector, else the number of columns.
    """

    streams: list[IO[bytes]]
    dtype: np.dtype
    rows: int
    widths: tuple[int, ...]

    @property
    def row_size(self) -> int:
        return self.dtype.itemsize * (self.widths[0] if self.widths else 1)

    def take(self, count: int) -> np.ndarray:
        """Return the next rows."""
        if len(self.streams) > 1:
            return np.stack([self._numbers(one, count) for one in self.streams], axis=1)
        across = self.widths[0] if self.widths else 1
        return self._numbers(self.streams[0], count * across).reshape(count, *self.widths)

    def _numbers(self, stream: IO[bytes], count: int) -> np.ndarray:
        size = count * self.dtype.itemsize
        data = stream.read(size)
        if len(data) < size:
            raise ValueError("the data end before the array does")
        return np.frombuffer(data, self.dtype)
