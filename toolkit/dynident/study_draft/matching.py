"""Columns of a log matched to signals and joints, by their names."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from dynident.errors import RecordingError
from dynident.recording import Column
from dynident.recording.formats.column_expressions import quoted
from dynident.robot import Robot
from dynident.study_draft.column_roles import ColumnRole, Origin, Signal, role_of
from dynident.study_draft.guesses.stated_columns import terms_of
from dynident.study_draft.log import Log
from dynident.study_draft.timing import is_clock

_SIGNALS: tuple[Signal, ...] = ("q", "v", "tau", "temperature")
_INCREASING = 0.999  # share of the steps of a clock that go forward
_ALIKE: dict[str, tuple[Signal, ...]] = {"q": ("q",), "tau": ("tau", "current")}
"""Signals by which columns may be told as ours."""
_MEASURED: tuple[Origin, ...] = ("measured", "plain")
_ASKED: tuple[Origin, ...] = ("reference", "command")


@dataclass(frozen=True, kw_only=True)
class Group:
    """Columns of one signal, one for each joint.

    Attributes
    ----------
    roles : (n) of the joints in their order.
    reason : how columns were matched to joints, in words.
    """

    roles: tuple[ColumnRole, ...]
    reason: str

    @property
    def title(self) -> str:
        """The columns, the first and the last of them."""
        names = [role.column for role in self.roles]
        return names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]}"

    @property
    def is_current(self) -> bool:
        """Whether what stands for torques are currents or voltages of drives."""
        return self.roles[0].signal == "current"

    @property
    def origin(self) -> Origin:
        """Whether it was measured, a reference or a command."""
        return self.roles[0].origin


@dataclass(frozen=True, kw_only=True)
class Matched:
    """What the names of a log's columns tell.

    Attributes
    ----------
    time : the clock, and why; None where nothing is one.
    groups : signal ("q", "v", "tau", "q_ref", "temperature") -> groups, the likeliest first.
    """

    time: tuple[Column, str] | None
    groups: dict[str, tuple[Group, ...]] = field(default_factory=dict)

    def columns(self, robot: Robot, chosen: dict[str, int]) -> dict[str, Column]:
        """Our columns -> those of the log.

        Parameters
        ----------
        robot : for the joints' names.
        chosen : signal -> which of its groups; the first where it says nothing.
        """
        found = {"t": self.time[0]} if self.time else {}
        for signal, groups in self.groups.items():
            roles = groups[chosen.get(signal, 0)].roles
            for joint, role in zip(robot.names, roles, strict=True):
                found[f"{signal}.{joint}"] = Column(role.column, role.scale)
        return found


def match(
    log: Log,
    robot: Robot,
    needed: Sequence[str] = ("q", "tau"),
    told: Mapping[str, str] = MappingProxyType({}),
    gears: Sequence[float] | None = None,
) -> Matched:
    """Return the columns of a log by time, signals and joints.

    Parameters
    ----------
    log : of which only the clock's numbers are looked at, not those of other columns.
    robot : whose joints they are of.
    needed : signals without which there is no study.
    told : ours -> a column of the file, or an expression of one, for signals that no name tells.
    gears : ratios, where the file is of the motors' side.

    Raises
    ------
    RecordingError
        If no group of columns holds what is needed of every joint, or the likeliest one holds a
        column that cannot be read: a lesser one would be another signal.
    """
    named = (*log.columns, *log.unread)
    roles = [role for name in named if (role := role_of(name, robot.names)) is not None]
    torques = [
        *_groups(roles, "tau", _MEASURED, robot),
        *_groups(roles, "current", _MEASURED, robot),
        *_groups(roles, "tau", ("command", "reference"), robot),
        *_groups(roles, "current", ("command", "reference"), robot),
    ]
    positions = _groups(roles, "q", (*_MEASURED, *_ASKED), robot)
    # Motor and joint side, say: what has the same rest of its name belongs together.
    stems = {group.roles[0].stem for group in torques[:1]}
    measured = sorted(
        (one for one in positions if one.origin in _MEASURED),
        key=lambda one: one.roles[0].stem not in stems,
    )
    groups: dict[str, list[Group]] = {
        "q": measured or [one for one in positions if one.origin == "reference"],
        "v": _groups(roles, "v", _MEASURED, robot),
        "tau": torques,
        "temperature": _groups(roles, "temperature", _MEASURED, robot),
        "q_ref": [one for one in positions if one.origin in _ASKED and measured],
    }
    for signal in needed:
        if not all(f"{signal}.{joint}" in told for joint in robot.names):
            _require_read(groups[signal][:1], signal, roles, log)
    for signal, some in groups.items():
        groups[signal] = [one for one in some if not _unread(one.roles, log)]
    for signal in _SIGNALS:
        groups[signal] = groups[signal] or _stated(told, signal, robot, log.columns)
    for signal, what in (("q", "positions"), ("tau", "torques or currents")):
        if signal in needed and not groups[signal]:
            shown = ", ".join(list(log.columns)[:20]) + (", ..." if len(log.columns) > 20 else "")
            if log.skipped:
                shown += f"; of another length, or no numbers: {', '.join(log.skipped[:10])}"
                shown += ", ..." if len(log.skipped) > 10 else ""
            remedy = (
                f"it holds {shown}; joints: {', '.join(robot.names)}. Say which they are, "
                f'--column "{signal}.{robot.names[0]} = {_name(signal, gears)}" for each joint'
            )
            held = {role.joint for role in roles if role.signal in _ALIKE[signal]}
            lacking = [name for k, name in enumerate(robot.names) if k not in held]
            of = ", ".join(lacking) if 0 < len(lacking) < robot.n else f"{robot.n} joints"
            lack = f"no {what} of {of} are told by name"
            raise RecordingError(lack, log.where, remedy)
    found = {signal: tuple(some) for signal, some in groups.items() if some}
    readable = [role for role in roles if role.column in log.columns]
    return Matched(time=_clock(log, readable), groups=found)


def _name(signal: str, gears: Sequence[float] | None) -> str:
    """What to write of the first joint for a column, which may be of its motor."""
    if not gears:
        return "NAME"
    return f"{gears[0]:g}*NAME" if signal == "tau" else f"NAME/{gears[0]:g}"


def _unread(roles: Sequence[ColumnRole], log: Log) -> list[str]:
    """Those columns of some that could not be read."""
    return [role.column for role in roles if role.column in log.unread]


def _require_read(
    likeliest: Sequence[Group], signal: str, roles: Sequence[ColumnRole], log: Log
) -> None:
    """Refuse a log in which columns of the likeliest group cannot be read, or of none there is."""
    of_it = [one for group in likeliest for one in group.roles]
    alike = [one for one in roles if one.signal in _ALIKE[signal]]
    for column in _unread(of_it or alike, log):
        raise log.unread[column]


def require_clock(matched: Matched, log: Log, robot: Robot) -> tuple[Column, str]:
    """Take the clock of a log.

    Parameters
    ----------
    matched : what the names of its columns tell.
    log, robot : of which it was told.

    Returns
    -------
    The column, and why it is one.

    Raises
    ------
    RecordingError
        If no column is one: it says why a column that is called so could not be read.
    """
    if matched.time is not None:
        return matched.time
    for column, error in log.unread.items():
        role = role_of(column, robot.names)
        if role is not None and role.signal == "t" and role.joint is None:
            raise error
    what = "no column is a clock that goes forward"
    raise RecordingError(what, log.where, "name it t, or give the samples' rate: --rate 125")


def _stated(
    told: Mapping[str, str], signal: Signal, robot: Robot, names: Collection[str]
) -> list[Group]:
    """The group of columns that were stated of every joint: of a sum one that no other has."""
    stated = [f"{signal}.{joint}" for joint in robot.names]
    if not all(ours in told for ours in stated):
        return []
    terms = {k: terms_of(ours, told[ours], robot, names) for k, ours in enumerate(stated)}
    taken: dict[int, str] = {}
    for k in sorted(terms, key=lambda k: len(terms[k])):
        free = [name for name in terms[k] if name not in taken.values()]
        if not free:
            return []
        taken[k] = free[0]
    roles = tuple(
        ColumnRole(
            column=taken[k],
            signal=signal,
            word=signal,
            origin="plain",
            joint=k,
            number=None,
            stem=(),
        )
        for k in range(robot.n)
    )
    return [Group(roles=roles, reason="so it was said")]


def _groups(
    roles: Sequence[ColumnRole], signal: Signal, origins: Sequence[Origin], robot: Robot
) -> list[Group]:
    """Groups of columns that hold a signal of every joint, the likeliest first.

    Where none has one word for it, some joints may turn and others slide: angle and position,
    torque and force.
    """
    own = [role for role in roles if role.signal == signal and role.origin in origins]
    for key in (lambda one: (one.origin, one.stem, one.word), lambda one: (one.origin, one.stem)):
        sets: dict[tuple, list[ColumnRole]] = {}
        for role in own:
            sets.setdefault(key(role), []).append(role)
        found = [
            (origins.index(origin), len(stem), group)
            for (origin, stem, *_), some in sets.items()
            if (group := _at_joints(some, robot)) is not None
        ]
        if found:
            return [group for _, _, group in sorted(found, key=lambda one: one[:2])]
    return []


def _at_joints(roles: list[ColumnRole], robot: Robot) -> Group | None:
    """The roles in the order of the joints, if there is one for each."""
    n = robot.n
    with_names = [role for role in roles if role.joint is not None]
    named = {role.joint: role for role in with_names}
    if set(named) == set(range(n)) and len(with_names) == n:
        ordered = tuple(named[j] for j in range(n))
        return Group(roles=ordered, reason="by the joints' names")
    if named:
        return None
    numbered = sorted((r for r in roles if r.number is not None), key=_number)
    if len({role.number for role in numbered}) < len(numbered):
        return None
    if len(numbered) == n:
        return Group(roles=tuple(numbered), reason="by their numbers, in the joints' order")
    if len(numbered) > n:
        reason = f"the first {n} of {len(numbered)} by their numbers, in the joints' order"
        return Group(roles=tuple(numbered[:n]), reason=reason)
    if n == 1 and len(roles) == 1:
        return Group(roles=tuple(roles), reason="the only one")
    return None


def _number(role: ColumnRole) -> int:
    return -1 if role.number is None else role.number


def _clock(log: Log, roles: Sequence[ColumnRole]) -> tuple[Column, str] | None:
    """The column, or pair of seconds and nanoseconds, that goes forward."""
    candidates = [role for role in roles if role.signal == "t" and role.joint is None]
    whole = {role.stem: role for role in candidates if role.scale == 1.0}
    for role in candidates:
        other = whole.get(role.stem)
        if role.scale != 1e-9 or other is None:
            continue
        if _goes_forward(log.columns[other.column] + 1e-9 * log.columns[role.column]):
            pair = f"{quoted(other.column)} + 1e-9*{quoted(role.column)}"
            return Column(pair), "seconds and nanoseconds"
    for role in sorted(candidates, key=lambda one: len(one.stem)):
        if _goes_forward(log.columns[role.column]):
            return Column(role.column, role.scale), "it goes forward"
    named = {role.column for role in roles}
    for name, x in log.columns.items():
        # What goes up by one may be the number of the sample: no clock, unless it is called so.
        if name not in named and is_clock(x) and not np.all(np.diff(x) == 1.0):
            return Column(name), "it goes forward step by step, and nothing else is called a clock"
    return None


def _goes_forward(x: np.ndarray) -> bool:
    return bool(np.isfinite(x).all() and np.mean(np.diff(x) > 0) >= _INCREASING)
