"""The criteria of a diagnosis as a JSON Schema, for editors and the reference of the study file."""

from __future__ import annotations

import inspect
import math
from dataclasses import fields
from typing import Any

from dynident.criteria.criteria import DEFAULTS
from dynident.criteria.criterion import AboutCriterion, about


def criteria_schema() -> dict[str, Any]:
    """Return what a schema says of [criteria]: groups, and in each its criteria."""
    return {
        "additionalProperties": False,
        "properties": {
            group.name: {
                "type": "object",
                "description": inspect.getdoc(getattr(DEFAULTS, group.name)),
                "additionalProperties": False,
                "properties": {
                    one.name: _of(about(one)) for one in fields(getattr(DEFAULTS, group.name))
                },
            }
            for group in fields(DEFAULTS)
        },
    }


def _of(known: AboutCriterion) -> dict[str, Any]:
    default = known.default
    first = default[0] if isinstance(default, tuple) else default
    number: dict[str, Any] = {"type": "integer" if isinstance(first, int) else "number"}
    if known.over > -math.inf:
        number["exclusiveMinimum"] = known.over
    elif known.least > -math.inf:
        number["minimum"] = known.least
    if known.most < math.inf:
        number["maximum"] = known.most
    said = {"description": f"{known.what[:1].upper()}{known.what[1:]}.", "unit": known.unit}
    if isinstance(default, tuple):
        return {"type": "array", "minItems": 2, "items": number, "default": [*default], **said}
    return {**number, "default": default, **said}
