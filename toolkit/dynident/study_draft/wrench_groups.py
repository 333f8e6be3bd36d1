"""Columns of a wrench sensor in a log: six that belong together, and the link that it is at."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynident.recording import COMPONENTS, Column, frame_of
from dynident.robot import Robot
from dynident.study_draft.log import Log

_KINDS = {
    **dict.fromkeys(("f", "force", "forces", "kraft"), "f"),
    **dict.fromkeys(("t", "m", "torque", "torques", "moment", "moments"), "t"),
}
_SENSOR = frozenset(("wrench", "ft", "fts", "ati", "sensor", "loadcell"))
_WISHES = "ref reference des desired target goal cmd command limit max min"
_ESTIMATES = "joint tcp cartesian ext external estimated est filtered bias base"
_OTHER = frozenset((*_WISHES.split(), *_ESTIMATES.split()))
"""Words of what is no reading of a sensor: a wish, or what a controller works out of currents."""
_MOUNTS = ("ft", "fts", "sensor", "wrench", "tool", "tool0", "flange", "wrist", "ee", "tcp")
_FARTHEST = 4 * np.pi
"""rad from zero beyond which a position is rather in degrees."""
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")


@dataclass(frozen=True, kw_only=True)
class WrenchGroup:
    """Six columns of a sensor.

    Attributes
    ----------
    columns : names in the log, in the order of `COMPONENTS`.
    frames : links that the sensor may be at, the likeliest first.
    reason : why the first.
    """

    columns: tuple[str, ...]
    frames: tuple[str, ...]
    reason: str

    def mapping(self, frame: str) -> dict[str, Column]:
        """Our columns -> those of the log, for a sensor at a link."""
        pairs = zip(COMPONENTS, self.columns, strict=True)
        return {f"wrench.{frame}.{component}": Column(name) for component, name in pairs}


def wrench_groups(names: Sequence[str], robot: Robot) -> tuple[WrenchGroup, ...]:
    """Return the wrench sensors whose columns are among names, by what these say.

    Parameters
    ----------
    names : of the columns of a log.
    robot : for its links.
    """
    sets: dict[tuple[str, ...], dict[str, str]] = {}
    frames: dict[tuple[str, ...], str] = {}
    for name in names:
        told = _component(name)
        if told is None:
            continue
        component, stem = told
        sets.setdefault(stem, {}).setdefault(component, name)
        if frame := frame_of(name):
            frames[stem] = frame
    return tuple(
        _group(tuple(found[one] for one in COMPONENTS), frames.get(stem, ""), stem, robot)
        for stem, found in sets.items()
        if set(found) == set(COMPONENTS)
    )


def _component(name: str) -> tuple[str, tuple[str, ...]] | None:
    """Which component a column is called, and the rest of its name; None for other columns."""
    words = [word.lower() for word in _WORDS.findall(name)]
    if not words or _OTHER & set(words):
        return None
    if frame := frame_of(name):
        return words[-1], ("wrench", frame)
    found = [(k, word) for k, word in enumerate(words) if word in COMPONENTS or word in _MOMENTS]
    if len(found) == 1:
        place, word = found[0]
        return _MOMENTS.get(word, word), tuple(words[:place] + words[place + 1 :])
    axes = [k for k, word in enumerate(words) if word in "xyz" and len(word) == 1]
    kinds = [k for k, word in enumerate(words) if word in _KINDS]
    if len(axes) == 1 and kinds:
        rest = tuple(word for k, word in enumerate(words) if k not in (axes[0], kinds[-1]))
        return _KINDS[words[kinds[-1]]] + words[axes[0]], rest
    if _SENSOR & set(words) and words[-1].isdigit():
        return _numbered(int(words[-1]), tuple(words[:-1]))
    return None


_MOMENTS = {"mx": "tx", "my": "ty", "mz": "tz"}


def _numbered(number: int, rest: tuple[str, ...]) -> tuple[str, tuple[str, ...]] | None:
    """A table's column by its number from 0."""
    return (COMPONENTS[number], rest) if number < len(COMPONENTS) else None


def _group(
    columns: tuple[str, ...], frame: str, stem: tuple[str, ...], robot: Robot
) -> WrenchGroup:
    """The group with the links that the sensor may be at: those that the last joint moves."""
    carried = {joint.parent for joint in robot.joints}
    links = [link for link in robot.links if link.joint >= 0 and link.joint not in carried]
    names = [link.name for link in links]
    if frame in names:
        return WrenchGroup(columns=columns, frames=(frame,), reason="its columns name the link")

    def likely(name: str) -> tuple[bool, int]:
        words = [word.lower() for word in _WORDS.findall(name)]
        marks = [_MOUNTS.index(word) for word in (*words, name.lower()) if word in _MOUNTS]
        return bool(set(words) & set(stem)), -min(marks, default=len(_MOUNTS))

    ranked = sorted(names, key=likely, reverse=True)
    reason = "the last joint moves these links, and the columns do not say in whose frame they are"
    return WrenchGroup(columns=columns, frames=tuple(ranked), reason=reason)


def wrench_columns(
    groups: Sequence[WrenchGroup], take: Callable[[str, list[str], str], int]
) -> dict[str, Column]:
    """Return the mapping of columns of the first sensor, at the link that is chosen.

    Parameters
    ----------
    groups : of a log; none, and there are no columns.
    take : takes a decision: (subject, choices, reason) -> which of them.
    """
    if not groups:
        return {}
    one = groups[0]
    choices = [
        f"{one.columns[0]} ... {one.columns[-1]} at the link {frame}" for frame in one.frames
    ]
    return one.mapping(one.frames[take("wrench", choices, one.reason)])


def in_radians(
    columns: Mapping[str, Column],
    logs: Sequence[Log],
    robot: Robot,
    take: Callable[[str, list[str], str], int],
) -> dict[str, Column]:
    """Return the mapping with positions in rad, where they turn further than a robot can.

    Parameters
    ----------
    columns : ours -> those of the logs.
    logs : that hold them.
    robot : whose revolute joints are looked at.
    take : takes a decision.
    """
    turning = [f"q.{joint.name}" for joint in robot.joints if joint.kind == "revolute"]
    reach = [np.abs(log.columns[columns[q].name]).max() for log in logs for q in turning]
    if max(reach) <= _FARTHEST or any(columns[q].scale != 1.0 for q in turning):
        return dict(columns)
    reason = f"positions reach {max(reach):.4g}, too much for radians"
    if take("q", ["positions in degrees", "positions in rad"], reason) == 1:
        return dict(columns)
    return {
        ours: Column(one.name, np.pi / 180) if ours in turning else one
        for ours, one in columns.items()
    }
