"""What the name of a column says that it holds: which signal, of which joint, in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

Signal = Literal["t", "q", "v", "a", "tau", "current", "temperature"]
Origin = Literal["plain", "measured", "reference", "command"]


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_SIGNALS: dict[Signal, frozenset[str]] = {
    "t": _set("t time times timestamp timestamps stamp clock"),
    "q": _set("q qm qs pos position positions angle angles theta phi encoder"),
    "v": _set("v dq qd qdot vel velocity velocities speed speeds omega"),
    "a": _set("a ddq qdd qddot acc accel acceleration accelerations"),
    "tau": _set("tau tauj torque torques effort efforts trq moment force forces"),
    "current": _set("i current currents curr cur amps voltage vir"),
    "temperature": _set("temp temperature temperatures"),
}
_SIGNAL_OF: dict[str, Signal] = {
    word: signal for signal, words in _SIGNALS.items() for word in words
}
_ORIGINS: dict[Origin, frozenset[str]] = {
    "measured": _set("actual act measured meas msr real fbk feedback ist pv"),
    "reference": _set(
        "ref reference des desired target goal setpoint set sp soll demand dmd planned nominal"
    ),
    "command": _set("cmd command commanded con ctrl control"),
}
_ORIGIN_OF: dict[str, Origin] = {
    word: origin for origin, words in _ORIGINS.items() for word in words
}
_OTHER = _set(
    "tcp tool ee cartesian pose wrench ext external ff gravity friction limit max min err error lag"
)
"""Words of what is no signal of a joint, or is worked out by a controller: left alone."""
_SCALES: dict[str, tuple[Signal, float]] = {
    **dict.fromkeys(_set("deg degree degrees dps"), ("q", math.pi / 180)),
    **dict.fromkeys(_set("mm millimetre millimetres millimeter millimeters"), ("q", 1e-3)),
    "cm": ("q", 1e-2),
    "rpm": ("v", math.pi / 30),
    **dict.fromkeys(_set("mnm nmm"), ("tau", 1e-3)),
    **dict.fromkeys(_set("ms msec msecs milliseconds"), ("t", 1e-3)),
    **dict.fromkeys(_set("us usec usecs microseconds"), ("t", 1e-6)),
    **dict.fromkeys(_set("ns nsec nsecs nanosec nanosecs nanoseconds"), ("t", 1e-9)),
}
"""Words for units, of which signal, and what makes ours of them; degrees and millimetres may be of
speeds."""
_UNITS = _set("rad radian radians nm s sec secs second seconds m n")
_ANGLES = _set("deg degree degrees rad radian radians")
_LENGTHS = _set("mm millimetre millimetres millimeter millimeters cm")
_OF_ANOTHER = _set("n nm kn kg g rpm")
"""What before a length makes another quantity of it."""
_SECONDS = _set("s sec secs second seconds")
_SIGNAL_OF_UNIT: dict[str, Signal] = {
    **dict.fromkeys(_set("rpm dps"), "v"),
    **dict.fromkeys(_set("nm mnm nmm"), "tau"),
    **dict.fromkeys(_set("ampere amperes"), "current"),
}
"""What a unit alone tells, where no word of a name says more; angles and lengths go by the seconds
behind."""
_SQUARED = re.compile(
    r"((?:deg(?:rees?)?|rad(?:ians?)?|[mc]m)(?:\W|_|p)s)(?:\^|\*\*)?2(?!\d)", re.IGNORECASE
)
_NO_ANGLE = _set("c f celsius fahrenheit")
"""What behind degrees makes a temperature of them."""
_ANGULAR: tuple[Signal, ...] = ("q", "v", "a")
_WORDS = re.compile(r"mNm|Nmm|Nm|[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")


@dataclass(frozen=True, kw_only=True)
class ColumnRole:
    """What a column holds, as far as its name tells.

    Attributes
    ----------
    column : its name.
    signal : which.
    word : of the name that says so.
    origin : whether it is what was measured, a reference or a command, where the name says so.
    joint : number of the joint in the robot that the name holds; None where it holds none.
    number : last number in the name, which may count joints from 0 or from 1; None without one.
    stem : the rest of the name: columns of a table have it in common.
    scale : ours over theirs, from a unit in the name.
    """

    column: str
    signal: Signal
    word: str
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
    None where no word of it names a signal of a joint, or time.
    """
    if (own := _in_our_words(column, joints)) is not None:
        return own
    words, joint = _without_joint(_words(column), joints)
    if _OTHER & set(words):
        return None
    told = max((word for word in words if word in _SIGNAL_OF), key=_strength, default=None)
    named = None if told is None else (_SIGNAL_OF[told], told)
    by_unit = _by_unit(words)
    found = by_unit or named if told in (None, "a") else named  # A1 [deg]: an axis
    if found is None:
        return None
    signal, told = found
    rest = [word for word in words if word != told]
    letters = [word for word in words if not word.isdigit()]
    origins: list[Origin] = [_ORIGIN_OF[word] for word in rest if word in _ORIGIN_OF]
    origin: Origin = origins[0] if origins else "plain"
    if origin == "plain" and letters[-1] == "d" and len(letters) > 1:
        origin = "reference"  # tau_J_d, q_d: desired
    scales = [_SCALES[word] for word in words if word in _SCALES]
    known = {*_SCALES, *_UNITS, *_ORIGIN_OF, "d"}
    return ColumnRole(
        column=column,
        signal=signal,
        word=told,
        origin=origin,
        joint=joint,
        number=next((int(word) for word in reversed(rest) if word.isdigit()), None),
        stem=tuple(word for word in rest if word not in known and not word.isdigit()),
        scale=math.prod(
            (x for of, x in scales if of == signal or (of == "q" and signal in _ANGULAR)), start=1.0
        ),
    )


def _in_our_words(column: str, joints: Sequence[str]) -> ColumnRole | None:
    """The role of a column that has our own name, whatever the joint is called."""
    for signal in ("q", "v", "a", "tau", "temperature", "q_ref"):
        for number, joint in enumerate(joints):
            if column == f"{signal}.{joint}":
                return ColumnRole(
                    column=column,
                    signal="q" if signal == "q_ref" else signal,
                    word=signal,
                    origin="reference" if signal == "q_ref" else "plain",
                    joint=number,
                    number=None,
                    stem=(),
                )
    return None


def _strength(word: str) -> tuple[bool, bool, bool]:
    """How surely a word of a name says what the column holds: `tau_current`, `A1_torque`."""
    signal = _SIGNAL_OF[word]
    return len(word) > 1, signal != "t", signal in ("current", "temperature")


def _words(name: str) -> list[str]:
    """Words and numbers of a name; the 2 of rad/s^2 is none, and counts no joints."""
    return [word.lower() for word in _WORDS.findall(_SQUARED.sub(r"\1 s", name))]


def _by_unit(words: Sequence[str]) -> tuple[Signal, str] | None:
    """Return the signal that a unit among the words tells, and the unit: `axis1_deg`, `J1 [Nm]`."""
    for k, word in enumerate(words):
        if word in _LENGTHS and _OF_ANOTHER & set(words[max(0, k - 1) : k]):
            return None  # N mm, N/mm, kg mm
        if word in _ANGLES | _LENGTHS:
            if _NO_ANGLE & set(words[k + 1 : k + 2]):
                return None
            behind = [one for one in words[k + 1 : k + 4] if one in _SECONDS]
            return _ANGULAR[min(len(behind), 2)], word
        if word in _SIGNAL_OF_UNIT:
            if (_ANGLES | _SECONDS) & set(words[k + 1 : k + 2]):
                return None  # Nm/rad, Nm s: a stiffness, a damping
            return _SIGNAL_OF_UNIT[word], word
    return None


def _without_joint(words: list[str], joints: Sequence[str]) -> tuple[list[str], int | None]:
    """The words less those of the longest joint's name among them, and that joint.

    What all joints' names have in common need not be in the column's: the robot's, say.
    """
    whole = tuple(tuple(_words(joint)) for joint in joints)
    for names in (whole, _apart(whole)):
        found = _joint_in(words, names)
        if found is not None:
            start, length, number = found
            return words[:start] + words[start + length :], number
    return words, None


@lru_cache(maxsize=16)
def _apart(names: tuple[tuple[str, ...], ...]) -> tuple[tuple[str, ...], ...]:
    """Words of names without those that all of them begin and end with."""
    shortest = min(map(len, names), default=0)
    head = next((k for k in range(shortest) if len({one[k] for one in names}) > 1), shortest)
    names = tuple(one[head:] for one in names)
    shortest -= head
    tail = next((k for k in range(shortest) if len({one[-1 - k] for one in names}) > 1), shortest)
    return tuple(one[: len(one) - tail] for one in names)


def _joint_in(words: Sequence[str], names: Sequence[Sequence[str]]) -> tuple[int, int, int] | None:
    """Where the longest of joints' names is among words, how many words it has, and which it is."""
    found: tuple[int, int, int] | None = None
    for number, name in enumerate(names):
        own = [*name]
        # A joint called "q" or "1" is no name that a column can be told by.
        if not own or (len(own) == 1 and (own[0] in _SIGNAL_OF or own[0].isdigit())):
            continue
        for start in range(len(words) - len(own) + 1):
            longer = found is None or len(own) > found[1]
            if longer and [*words[start : start + len(own)]] == own:
                found = start, len(own), number
    return found
