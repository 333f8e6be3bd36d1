"""What a page of the report holds, read back."""

from __future__ import annotations

import base64
import gzip
import re
from html.parser import HTMLParser


def unpacked(data: str) -> str:
    """Content of a script element that is packed."""
    return gzip.decompress(base64.b64decode(data)).decode()


class Elements(HTMLParser):
    """Elements with their attributes, and the text outside scripts and styles."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict]] = []
        self.words: list[str] = []
        self.figures = ""
        self._open = ("", {})
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self._open = (tag, dict(attrs))
        self.elements.append(self._open)

    def handle_endtag(self, tag):
        self._open = ("", {})

    def handle_data(self, data):
        tag, attributes = self._open
        if tag == "script" and attributes.get("id") == "figures":
            self.figures += unpacked(data)
        elif tag not in ("script", "style"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))
