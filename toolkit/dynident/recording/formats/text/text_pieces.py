"""Text of any length in pieces of whole lines."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from typing import BinaryIO

from dynident.errors import FileError, RecordingError

AT_ONCE = 1 << 21
"""Bytes of text that are read at a time. What pandas takes for more of it goes back to the system
after each piece, and comes again page by page, which took a fifth of the time of reading."""
LONGEST_LINE = 1 << 24
"""Bytes of a line, of a stretch of empty ones, or of lines between two quotation marks."""
_BREAKS = b"\r\n"
_TAIL = 1 << 12
"""Bytes in which the end of the last line is looked for at a time."""


_LATIN = re.compile(rb"[\t\n\r -~\xb0\xb2\xb3\xb5\xb7\xc0-\xd6\xd8-\xf6\xf8-\xfd]*")
"""ISO 8859-1 with no more than its letters and the signs of units, of which hardly any other bytes
consist."""


def text_pieces(stream: BinaryIO, file: str) -> Iterator[bytes]:
    """Yield UTF-8 text in pieces of whole lines, with line feeds between the lines.

    Text in ISO 8859-1 (Latin-1), as programs of Windows write umlauts and degree signs, is made
    UTF-8 where it is letters and units.

    Empty lines are at the beginning of a piece, and in it, but not at its end; those at the end of
    a long text are left out. Quotation marks are closed in the piece in which they are opened.

    Parameters
    ----------
    stream : of the text, at its beginning.
    file : for messages.

    Raises
    ------
    FileError
        If it is neither, or cannot be read.
    RecordingError
        If a line is longer than any of numbers.
    """
    rest, place = b"", 0
    while True:
        try:
            block = stream.read(AT_ONCE)
        except OSError as error:
            raise FileError(f"cannot be read ({error.strerror or error})", file) from None
        raw = rest + block
        end = _end(raw) if block else len(raw)
        # Marks are rare: to find that there is none takes far less than to count them.
        if block and end < len(raw) and b'"' in raw and raw.count(b'"', 0, end) % 2:
            end = 0
        is_header = not place and not any(one in raw[:end].strip() for one in (b"\r", b"\n"))
        if block and is_header:
            end = 0  # the first line comes with the next one: alone it looks like a file of no rows
        if b"\0" in block:
            _text(raw, place, file)  # which says what it is
        if not end and len(raw) > LONGEST_LINE:
            end = _end(raw)  # a mark that is never closed is for who reads the lines
            if not end or is_header:
                what = f"holds a line, or empty lines, of more than {LONGEST_LINE >> 20} MB"
                raise RecordingError(what, file, "is it the right file?")
        piece, rest = raw[:end], raw[end:]
        if piece and not (place and piece.isspace()):
            yield _text(piece, place, file)
        place += end
        if not block:
            return


def _end(raw: bytes) -> int:
    """Where the last line that is not empty and complete ends; 0 if there is none."""
    # A carriage return at the very end may be half of a line's end.
    last = max(raw.rfind(one, 0, len(raw) - 1) for one in (b"\r", b"\n")) + 1
    last = len(raw) if raw.endswith(b"\n") else last
    filled = _filled(raw, last)
    if not filled:
        return 0
    end = filled + len(raw[filled:last]) - len(raw[filled:last].lstrip(b" ")) + 1
    return end + 1 if raw[end - 1 : end + 1] == _BREAKS else end


def _filled(raw: bytes, last: int) -> int:
    """Where what is no blank ends before `last`, which is looked for without a copy of it all."""
    while last:
        start = max(0, last - _TAIL)
        if kept := len(raw[start:last].rstrip(b" " + _BREAKS)):
            return start + kept
        last = start
    return 0


def _text(raw: bytes, place: int, file: str) -> bytes:
    """Lines of UTF-8 text; no copy where they are as they are wanted."""
    try:
        if not raw.isascii():
            raw.decode()
    except UnicodeDecodeError as error:
        if _LATIN.fullmatch(raw):
            return _text(raw.decode("latin-1").encode(), place, file)
        what = f"is not UTF-8 text (byte {place + error.start})"
        raise FileError(what, file, "is it the right file?") from None
    if b"\0" in raw:
        what = "is not text (it holds NUL bytes)"
        raise FileError(what, file, "is it the right file?")
    raw = raw if place else raw.removeprefix(codecs.BOM_UTF8)
    return raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in raw else raw
