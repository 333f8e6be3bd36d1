"""A small, safe XML reader that knows where in the text each element stands.

The positions let a description be patched in place; they come from expat, since `ElementTree` and
`defusedxml` keep none and `lxml` keeps lines only. Documents that declare a DOCTYPE are
refused before any of it is expanded: robot descriptions need none, and attacks on XML readers do.
Namespace prefixes stay part of the tag, so that an undeclared prefix (common in URDF) is no error.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from dynident.errors import RobotError
from dynident.words import nearest_and_all

Element = ElementTree.Element

# Up to the end of a tag; quoted values may hold a ">".
_TAG = re.compile(rb"""(?:"[^"]*"|'[^']*'|[^>"']++)*+>""")
# Far deeper than any robot, far shallower than what would exhaust a recursive walk.
_DEPTH = 200


@dataclass(frozen=True)
class Document:
    """A parsed XML text.

    Attributes
    ----------
    root : Element
    data : bytes
        The text as UTF-8, which `spans` count in.
    spans : dict
        id(element) -> (start of its start tag, end of its start tag, end of its end tag).
    """

    root: Element
    data: bytes
    spans: dict[int, tuple[int, int, int]]


class _Reader:
    def __init__(self, data: bytes, where: str) -> None:
        self.data, self.where = data, where
        self.builder = ElementTree.TreeBuilder()
        self.open: list[tuple[Element, int, int]] = []
        self.spans: dict[int, tuple[int, int, int]] = {}
        self.parser = expat.ParserCreate("utf-8")
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self.builder.data

    def _doctype(self, *_: object) -> None:
        raise RobotError(
            "declares a DOCTYPE, which a robot description does not need and which is not read",
            self.where,
            "remove the <!DOCTYPE ...> declaration",
        )

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        begin = self.parser.CurrentByteIndex
        if len(self.open) >= _DEPTH:
            raise RobotError(f"nests more than {_DEPTH} elements in each other", self.where)
        self.open.append((self.builder.start(tag, attributes), begin, self._tag_end(begin)))

    def _end(self, tag: str) -> None:
        self.builder.end(tag)
        element, begin, inner = self.open.pop()
        closes_itself = self.data[inner - 2 : inner] == b"/>"
        end = inner if closes_itself else self._tag_end(self.parser.CurrentByteIndex)
        self.spans[id(element)] = (begin, inner, end)

    def _tag_end(self, begin: int) -> int:
        tag = _TAG.match(self.data, begin)
        return tag.end() if tag else len(self.data)


def parse(text: str, where: str) -> Document:
    """Parse an XML text.

    Raises
    ------
    RobotError
        If it is not well-formed XML, declares a DOCTYPE, or nests absurdly deep.
    """
    data = text.encode("utf-8")
    reader = _Reader(data, where)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise RobotError(
            f"is not well-formed XML: {reason} (line {error.lineno}, column {error.offset + 1})",
            where,
        ) from None
    return Document(reader.builder.close(), data, reader.spans)


def to_text(root: Element) -> str:
    """Return the text of an element tree."""
    return ElementTree.tostring(root, encoding="unicode")


def only(element: Element, tag: str, where: str) -> Element | None:
    """Return the one child of that tag, None if it is absent.

    Parameters
    ----------
    element : Element
    tag : str
        Of the child.
    where : str
        For messages.

    Raises
    ------
    RobotError
        If there are two.
    """
    found = element.findall(tag)
    if len(found) > 1:
        raise RobotError(f"has {len(found)} <{tag}> elements", where, "keep one")
    return found[0] if found else None


def reals(text: str | None, count: int, what: str, where: str) -> NDArray[np.float64]:
    """Read `count` numbers separated by blanks; NaN and infinities pass, for a later check.

    Parameters
    ----------
    text : str or None
    count : int
        How many numbers there have to be.
    what : str
        What they are, for messages.
    where : str
        For messages.

    Returns
    -------
    (count,)

    Raises
    ------
    RobotError
        If the text is missing, is no number, or has another count.
    """
    values: list[float] = []
    for word in (text or "").split():
        if not is_number(word):
            raise RobotError(f"{what} = '{word}' is not a number", where)
        values.append(float(word))
    if len(values) != count:
        needs = "1 number is" if count == 1 else f"{count} numbers are"
        raise RobotError(f"{what} has {len(values)} numbers where {needs} needed", where)
    return np.array(values)


def is_number(word: str) -> bool:
    """Whether a word is a number to every reader of XML; Python's own takes `4_0` for 40."""
    if "_" in word or not word.isascii():
        return False
    try:
        float(word)
    except ValueError:
        return False
    return True


def finite(text: str | None, count: int, what: str, where: str) -> NDArray[np.float64]:
    """Read `count` finite numbers.

    Parameters
    ----------
    text, count, what, where
        As in `reals`.

    Returns
    -------
    (count,)

    Raises
    ------
    RobotError
        As in `reals`, or if one is not finite.
    """
    values = reals(text, count, what, where)
    if not np.all(np.isfinite(values)):
        raise RobotError(f"{what} = '{(text or '').strip()}' is not finite", where)
    return values


def closest(name: str, valid: Iterable[str]) -> str:
    """Return a remedy for a misspelt name: the nearest valid one, and the list."""
    return nearest_and_all(name, list(valid), "Valid names")
