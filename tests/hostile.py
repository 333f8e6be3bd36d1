"""Estimates' files, damaged one key at a time."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from dynident.fitting import Estimate, fit
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

DELETED = object()
HUGE = 10**400
NAN = float("nan")


def estimate_of_arm() -> Estimate:
    """A fit of the two-joint arm, links not chosen."""
    model = Model(arm()) + "viscous_friction"
    return fit(model, Dataset((synthetic(model, true_values(model), 0, duration=6.0),)))


def changed(content: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Return a copy with another value at a dotted key; numbers count in lists."""
    made = copy.deepcopy(content)
    *path, last = (int(part) if part.isdigit() else part for part in key.split("."))
    inner: Any = made
    for part in path:
        inner = inner[part]
    if value is DELETED:
        del inner[last]
    else:
        inner[last] = value
    return made


MUTATIONS: dict[str, tuple[str, Any]] = {
    f"{key}: {name}": (key, value)
    for key, values in {
        "format": {"none": None, "other": "dynident-estimate-9", "missing": DELETED},
        "covariance": {"null": None, "2x2": np.eye(2).tolist(), "missing": DELETED, "text": "x"},
        "covariance.0": {"short": [1.0], "number": 1.0},
        "covariance.0.0": {"NaN": NAN, "negative": -1.0, "huge": HUGE},
        "covariance.0.1": {"skew": 1e6},
        "parameters": {"none": [], "text": "x", "table": {}},
        "parameters.0": {"null": None, "number": 1},
        "parameters.0.value": {"text": "x", "table": {}, "huge": HUGE, "NaN": NAN, "1e308": 1e308},
        "parameters.0.name": {"other": "m.leg", "number": 1},
        "basis": {"null": None, "list": []},
        "basis.names": {"none": [], "text": "x"},
        "basis.names.0": {"other": "m.leg"},
        "basis.independent": {"none": [], "twice": [0, 0], "text": "x"},
        "basis.independent.0": {"far": 10**6, "negative": -1, "real": 0.5},
        "basis.dependent": {"one more": [0]},
        "basis.expressions": {"none": []},
        "basis.K": {"null": None, "flat": [1.0], "number": 1.0},
        "basis.scale": {"none": [], "text": "x"},
        "basis.scale.0": {"huge": HUGE, "negative": -1.0},
        "basis.diagonal": {"none": [], "zeros": [0.0] * 9},
        "basis.diagonal.0": {"zero": 0.0, "NaN": NAN},
        "basis.tolerance": {"text": "x", "NaN": NAN},
        "torque_std": {"short": [1.0], "null": None},
        "joint_errors.0": {"text": "x", "negative": -1.0},
        "error": {"text": "x", "list": []},
        "condition_number": {"table": {}},
        "rows": {"text": "x", "real": 1.5, "huge": HUGE, "negative": -1, "yes": True},
        "notes": {"text": "x", "numbers": [1]},
        "recordings.0": {"null": None},
        "recordings.0.file": {"number": 1},
        "links": {"list": [], "of a number": {"upper": 1.0}},
        "certificate": {"text": "x"},
        "model": {"null": None, "missing": DELETED},
        "model.robot": {"null": None, "text": "x", "empty": ""},
        "model.joints": {"none": [], "other": ["shoulder", "knee"], "text": "x"},
        "model.gravity": {"short": [0.0, 0.0], "huge": [0.0, 0.0, HUGE], "text": "x"},
        "model.friction_width": {"zero": 0.0, "huge": HUGE},
        "model.effects": {"none": [], "text": "x"},
        "model.effects.0.effect": {"other": "magic", "list": []},
        "model.effects.0.joint": {"other": "knee", "number": 1},
        "model.effects.0.shape": {"one": [1.0], "text": "x"},
    }.items()
    for name, value in values.items()
}
"""By kind: the key and the value that it takes."""
