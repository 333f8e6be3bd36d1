"""Lines of comment among the samples of a text file: counted, and where they are."""

from __future__ import annotations

import re

_COMMENTS = re.compile(rb'^[ \t]*"?[ \t]*(?:#|%|//)', re.MULTILINE)
_WORDS = re.compile(_COMMENTS.pattern + rb".*", re.MULTILINE)
_LISTED = 1000
"""Lines of comment up to which the line of each sample is known once they have been read."""


class CommentLines:
    """Lines of comment among the samples, as far as these have been read."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._count, self._lines = 0, []

    def found_in(self, body: bytes, above: int) -> bool:
        """Note those of some lines; whether there are any."""
        # Their marks are rare, and a search for one byte is a hundred times as fast as one for an
        # expression, and fifty times as fast as one for two bytes.
        if not any(mark in body for mark in (b"#", b"%", b"/")):
            return False
        before, line, place = self._count, above + 1, 0
        for found in _COMMENTS.finditer(body):
            self._count += 1
            if self._count <= _LISTED:
                line, place = line + body.count(b"\n", place, found.start()), found.start()
                self._lines.append(line)
        return self._count > before

    def numbered(self, first: int) -> tuple[int, tuple[int, ...]]:
        """Return what `ColumnTable.lines` does, given the line of the first sample."""
        return (first, tuple(self._lines)) if self._count <= _LISTED else (0, ())

    @property
    def words(self) -> tuple[str, ...]:
        """That there were some."""
        if not self._count:
            return ()
        return (f"{self._count} line{'s' * (self._count != 1)} of comment among the samples",)


def without_words(body: bytes) -> bytes:
    """Return lines with nothing in those of comment but the mark that they are some."""
    return _WORDS.sub(b"#", body)
