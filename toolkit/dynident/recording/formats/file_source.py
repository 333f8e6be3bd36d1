"""A file of data as formats open it: as often as they like, and always the same content."""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from dynident import files
from dynident.errors import FileError

WHOLE = 1 << 23
"""Bytes up to which a file is kept in memory once it is opened; others are read as they lie."""
_BLOCK = 1 << 20

_Stamp = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False, kw_only=True)
class FileSource:
    """A file that stays what it is while it is read.

    Attributes
    ----------
    path : of the file.
    size : bytes that it holds.
    content : all of it, where it is small; None for others.
    stamp : what tells whether a file that is read later is still the one that was opened.
    """

    path: Path
    size: int
    content: bytes | None = None
    stamp: _Stamp = (0, 0, 0, 0)

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """Open the content for reading.

        Raises
        ------
        FileError
            If the file cannot be read, or has changed since the first time: a hash would not be
            that of what is read.
        """
        if self.content is not None:
            yield io.BytesIO(self.content)
            return
        with files.open_regular(self.path) as stream:
            self._require_same(stream)
            yield stream
            self._require_same(stream)

    def read(self) -> bytes:
        """Return all of it."""
        with self.open() as stream:
            return stream.read()

    def sha256(self) -> str:
        """Return the SHA-256 of the content as hexadecimal digits.

        Raises
        ------
        FileError
            As `open`.
        """
        digest = hashlib.sha256()
        with self.open() as stream:
            try:
                while block := stream.read(_BLOCK):
                    digest.update(block)
            except OSError as error:
                what = f"cannot be read ({error.strerror or error})"
                raise FileError(what, str(self.path)) from None
        return digest.hexdigest()

    def _require_same(self, stream: BinaryIO) -> None:
        if _stamp(stream) != self.stamp:
            what, remedy = "changed while it was read", "read it once it is complete, or a copy"
            raise FileError(what, str(self.path), remedy)


def open_source(path: Path, largest: int, remedy: str) -> FileSource:
    """Open a file of data.

    Parameters
    ----------
    path : the file.
    largest : bytes that it may hold.
    remedy : what to do where it holds more.

    Returns
    -------
    The file, of which what is small is in memory now.

    Raises
    ------
    FileError
        If there is no such file, it is not a regular one, it cannot be read, or it is too large.
    """
    with files.open_regular(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > largest:
            raise files.too_large(path, size, largest, remedy)
        if size > WHOLE:
            return FileSource(path=path, size=size, stamp=_stamp(stream))
    content = files.read_bytes(path, WHOLE, remedy)
    return FileSource(path=path, size=len(content), content=content)


def _stamp(stream: BinaryIO) -> _Stamp:
    found = os.fstat(stream.fileno())
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
