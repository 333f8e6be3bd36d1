"""Messages `sensor_msgs/JointState` of one topic as a table: a row a message, a column a signal.

A message names its joints, and the next one may name others: so do two drivers on one topic. Rows
of a table are the messages that hold the joints that are asked for; all others are counted.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dynident.errors import RecordingError, warn
from dynident.recording.formats.column_table import ColumnTable
from dynident.recording.formats.limits import ARRAYS, require_few, require_unpacked

FIELDS = {"q": "position", "v": "velocity", "tau": "effort"}
"""Our signal -> the field of the message."""
_NANO = 1e-9


@dataclass(frozen=True)
class _Alike:
    """Messages with the same joints and fields: `values` has a row of them for each, end to end."""

    joints: tuple[str, ...]
    signals: tuple[str, ...]
    numbers: array[int] = field(default_factory=lambda: array("q"))
    stamps: array[int] = field(default_factory=lambda: array("q"))
    received: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))

    def wide(self) -> np.ndarray:
        """All values, (k, signals, joints)."""
        shape = (len(self.numbers), len(self.signals), len(self.joints))
        return np.frombuffer(self.values).reshape(shape)

    def column(self, signal: str, joint: str) -> np.ndarray:
        """One signal of one joint, (k,)."""
        return self.wide()[:, self.signals.index(signal), self.joints.index(joint)]


class JointStates:
    """Messages of one topic, gathered one by one.

    Parameters
    ----------
    where : file and topic, for messages.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self._alike: dict[tuple[tuple[str, ...], tuple[str, ...]], _Alike] = {}
        self._joints: dict[str, None] = {}
        self._count = self._size = self._nameless = 0

    def add(self, message: Any, received: int) -> None:
        """Take one more message.

        Parameters
        ----------
        message : with header, name, position, velocity and effort.
        received : when it was received, ns.

        Raises
        ------
        RecordingError
            If it does not have one position (velocity, effort), or none at all, for each joint;
            names a joint twice; or there are too many joints or numbers.
        """
        self._count += 1
        joints = tuple(message.name)
        found = {signal: getattr(message, name) for signal, name in FIELDS.items()}
        for signal, x in found.items():
            if len(x) not in (0, len(joints)):
                what = f"{len(joints)} joints are named, and {FIELDS[signal]} has {len(x)} values"
                raise RecordingError(what, f"{self.where}, message {self._count}")
        if not joints:
            self._nameless += 1
            return
        signals = tuple(signal for signal, x in found.items() if len(x))
        alike = self._alike.get((joints, signals))
        if alike is None:
            alike = self._new(joints, signals)
        alike.numbers.append(self._count)
        stamp = message.header.stamp
        alike.stamps.append(1_000_000_000 * int(stamp.sec) + int(stamp.nanosec))
        alike.received.append(int(received))
        for signal in signals:
            alike.values.frombytes(np.ascontiguousarray(found[signal], np.float64).tobytes())
        self._size += 8 * (3 + len(joints) * len(signals))
        require_unpacked(self._size, ARRAYS, self.where)

    def _new(self, joints: tuple[str, ...], signals: tuple[str, ...]) -> _Alike:
        """The place of messages that are not like any before."""
        if len(set(joints)) < len(joints):
            twice = next(one for one in joints if joints.count(one) > 1)
            where = f"{self.where}, message {self._count}"
            raise RecordingError(f"the joint '{twice}' is named twice", where)
        self._joints |= dict.fromkeys(joints)
        require_few(1 + len(FIELDS) * len(self._joints), "signals of joints", self.where)
        require_few(len(self._alike), "different sets of joints", self.where)
        self._alike[joints, signals] = _Alike(joints, signals)
        return self._alike[joints, signals]

    def table(self) -> ColumnTable:
        """Return the table: `t` in s since the first message, then the signals of each joint.

        Times are those of the headers; where those are all zero, when messages were received.

        Raises
        ------
        RecordingError
            If there is no message with a joint in it, or only some have a stamp.

        Warns
        -----
        DynidentWarning
            If no message has a stamp.
        """
        if not self._alike:
            what = f"holds {self._count} messages, and none that names a joint"
            raise RecordingError(what, self.where, "record another topic")
        stamped = self._is_stamped()
        clock = {key: one.stamps if stamped else one.received for key, one in self._alike.items()}
        first = min((one.numbers[0], clock[key][0]) for key, one in self._alike.items())[1]
        names = ["t", *self._names()]

        def load(wanted: Sequence[str]) -> dict[str, np.ndarray]:
            keys = self._with(wanted)
            numbers = np.concatenate([self._alike[key].numbers for key in keys])
            order = np.argsort(numbers, kind="stable")
            found = {}
            for name in wanted:
                if name == "t":
                    stamps = np.concatenate([clock[key] for key in keys])
                    found[name] = (stamps[order] - first) * _NANO
                else:
                    signal, _, joint = name.partition(".")
                    parts = [self._alike[key].column(signal, joint) for key in keys]
                    found[name] = np.concatenate(parts)[order]
            return found

        def skipped(wanted: Sequence[str]) -> tuple[str, ...]:
            said = [] if stamped else ["no message has a stamp: times are those of receiving it"]
            others = self._count - sum(len(self._alike[key].numbers) for key in self._with(wanted))
            said += [f"{others} of {self._count} messages: of other joints"] if others else []
            return tuple(said)

        return ColumnTable(self.where, tuple(names), load, skipped=skipped, joints="prefixed")

    def _names(self) -> list[str]:
        """Signals of joints that hold a number in any message, in the order of the joints."""
        held: set[str] = set()
        for one in self._alike.values():
            for i, k in np.argwhere(~np.isnan(one.wide()).all(axis=0)):
                held.add(f"{one.signals[i]}.{one.joints[k]}")
        names = (f"{signal}.{joint}" for signal in FIELDS for joint in self._joints)
        return [name for name in names if name in held]

    def _is_stamped(self) -> bool:
        """Whether the headers say when; refuses that some do and some do not."""
        missing = [
            number
            for one in self._alike.values()
            for number, stamp in zip(one.numbers, one.stamps, strict=True)
            if stamp == 0
        ]
        if not missing:
            return True
        if len(missing) < self._count - self._nameless:
            what = f"has no time stamp ({len(missing)} such messages)"
            where = f"{self.where}, message {min(missing)}"
            raise RecordingError(what, where, "stamp every message, or none")
        what = "no message has a time stamp: when it was received stands in its place"
        warn(f"{self.where}: {what}")
        return False

    def _with(self, wanted: Sequence[str]) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
        """Which messages hold the joints of columns; refuses that one holds only some of them."""
        pairs = [name.partition(".")[::2] for name in wanted if name != "t"]
        joints = {joint for _, joint in pairs}
        keys = [key for key in self._alike if not joints or not joints.isdisjoint(key[0])]
        faults = []
        for key in keys:
            for signal, joint in pairs:
                if joint not in key[0] or signal not in key[1]:
                    lacks = f"joint '{joint}'" if joint not in key[0] else FIELDS[signal]
                    faults.append((self._alike[key].numbers[0], lacks))
                    break
        if faults:
            number, lacks = min(faults)
            what = f"holds other joints that are asked for, and no {lacks}"
            if lacks in FIELDS.values():
                what = f"holds no {lacks}, and others do"
            remedy = "ask for joints that are always reported together, or cut the recording"
            raise RecordingError(what, f"{self.where}, message {number}", remedy)
        return keys


def prefixed(names: Sequence[str], joints: Sequence[str], where: str) -> dict[str, str]:
    """Find joints that are named with a prefix here, or without the one that the robot's have.

    Parameters
    ----------
    names : of joints, as messages have them.
    joints : of the robot.
    where : for messages.

    Returns
    -------
    The robot's name of a joint -> the messages' name, one prefix for all; empty where all names
    agree, or where no prefix makes them agree.

    Raises
    ------
    RecordingError
        If there are several such prefixes, as on a robot with two arms.
    """
    there = set(names)
    if not joints or there.issuperset(joints):
        return {}
    more = {name[: -len(joints[0])] for name in there if name.endswith(joints[0])}
    less = {joints[0][:k] for k in range(1, len(joints[0]))}
    found: dict[str, dict[str, str]] = {}
    for prefix in sorted(more | less):
        if not prefix or prefix[-1].isalnum():
            continue
        if prefix in more and there.issuperset(prefix + joint for joint in joints):
            found[prefix] = {joint: prefix + joint for joint in joints}
        bare = {joint: joint.removeprefix(prefix) for joint in joints}
        if (
            prefix in less
            and there.issuperset(bare.values())
            and len(set(bare.values())) == len(joints)
        ):
            found[prefix] = bare
    if len(found) > 1:
        what = f"joints come with several prefixes: {', '.join(found)}"
        remedy = 'say whose are meant in [columns], as "q.joint1" = "q.left_joint1"'
        raise RecordingError(what, where, remedy)
    return next(iter(found.values()), {})
