"""Hostile estimates: files that are damaged one key at a time, and others that are none."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from dynident.fitting import Estimate, fit
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from hostile.case import ANSWER, Content, HostileCase, folder, hole, link_to
from loop_studies import LOOP_STUDY, write_loop_study
from synthetic import ARM, arm, synthetic, true_values

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


@cache
def good() -> str:
    """The file of a sound estimate."""
    return json.dumps(estimate_of_arm().to_dict())


def damaged(key: str, value: Any) -> Callable[[Path], object]:
    """Return what makes the file of an estimate with another value at a key."""
    return lambda path: path.write_text(json.dumps(changed(json.loads(good()), key, value)))


def sound(change: Callable[[str], str | bytes]) -> Callable[[Path], object]:
    """Return what makes the file of an estimate, its text changed."""

    def make(path: Path) -> None:
        text = change(good())
        path.write_bytes(text if isinstance(text, bytes) else text.encode())

    return make


def of_another_robot(text: str) -> Callable[[Path], object]:
    """Return what makes the file of an estimate of another robot."""

    def make(path: Path) -> None:
        model = Model(Robot.from_text(text)) + "viscous_friction"
        fit(model, Dataset((synthetic(model, true_values(model), 0, duration=6.0),))).save(path)

    return make


def _covariance(change: Callable[[np.ndarray], object]) -> Callable[[Path], object]:
    """Return what makes an estimate whose covariance was changed."""

    def make(path: Path) -> None:
        content = json.loads(good())
        matrix = np.array(content["covariance"])
        change(matrix)
        path.write_text(json.dumps({**content, "covariance": matrix.tolist()}))

    return make


def _outward(matrix: np.ndarray) -> None:
    """Correlations of 2 and -2: symmetric, and no covariance."""
    scale = np.sqrt(np.diag(matrix))
    for i, j, r in ((0, 1, 2.0), (1, 2, -2.0)):
        matrix[i, j] = matrix[j, i] = r * scale[i] * scale[j]


THREE = ARM.replace(
    "</robot>",
    '<link name="hand"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
    'iyz="0"/></inertial></link><joint name="wrist" type="revolute"><parent link="fore"/>'
    '<child link="hand"/><axis xyz="0 0 1"/></joint></robot>',
)
NEITHER = r"fit\.json: (is neither a robot description nor a saved|is not a dynident) estimate"
OTHERS: dict[str, tuple[Content, str]] = {
    "empty": ("", r"fit\.json: is empty"),
    "blank": (" \n\t", r"fit\.json: is empty"),
    "junk": ("junk", NEITHER),
    "a number": ("1", NEITHER),
    "null": ("null", NEITHER),
    "a list": ("[]", NEITHER),
    "very deep": ("[" * 100_000, NEITHER),
    "very deep tables": ('{"a":' * 50_000, r"fit\.json: is not a dynident estimate"),
    "many digits": ('{"rows": ' + "1" * 5000 + "}", r"fit\.json: is not a dynident estimate"),
    "a key twice": (sound(lambda text: text.replace("{", '{"format": "x", ', 1)), ANSWER),
    "NaN": ("NaN", NEITHER),
    "cut in the middle": (
        sound(lambda text: text[: len(text) // 2]),
        r"fit\.json: is not a dynident estimate",
    ),
    "two estimates": (sound(lambda text: text + text), r"fit\.json: is not a dynident estimate"),
    "UTF-16": (sound(lambda text: text.encode("utf-16")), r"fit\.json: is not UTF-8 text"),
    "Latin 1": (
        sound(lambda text: text.replace("arm", "\xe4rm").encode("latin-1")),
        r"fit\.json: is not UTF-8 text",
    ),
    "a byte order mark": (sound(lambda text: b"\xef\xbb\xbf" + text.encode()), ANSWER),
    "a lone surrogate": (damaged("notes", ["\ud800"]), r"fit\.json: is not a dynident estimate"),
    "a note that paints": (damaged("notes", ["\x1b[2J\u202e"]), ANSWER),
    "a note of 10 MB": (damaged("notes", ["x" * 10_000_000]), ANSWER),
    "an estimate of 100 MB": (hole(100 << 20), r"fit\.json: holds 100 MB, and 64 MB is the limit"),
    "a folder": (folder, r"fit\.json: is a folder, not a file"),
    "a pipe": (os.mkfifo, r"fit\.json: is not a regular file, but a device, a pipe or a socket"),
    "a device": (
        link_to("/dev/zero"),
        r"fit\.json: is not a regular file, but a device, a pipe or a socket",
    ),
    "a robot of a bomb": (
        damaged("model.robot", '<!DOCTYPE r [<!ENTITY a "ha">]><robot name="&a;"/>'),
        r"fit\.json: is not a dynident estimate",
    ),
    "a robot of a file": (
        damaged("model.robot", "/etc/passwd"),
        r"fit\.json: is not a dynident estimate",
    ),
    "a robot of others": (damaged("model.robot", THREE), ANSWER),
    "effects of everything": (
        damaged("model.effects", [{"effect": "viscous_friction", "joint": "elbow"}] * 1000),
        r"fit\.json: is not a dynident estimate",
    ),
    "parameters of everything": (
        damaged("parameters", [{}] * 100_000),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance of a million": (
        damaged("covariance", [[0.0] * 1000] * 1000),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance that is not positive": (
        _covariance(_outward),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance that is negative": (
        _covariance(lambda x: np.negative(x, out=x)),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance that is skew": (
        _covariance(lambda x: x.__setitem__((0, 1), 1.0)),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance of 1e308": (
        _covariance(lambda x: x.fill(1e308)),
        r"fit\.json: is not a dynident estimate",
    ),
    "a covariance of nothing": (_covariance(lambda x: x.fill(0.0)), ANSWER),
    "a mass of 1e30 kg": (
        damaged("parameters.0.value", 1e30),
        r"fit\.json: is not a dynident estimate",
    ),
    "a mass of -0": (damaged("parameters.0.value", -0.0), ANSWER),
}
"""Content of `fit.json`, and the one line of two commands."""

LOOPS: dict[str, tuple[Content, str]] = {
    "of another robot": (
        of_another_robot(THREE),
        r"fit\.json: is of a robot with the joints shoulder, elbow, wrist, and the",
    ),
    "of a robot of other names": (
        of_another_robot(ARM.replace("elbow", "knee")),
        r"fit\.json: is of a robot with the joints shoulder, knee, and the study's",
    ),
    "of a robot in another order": (
        of_another_robot(
            ARM.replace("elbow", "x").replace("shoulder", "elbow").replace('"x"', '"shoulder"')
        ),
        r"fit\.json: is of a robot with the joints elbow, shoulder, and the study's",
    ),
    "of nothing": ("{}", r"fit\.json: is not a dynident estimate"),
    "of negative masses": (
        sound(
            lambda text: json.dumps(
                {
                    **(content := json.loads(text)),
                    "parameters": [
                        {**one, "value": -one["value"]} for one in content["parameters"]
                    ],
                }
            )
        ),
        ANSWER,
    ),
}
"""Content of an estimate that a loop is simulated with."""

CHECKED = (("check", "fit.json"), ("refit", "fit.json", "--out", "new.urdf"))
CASES = {
    **{
        f"damaged, {kind}": HostileCase(
            commands=CHECKED,
            files={"fit.json": damaged(key, value)},
            message=r"fit.json: is not a dynident estimate \([\w.]+: .*\)\. save one",
        )
        for kind, (key, value) in MUTATIONS.items()
    },
    **{
        name: HostileCase(
            commands=CHECKED if message else CHECKED[:1],
            files={"fit.json": content},
            message=message,
        )
        for name, (content, message) in OTHERS.items()
    },
    **{
        f"simulated, {name}": HostileCase(
            commands=(("simulate", "study.toml", "--estimate", "fit.json"),),
            files={
                "study.toml": lambda path: write_loop_study(path.parent, LOOP_STUDY),
                "fit.json": content,
            },
            message=message,
        )
        for name, (content, message) in LOOPS.items()
    },
}
