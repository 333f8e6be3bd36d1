"""Figures as JSON in a page: what several of them share is written once.

Plotly writes each figure whole, template and times included; a page of fifty would be five times
as large.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import plotly.graph_objects as go
from markupsafe import Markup

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
    """JSON for two script elements: the figures by name, and the parts that they refer to."""

    figures: Markup
    shared: Markup


def packed(figures: Mapping[str, go.Figure]) -> Packed:
    """Pack figures; a part `{"shared": k}` stands for the k-th shared part.

    The curves of one picture have their times in common, and all pictures one look.
    """
    shared = _Shared()
    parts = {name: shared.packed(json.loads(str(one.to_json()))) for name, one in figures.items()}
    return Packed(_json(parts), _json(shared.parts))


def _json(content: Any) -> Markup:
    # Written as escapes, so that no text can close the script element.
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
