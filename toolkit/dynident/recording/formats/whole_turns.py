"""Whole turns of a joint: positions that jump by one are read as going on.

A whole turn more changes no torque of a joint that turns. Many loggers keep its position within
one turn, as in [-pi, pi), so that it jumps by 2 pi where it crosses the end: no speed leaves that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import warn
from dynident.recording.recording import Recording
from dynident.recording.repetition import TURN
from dynident.recording.spooled import Spool

UNWRAPPED = "jumps by whole turns between samples, and is read as going on (no torque changes)"
"""What is said of a position that `unwrapped` has changed."""
TURNING = ("revolute", "continuous")
"""Kinds of joints whose positions are angles."""
_TURNS = (360.0, TURN)
"""A whole turn in degrees, where these are still to be found out, and in rad."""
_MOST = 16
"""Whole turns after which encoders of many turns begin anew, at most."""
_FASTEST = 0.25
"""Turns from one sample to the next, beyond which a jump and a fast motion look alike."""
_NEAR = 0.02
"""Turns by which a jump may miss a whole number of them, the motion about it taken off."""
_UNEVEN = 0.1
"""The same where the motion about it is uneven, at most."""
_MOST_OF_THEM = 0.9
"""Share of the jumps of a position that must be whole turns."""
_OFF = 2
"""Whole turns by which a joint with limits may seem to be beyond them; more is another unit."""
_LOOKED_AT = 200
"""Jumps that are looked at first: in another unit, most steps may be as large as one."""
_BESIDE = 3
"""Steps on either side of a jump that tell how fast the joint is there."""
_PARTS = 3
"""Part of a turn from which a step is a jump: a sample between both ends makes two of a half."""
_CHATTER = 1.5
"""Turns within which a joint stays that rests where its angle jumps to and fro."""
_LATE = 1.5
"""Of the time steps about it, beyond which a step is a gap."""
_AT_ONCE = 1 << 18
"""Samples that are looked at."""


def unwrapped(recording: Recording, kinds: Sequence[str]) -> Recording:
    """Return the recording with positions that go on where they jumped by whole turns.

    Parameters
    ----------
    recording : as it was read.
    kinds : "revolute", "continuous" or "prismatic" for each joint; the last are left alone.

    Returns
    -------
    The recording itself where nothing jumps; otherwise its provenance names the joints, and its
    references follow the positions.
    """
    found: dict[str, dict[int, _Added]] = {"q": {}, "q_ref": {}}
    for joint, kind in enumerate(kinds):
        for signal, added in found.items():
            x = getattr(recording, signal)
            if kind in TURNING and x is not None:
                one = _jumps(recording.t, x[:, joint])
                if one is not None:
                    added[joint] = one
    joints = sorted({*found["q"], *found["q_ref"]})
    if not joints:
        return recording
    for joint, one in found["q"].items():
        _warn_of_others(recording, joint, one)
    source = replace(
        recording.provenance, unwrapped=tuple(recording.joints[joint] for joint in found["q"])
    )
    changed = recording.replace(
        **{signal: _sum(recording, signal, added) for signal, added in found.items() if added},
        provenance=source,
    )
    if changed.q_ref is None:
        return changed
    behind = {}
    for joint in joints:
        turn = next(added[joint].turn for added in found.values() if joint in added)
        apart = float(np.median(changed.q[:, joint] - changed.q_ref[:, joint]))
        behind[joint] = _Added.everywhere(round(apart / turn), turn)
    return changed.replace(q_ref=_sum(changed, "q_ref", behind))


def _warn_of_others(recording: Recording, joint: int, added: _Added) -> None:
    """Say of jumps that are no whole turns, and stay: samples between two ends, as a rule."""
    others = added.rows[added.turns == 0]
    if len(others):
        what = (
            f"{recording.where}: q.{recording.joints[joint]} jumps {len(others)} times by what is "
            f"no whole turn, first at t = {recording.t[others[0]]:.6g} s, and that is left as it is"
        )
        warn(what)


def within_limits(
    recordings: Sequence[Recording], limits: Mapping[str, tuple[float, float]]
) -> list[Recording]:
    """Return recordings of one robot, in which what was kept within a turn lies within limits.

    A position that goes on from where a recording starts may be whole turns off another one's.

    Parameters
    ----------
    recordings : after `unwrapped`.
    limits : lower and upper one of each joint, rad; infinite where there are none.
    """
    jumped = {name for one in recordings for name in one.provenance.unwrapped}
    jumped = {name for name in jumped if _may_be_rad(name, recordings, *limits[name])}
    known: dict[int, Recording] = {}
    found = []
    for one in recordings:
        turns = {}
        for name in jumped:
            count = _turns_off(one.q[:, one.joints.index(name)], *limits[name])
            if count:
                turns[one.joints.index(name)] = _Added.everywhere(count, TURN)
        if turns and id(one.q) not in known:  # windows of one file go on sharing their samples
            signals = [x for x in ("q", "q_ref") if getattr(one, x) is not None]
            known[id(one.q)] = one.replace(**{x: _sum(one, x, turns) for x in signals})
        moved = known.get(id(one.q))
        found.append(one if moved is None else one.replace(q=moved.q, q_ref=moved.q_ref))
    return found


def _may_be_rad(name: str, recordings: Sequence[Recording], lower: float, upper: float) -> bool:
    """Whether no recording of a joint travels farther than its limits and a turn leave."""
    return all(
        np.ptp(one.q[:, one.joints.index(name)]) <= upper - lower + TURN for one in recordings
    )


def _turns_off(q: np.ndarray, lower: float, upper: float) -> int:
    """Whole turns that bring a position (T,) nearer to its limits; 0 where it is within them."""
    low, high = float(q.min()), float(q.max())

    def beyond(turns: int) -> float:
        moved = turns * TURN
        return max(lower - low - moved, 0.0) + max(high + moved - upper, 0.0)

    if not np.isfinite(upper - lower) or not beyond(0):
        return 0
    count = round(((lower + upper) - (low + high)) / (2 * TURN))
    return count if abs(count) <= _OFF and beyond(count) < beyond(0) else 0


@dataclass(frozen=True, eq=False)
class _Added:
    """Whole turns that are added to a position from some rows on.

    Attributes
    ----------
    rows : (k,) first rows, ascending.
    turns : (k,) added from there on to what was added before.
    turn : one whole turn, in the unit of the position.
    """

    rows: np.ndarray
    turns: np.ndarray
    turn: float

    @classmethod
    def everywhere(cls, turns: int, turn: float) -> _Added:
        """As many in all rows."""
        return cls(np.zeros(1, dtype=int), np.array([turns]), turn)

    def of(self, rows: np.ndarray) -> np.ndarray:
        """What is added in some rows, in the unit of the position."""
        total = np.concatenate([[0], np.cumsum(self.turns)])
        return self.turn * total[np.searchsorted(self.rows, rows, side="right")]


def _jumps(t: np.ndarray, x: np.ndarray) -> _Added | None:
    """What makes a position (T,) at times t go on where it jumps; None if nowhere."""
    parts = range(0, len(x) - 1, _AT_ONCE)
    steps = (np.abs(np.diff(x[start : start + _AT_ONCE + 1])) for start in parts)
    large = [
        start + np.flatnonzero(one > min(_TURNS) / _PARTS)
        for start, one in zip(parts, steps, strict=True)
    ]
    every = np.concatenate(large)
    size = np.abs(x[every + 1] - x[every])
    for turn in _TURNS:
        rows = every[size > turn / _PARTS]
        few = _turns_at(t, x, rows, rows[:: len(rows) // _LOOKED_AT + 1], turn)
        if not len(rows) or np.mean(few != 0) < _MOST_OF_THEM:
            continue
        turns = _turns_at(t, x, rows, rows, turn)
        if np.mean(turns != 0) >= _MOST_OF_THEM:
            return _Added(rows + 1, -turns, turn)
    return None


def _turns_at(
    t: np.ndarray, x: np.ndarray, jumps: np.ndarray, some: np.ndarray, turn: float
) -> np.ndarray:
    """How many whole turns a position (T,) jumps by after some of the rows at which it jumps."""
    return np.array([_whole_turns(t, x, int(row), jumps, turn) for row in some], dtype=int)


def _whole_turns(t: np.ndarray, x: np.ndarray, row: int, jumps: np.ndarray, turn: float) -> int:
    """How many whole turns a position jumps by after a row; 0 where that is none."""
    first, last = max(0, row - _BESIDE), min(len(x) - 2, row + _BESIDE)
    near = jumps[np.searchsorted(jumps, first) : np.searchsorted(jumps, last, side="right")]
    beside = np.setdiff1d(np.arange(first, last + 1), near)
    if not len(beside) and abs(x[last + 1] - x[first]) > _CHATTER * turn:
        return 0  # it turns as fast: one that rests at the end of its turn jumps to and fro
    step = float(t[row + 1] - t[row])
    if step > _LATE * float(np.median(np.diff(t[first : last + 2]))):
        return 0  # nobody knows what it did meanwhile
    steps = (x[beside + 1] - x[beside]) / (t[beside + 1] - t[beside]) * step
    steps = steps if len(steps) else np.zeros(1)
    usual = float(np.median(steps))
    if abs(usual) > _FASTEST * turn:
        return 0
    jump = float(x[row + 1] - x[row]) - usual
    count = round(jump / turn)
    room = min(_NEAR * turn + float(np.ptp(steps)), _UNEVEN * turn)
    return count if abs(count) <= _MOST and abs(jump - count * turn) <= room else 0


def _sum(recording: Recording, signal: str, added: Mapping[int, _Added]) -> np.ndarray:
    """A signal and the whole turns of some joints, (T, n), part by part."""
    x = getattr(recording, signal)
    with Spool(recording.where) as spool:
        for start in range(0, len(x), _AT_ONCE):
            part = np.array(x[start : start + _AT_ONCE])
            rows = np.arange(start, start + len(part))
            for joint, one in added.items():
                part[:, joint] += one.of(rows)
            spool.add({signal: part})
        return spool.arrays()[signal]


def unwrapped_notes(recordings: Iterable[tuple[str, Sequence[str]]]) -> tuple[str, ...]:
    """Say of which recordings positions jumped by whole turns, a sentence for each joint.

    Parameters
    ----------
    recordings : name, and the joints that `Provenance.unwrapped` names.
    """
    names: dict[str, dict[str, None]] = {}
    for name, joints in recordings:
        for joint in joints:
            names.setdefault(joint, {})[name] = None
    return tuple(f"q.{joint} {UNWRAPPED}: {', '.join(some)}." for joint, some in names.items())
