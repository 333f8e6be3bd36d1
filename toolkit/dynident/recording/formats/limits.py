"""How much of a file is read, for each format: what is larger is refused before it is unpacked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dynident import files
from dynident.errors import DynidentError, RecordingError

_MB, _GB = 1 << 20, 1 << 30


@dataclass(frozen=True)
class SizeLimit:
    """What a file of one format may hold.

    Attributes
    ----------
    stored : bytes on disk.
    unpacked : bytes of the columns that are asked for, once they are arrays; in a bag, of all that
        is unpacked on the way to them.
    """

    stored: int
    unpacked: int


STREAMED = SizeLimit(64 * _GB, 64 * _GB)
"""Of files that are read some rows at a time."""
TEXT = SizeLimit(64 * _GB, 1 * _GB)
ARRAYS = SizeLimit(2 * _GB, 1 * _GB)
"""Of arrays that are made as a whole, in memory."""
BAG = SizeLimit(16 * _GB, 16 * _GB)
LARGEST_CHUNK = 256 * _MB
"""Bytes of one compressed chunk of a bag or of an HDF5 file, unpacked."""
AT_ONCE = 4 * _MB
"""Bytes of columns that are read at a time, from files that are read so."""
_PACKED = 100
"""Bytes that one byte on disk may become beyond what is unpacked anyway: measurements become ten at
the most, and a file that is made to fill the disk a thousand."""
MOST_COLUMNS = 4096
"""Columns of a table, arrays of a file, and signals of all joints in a bag."""

CUT = "cut it into several files, or write fewer columns or a lower rate"
"""What to do about a file that is too large."""
COMPLETE = "is the file complete, and of this format?"


def require_unpacked(size: int, limit: SizeLimit, file: str) -> None:
    """Refuse columns that would take too much memory.

    Parameters
    ----------
    size : bytes that they would take.
    limit : of their format.
    file : for the message.

    Raises
    ------
    RecordingError
        If they are more than the limit.
    """
    if size > limit.unpacked:
        what = (
            f"unpacks to {files.size_in_words(size)}, and {files.size_in_words(limit.unpacked)} "
            "is the limit"
        )
        raise RecordingError(what, file, CUT)


def require_streamed(size: int, stored: int, file: str) -> None:
    """Refuse columns that are read some rows at a time and would take too much of the disk.

    Parameters
    ----------
    size : bytes that they would take.
    stored : bytes of the file.
    file : for the message.

    Raises
    ------
    RecordingError
        If they are more than the limit, or far more than any measurements in a file of its size.
    """
    allowed = min(STREAMED.unpacked, _PACKED * stored)
    require_unpacked(size, SizeLimit(stored, max(ARRAYS.unpacked, allowed)), file)


def require_few(count: int, kind: str, file: str) -> None:
    """Refuse a file of more columns than `MOST_COLUMNS`.

    Parameters
    ----------
    count : how many it holds.
    kind : what they are, in the plural.
    file : for the message.

    Raises
    ------
    RecordingError
        If they are too many.
    """
    if count > MOST_COLUMNS:
        what = f"holds {count} {kind}, and {MOST_COLUMNS} is the limit"
        raise RecordingError(what, file, "write those that are needed into a file of their own")


def require_distinct(names: Sequence[str], kind: str, file: str) -> None:
    """Refuse names that are there twice.

    Parameters
    ----------
    names : of columns.
    kind : what they are, in the singular.
    file : for the message.

    Raises
    ------
    RecordingError
        If one is; it is named, and how often it is there.
    """
    seen: set[str] = set()
    for name in names:
        if name in seen:
            what = f"the {kind} '{name}' is there {list(names).count(name)} times"
            raise RecordingError(what, file, "name each once")
        seen.add(name)


def damaged(what: str, file: str, error: Exception) -> DynidentError:
    """Return one line for whatever a library says of a broken file.

    Parameters
    ----------
    what : it cannot be read as.
    file : for the message.
    error : of the library.
    """
    if isinstance(error, DynidentError):
        return error
    if isinstance(error, MemoryError):
        return RecordingError("does not fit into memory", file, CUT)
    reason = " ".join(str(error).split()) or type(error).__name__
    reason = reason if len(reason) <= 120 else reason[:117] + "..."
    return RecordingError(
        f"cannot be read as {what.removeprefix('the ')} ({reason})", file, COMPLETE
    )
