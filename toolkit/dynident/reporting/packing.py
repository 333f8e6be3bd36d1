"""Figures and their library in a page: compressed, and what several figures share written once.

Plotly writes each figure whole, template and times included; a page of fifty would be five times
as large. Its library is two thirds smaller compressed; every browser since 2023 decompresses it.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

_SMALLEST = 100
"""Characters from which on an array is worth sharing."""


@dataclass
class _Shared:
    """Parts that were met, in the order of their numbers."""

    parts: list[Any] = field(default_factory=list)
    numbers: dict[str, int] = field(default_factory=dict)

    def reference(self, key: str, part: Any) -> dict[str, int]:
        if key not in self.numbers:
            self.numbers[key] = len(self.parts)
            self.parts.append(part)
        return {"shared": self.numbers[key]}

    def packed(self, part: Any) -> Any:
        if isinstance(part, list):
            return [self.packed(one) for one in part]
        if not isinstance(part, dict):
            return part
        if len(part.get("bdata", "")) > _SMALLEST:
            return self.reference(part["dtype"] + part["bdata"], part)
        return {
            key: self.reference(json.dumps(one), one) if key == "template" else self.packed(one)
            for key, one in part.items()
        }


@dataclass(frozen=True)
class Packed:
    """Content of three script elements: figures by name, parts they refer to, and their library.

    Each is text, compressed by gzip and written in base 64.
    """

    figures: Markup
    shared: Markup
    library: Markup


def packed(figures: Mapping[str, go.Figure]) -> Packed:
    """Pack figures; a part `{"shared": k}` stands for the k-th shared part.

    The curves of one picture have their times in common, and all pictures one look.
    """
    shared = _Shared()
    parts = {name: shared.packed(json.loads(str(one.to_json()))) for name, one in figures.items()}
    return Packed(
        figures=compressed(_json(parts)),
        shared=compressed(_json(shared.parts)),
        library=_library(),
    )


@cache
def _library() -> Markup:
    """Plotly's library: millions of characters, the same in every page."""
    return compressed(get_plotlyjs())


def compressed(text: str) -> Markup:
    """Text as a script element holds it: base 64 has no character that could close one."""
    return Markup(base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode())


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)
