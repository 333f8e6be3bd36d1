"""What the name of a column says that it holds: which signal, of which joint, in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Signal = Literal["t", "q", "v", "a", "tau", "current", "temperature"]
Origin = Literal["plain", "measured", "reference", "command"]

_SIGNALS: dict[Signal, frozenset[str]] = {
    "t": frozenset(["t", "time", "times", "timestamp", "timestamps", "stamp", "clock"]),
    "q": frozenset(
        [
            "q",
            "qm",
            "qs",
            "pos",
            "position",
            "positions",
            "angle",
            "angles",
            "theta",
            "phi",
            "encoder",
        ]
    ),
    "v": frozenset(
        ["v", "dq", "qd", "qdot", "vel", "velocity", "velocities", "speed", "speeds", "omega"]
    ),
    "a": frozenset(["a", "ddq", "qdd", "qddot", "acc", "accel", "acceleration", "accelerations"]),
    "tau": frozenset(
        [
            "tau",
            "torque",
            "torques",
            "effort",
            "efforts",
            "trq",
            "moment",
            "force",
            "forces",
            "tauj",
        ]
    ),
    "current": frozenset(["i", "current", "currents", "curr", "amps", "cur", "voltage", "vir"]),
    "temperature": frozenset(["temp", "temperature", "temperatures"]),
}
_SIGNAL_OF: dict[str, Signal] = {
    word: signal for signal, words in _SIGNALS.items() for word in words
}
_ORIGINS: dict[Origin, frozenset[str]] = {
    "measured": frozenset(["actual", "act", "measured", "meas", "msr", "real"]),
    "reference": frozenset(["ref", "reference", "des", "desired", "target", "goal", "setpoint"]),
    "command": frozenset(["cmd", "command", "commanded", "con", "ctrl", "control"]),
}
_ORIGIN_OF: dict[str, Origin] = {
    word: origin for origin, words in _ORIGINS.items() for word in words
}
_SCALES: dict[str, tuple[Signal, float]] = {
    "deg": ("q", math.pi / 180),
    "degree": ("q", math.pi / 180),
    "degrees": ("q", math.pi / 180),
    "mnm": ("tau", 1e-3),
    "nmm": ("tau", 1e-3),
    "ms": ("t", 1e-3),
    "msec": ("t", 1e-3),
    "us": ("t", 1e-6),
    "usec": ("t", 1e-6),
    "ns": ("t", 1e-9),
    "nsec": ("t", 1e-9),
    "nanosec": ("t", 1e-9),
}
"""Words for units, of which signal, and what makes ours of them; degrees are of speeds too."""
_UNITS = frozenset(["rad", "nm", "s", "sec", "secs", "second", "seconds", "m", "n"])
_ANGULAR: tuple[Signal, ...] = ("q", "v", "a")
_WORDS = re.compile(r"mNm|Nmm|Nm|[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")


@dataclass(frozen=True, kw_only=True)
class ColumnRole:
    """What a column holds, as far as its name tells.

    Attributes
    ----------
    column : its name.
    signal : which.
    origin : whether it is what was measured, a reference or a command, where the name says so.
    joint : number of the joint in the robot that the name holds; None where it holds none.
    number : last number in the name, which may count joints from 0 or from 1; None without one.
    stem : the rest of the name: columns of a table have it in common.
    scale : ours over theirs, from a unit in the name.
    """

    column: str
    signal: Signal
    origin: Origin
    joint: int | None
    number: int | None
    stem: tuple[str, ...]
    scale: float = 1.0


def role_of(column: str, joints: Sequence[str]) -> ColumnRole | None:
    """Read the name of a column.

    Parameters
    ----------
    column : as the file spells it, `name[3]` for a column of a table.
    joints : names of the robot's joints.

    Returns
    -------
    None where no word of it names a signal.
    """
    words = _words(column)
    words, joint = _without_joint(words, joints)
    signal: Signal | None = None
    origin: Origin = "plain"
    number: int | None = None
    scales: list[tuple[Signal, float]] = []
    stem: list[str] = []
    for at, word in enumerate(words):
        if word.isdigit():
            number = int(word)
        elif word in _SCALES:
            scales.append(_SCALES[word])
        elif word in _ORIGIN_OF and origin == "plain":
            origin = _ORIGIN_OF[word]
        elif word == "d" and at == len(words) - 1 and signal is not None:
            origin = "reference"  # tau_J_d, q_d: desired
        elif word in _SIGNAL_OF and (signal is None or _sharper(_SIGNAL_OF[word], signal)):
            signal = _SIGNAL_OF[word]
        elif word not in _UNITS:
            stem.append(word)
    if signal is None:
        return None
    return ColumnRole(
        column=column,
        signal=signal,
        origin=origin,
        joint=joint,
        number=number,
        stem=tuple(stem),
        scale=math.prod(
            (x for of, x in scales if of == signal or (of == "q" and signal in _ANGULAR)), start=1.0
        ),
    )


def _sharper(new: Signal, old: Signal) -> bool:
    """Whether the second signal in a name is what it holds: `torque current`, `t position`."""
    return old == "t" or (old == "tau" and new in ("current", "temperature"))


def _words(name: str) -> list[str]:
    return [word.lower() for word in _WORDS.findall(name)]


def _without_joint(words: list[str], joints: Sequence[str]) -> tuple[list[str], int | None]:
    """The words less those of the longest joint's name among them, and that joint."""
    found: tuple[int, int, int] | None = None
    for number, joint in enumerate(joints):
        own = _words(joint)
        for start in range(len(words) - len(own) + 1):
            same = words[start : start + len(own)] == own
            # A joint called "q" or "1" is no name that a column can be told by.
            if same and len(own) and (len(own) > 1 or own[0] not in _SIGNAL_OF):
                if own[0].isdigit() and len(own) == 1:
                    continue
                if found is None or len(own) > found[1]:
                    found = start, len(own), number
    if found is None:
        return words, None
    start, length, number = found
    return words[:start] + words[start + length :], number
