"""Files of effects as users write them, for tests: sound ones, and what nobody should run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

SAG = '''"""What the cables of our arm do."""

import numpy as np

from dynident.effects import JointEffect, Parameter, force_unit, motion_unit


class CableSag(JointEffect):
    """Drag of a cable that hangs more in one position than in another."""

    name = "cable_sag"
    law = "c v sin(3 q)"
    sign_of = "a slope against velocity that changes with the position"
    meaning = "a cable drags more in some positions than in others"
    experiment = "move {joint} at the same speeds in several places"

    def parameters(self, robot):
        unit = f"{force_unit(robot, self.joint)} s/{motion_unit(robot, self.joint)}"
        return (Parameter("c", unit),)

    def at_joint(self, block):
        j = [block.index(self.joint)]
        return block.v[:, j] * np.sin(3 * block.q[:, j])
'''
"""A class of twenty lines, as a user writes it."""

SAGGING = """
[[effects]]
effect = "viscous_friction"
values = { Fv = 1.0 }

[[effects]]
effect = "cable_sag@elbow"
values = { c = 0.5 }
"""
"""The effects of an arm with that cable, in an experiment."""


def with_columns(line: str) -> str:
    """The same class with another last line."""
    head, _, _ = SAG.rpartition("        return")
    return f"{head}        {line}\n"


TWICE = "class {0}(JointEffect):\n    name = 'cable_sag'\n    def parameters(self, robot): ...\n"
TWICE += "    def at_joint(self, block): ...\n"

HOSTILE: dict[str, tuple[str | bytes | None, str]] = {
    "syntax": ("def f(:\n", r"mine.py:1: SyntaxError: invalid syntax"),
    "indentation": ("if True:\npass\n", r"mine.py:2: SyntaxError: expected an indented block"),
    "exit": ("import sys\nsys.exit(0)\n", r"mine.py:2: SystemExit: 0"),
    "quit": ("\nraise SystemExit\n", r"mine.py:2: SystemExit"),
    "error": ("1 / 0\n", r"mine.py:1: ZeroDivisionError: division by zero"),
    "lines of an error": ("raise ValueError('a\\nb\\x1b[31m')\n", r"mine.py:1: ValueError: a b"),
    "import": ("import no_such_thing\n", r"mine.py:1: ModuleNotFoundError: No module named"),
    "neighbour": ("from . import other\n", r"mine.py:1: ImportError: "),
    "recursion": ("def f():\n    f()\nf()\n", r"mine.py:2: RecursionError: "),
    "clash with us": (SAG.replace("cable_sag", "backlash"), r"two effects are named 'backlash': "),
    "clash for ever": (
        "from dynident.effects import JointEffect\nwhile True:\n"
        + "".join(f"    {x}\n" for x in (TWICE.format("A") + TWICE.format("B")).splitlines()),
        r"mine.py:7: two effects are named 'cable_sag': A \(.*mine.py:3\) and B \(.*mine.py:7\)",
    ),
    "a name with blanks": (SAG.replace("cable_sag", "cable sag"), r"its name 'cable sag' cannot"),
    "null": ("a = 1\0\n", r"mine.py(:\d+)?: SyntaxError: "),
    "no UTF-8": (b"a = '\xff\xfe'\n", r"mine.py(:\d+)?: SyntaxError: "),
    "unknown coding": ("# coding: klingon\n", r"mine.py(:\d+)?: SyntaxError: "),
    "nested": ("(" * 5000 + ")" * 5000, r"mine.py(:\d+)?: (SyntaxError|MemoryError)"),
    "huge": (b"#" * ((1 << 20) + 1), r"mine.py: holds 1 MB, and 1 MB is the limit"),
    "not there": (None, r"mine.py: no such file"),
}
"""Name -> content of `mine.py` that cannot be imported (None for no file), and what is said."""

UNSOUND: dict[str, tuple[str, str]] = {
    "raises": (with_columns("return {}['speed']"), r"mine.py:\d+: cable_sag@.*: KeyError: 'speed'"),
    "leaves": (with_columns("raise SystemExit(3)"), r"cable_sag@shoulder: SystemExit: 3"),
    "shape": (with_columns("return np.ones((3, 2))"), r"cable_sag@.*(shape|broadcast)"),
    "two columns": (
        with_columns("return block.q[:, :2]"),
        r"shape \(25, 2, 2\) where \(25, 2, 1\)",
    ),
    "numbers": (
        with_columns("return block.v[:, j] * np.nan"),
        r"25 of 25 of .* are not finite",
    ),
    "list": (with_columns("return block.v[:, j].tolist()"), r"cable_sag@shoulder: AttributeError"),
    "no parameters": (
        SAG.replace("return (Parameter(", "return ((").replace(", unit)", ")"),
        r"cable_sag@shoulder: ",
    ),
    "candidates": (
        SAG + "\n    @classmethod\n    def candidates(cls, robot):\n        yield 7\n",
        r"cable_sag: AttributeError: ",
    ),
}
"""Name -> content whose effects are none, and what is said of them."""

PLACES = {"folder": "is a folder", "pipe": "not a regular file", "text": "not called a Python file"}


def put(path: Path, content: str | bytes | None) -> None:
    """Write a file of effects."""
    if content is not None:
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def put_place(folder: Path, place: str) -> str:
    """Put something that is no module in its place; return its name."""
    if place == "folder":
        (folder / "mine.py").mkdir()
    elif place == "pipe":
        os.mkfifo(folder / "mine.py")
    else:
        (folder / "mine.txt").write_text(SAG)
        return "mine.txt"
    return "mine.py"


@pytest.fixture
def own_settings(tmp_path_factory, monkeypatch) -> Path:
    """A folder for the settings of a user who has not trusted anything yet."""
    folder = tmp_path_factory.mktemp("config")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    return folder
