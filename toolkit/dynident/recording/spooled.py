"""Samples that come part by part: kept in memory while they are few, and in mapped files beyond."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from io import FileIO
from types import TracebackType
from typing import Self

import numpy as np

from dynident import files
from dynident.errors import RecordingError

IN_MEMORY = 1 << 24
"""Bytes of samples beyond which they are put into files."""


class Spool:
    """Signals of a recording as they are read, to be arrays when all is there.

    Up to `IN_MEMORY` they stay in memory. Beyond, each signal is a file of its own in the folder
    for temporary files (`TMPDIR`), which no other user may read and which has no name there: the
    system removes it with the last array that is mapped from it, however the program ends.

    Parameters
    ----------
    where : file, for messages.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._parts: dict[str, list[np.ndarray]] = {}
        self._open = ExitStack()
        self._files: dict[str, FileIO] = {}
        self._size = 0
        self._rows = 0
        self._widths: dict[str, tuple[int, ...]] = {}

    @property
    def words(self) -> str:
        """Where the samples lie, in words; empty where that is the memory."""
        if not self._files:
            return ""
        return f"mapped from files in {tempfile.gettempdir()} ({files.size_in_words(self._size)})"

    def add(self, rows: Mapping[str, np.ndarray]) -> None:
        """Add the next rows of every signal, (k,) or (k, n) doubles, the same ones each time.

        Raises
        ------
        RecordingError
            If there is no room for them on the disk; what is there already is then removed.
        """
        for name, x in rows.items():
            self._widths[name] = x.shape[1:]
            self._size += x.nbytes
            self._parts.setdefault(name, []).append(x)
        self._rows += len(next(iter(rows.values())))
        if self._files or self._size > IN_MEMORY:
            self._write()

    def arrays(self) -> dict[str, np.ndarray]:
        """Return each signal, (T,) or (T, n), read-only."""
        if not self._files:
            found = {
                name: parts[0] if len(parts) == 1 else np.concatenate(parts)
                for name, parts in self._parts.items()
            }
            for x in found.values():
                x.setflags(write=False)
            return found
        return {
            name: np.memmap(file, np.float64, "r", shape=(self._rows, *self._widths[name]))
            for name, file in self._files.items()
        }

    def _write(self) -> None:
        try:
            for name, parts in self._parts.items():
                if name not in self._files:
                    # Not buffered: that there is no room is said here, not when it is closed.
                    one = tempfile.TemporaryFile(prefix="dynident-", buffering=0)  # noqa: SIM115
                    self._files[name] = self._open.enter_context(one)
                for part in filter(len, parts):
                    left = np.ascontiguousarray(part).data.cast("B")
                    while left:
                        left = left[self._files[name].write(left) :]
                parts.clear()
        except OSError as error:
            self.close()
            folder, size = tempfile.gettempdir(), files.size_in_words(self._size)
            raise RecordingError(
                f"its samples cannot be put into {folder} ({error.strerror or error}, at {size})",
                self._where,
                "free some space, or name a larger folder in the variable TMPDIR",
            ) from None

    def close(self) -> None:
        """Let go of the files; arrays that are mapped from them stay."""
        self._open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
