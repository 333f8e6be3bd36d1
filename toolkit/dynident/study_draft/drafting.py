"""`draft_study`: from a robot description and files of measurements to a study with reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Literal

import numpy as np

from dynident.arguments import checked
from dynident.data_files import find_all
from dynident.errors import RecordingError, without_warnings
from dynident.model import Model
from dynident.recording import (
    Column,
    FileLayout,
    Filter,
    Recording,
    WrenchColumns,
    frames_in,
    read,
    read_wrench,
    suited_filter,
    uniform,
    within_limits,
)
from dynident.robot import Robot
from dynident.study_draft.by_numbers import named_by_numbers
from dynident.study_draft.decision import Ask, Decision, decided
from dynident.study_draft.draft import DraftedRecording, StudyDraft
from dynident.study_draft.entries import drafted_recordings
from dynident.study_draft.guesses.amendments import amended
from dynident.study_draft.guesses.coupled_motors import couplings_of
from dynident.study_draft.guesses.degrees import positions_in_radians
from dynident.study_draft.guesses.drive_unit import drive_sizes
from dynident.study_draft.guesses.file_reading import Reading
from dynident.study_draft.guesses.filter_cutoffs import suitable_filter
from dynident.study_draft.guesses.motor_side import joint_side, require_ratios
from dynident.study_draft.guesses.stated_columns import require_no_sums, with_stated
from dynident.study_draft.guesses.torque_timing import samples_late
from dynident.study_draft.log import Log, logs_of, same_columns
from dynident.study_draft.log_facts import LogFacts
from dynident.study_draft.matching import Group, Matched, match, require_clock
from dynident.study_draft.shared_motors import with_shared_motors
from dynident.study_draft.timing import clock_from_speeds, clock_scale
from dynident.study_draft.wrench_groups import in_radians, wrench_columns, wrench_groups
from dynident.threads import single_threaded

_NOTHING = LogFacts()
_FRICTION = ("viscous_friction", "coulomb_friction", "torque_offset")
_ANYTHING = ("effort", "efforts")
"""What drivers of ROS report under these names is often a current."""
_FOLLOWS = 0.7
"""Correlation of a position with the reference that it follows, be it late."""


@checked
@single_threaded
def draft_study(
    robot: str | Path,
    data: Sequence[str | Path],
    *,
    facts: LogFacts = _NOTHING,
    ask: Ask | None = None,
) -> StudyDraft:
    """Draft a study of recordings that nobody has described yet.

    Columns are matched to joints by their names; units, gears, signs and order are compared with
    the torques and limits of the robot as it is described; the clock, idle ends and repetitions are
    found in the data. Nothing is written.

    Parameters
    ----------
    robot : description (URDF, SDF or MJCF).
    data : files of measurements with the same columns, or patterns of their names, in the order of
        the study.
    facts : what somebody knows: joints, gears, columns, rate, topic of bags, loads in files.
    ask : called with each decision that the files leave open; by default the likeliest is taken.

    Returns
    -------
    The draft, whose `text` is the study and whose `decisions` say what was decided and why.

    Raises
    ------
    FileError
        If a file is not there or cannot be read.
    RobotError
        If the description is none.
    RecordingError
        If a file holds no positions and time of every joint, neither torques nor a wrench sensor,
        or files differ in their columns.
    """
    described = Robot.from_file(robot, facts.joints)
    notes = _Notes(ask)
    logs = _named(data, described, facts, notes)
    sensors = wrench_groups(list(logs[0].columns), described)
    needed = ("q",) if sensors else ("q", "tau")
    matched = match(logs[0], described, needed, facts.columns, facts.gears)
    chosen = _chosen(matched, notes)
    wrench = wrench_columns(sensors, notes.take)
    columns = matched.columns(described, chosen)
    columns = _with_clock(columns, logs[0], matched, described, notes)
    files = _Sources(robot, facts, logs)
    if "tau" not in matched.groups:
        _require_no_motors(facts, logs[0].where)
        return _of_sensor(files, described, columns | wrench, notes)
    reading = _of_joints(columns, described, facts, logs, notes)
    torque = matched.groups["tau"][chosen["tau"]]
    reading = _with_units(reading, torque, facts, logs, notes)
    unit = reading.torque_unit
    reading = replace(reading, columns=_without_strangers(reading, logs, notes))
    reading = amended(reading, lambda one: _read(logs, one), notes.take)
    reading, otherwise = with_shared_motors(reading, _read(logs, reading), notes.take)
    recordings = _without_gaps(_read(logs, reading))
    held = _is_held(reading, recordings, torque.origin == "command", notes)
    behind_gears = reading.geared or reading.motors is not None or unit == "A"
    effects = (*_FRICTION, "rotor_inertia") if behind_gears else _FRICTION
    entries = drafted_recordings(logs, recordings, facts, notes.take)
    return StudyDraft(
        robot=files.robot,
        joints=files.joints,
        columns=reading.columns | wrench,
        otherwise=otherwise,
        recordings=entries,
        filter=_filter_of(reading, effects, entries, recordings, notes),
        loads=files.loads,
        torque="held_command" if held else "measured",
        torque_unit=unit,
        effects=effects,
        rate_hz=min(one.rate_hz for one in recordings),
        usual=suited_filter(recordings),
        gravity=tuple(float(x) for x in reading.robot.gravity),
        is_mounted_otherwise=not np.array_equal(reading.robot.gravity, described.gravity),
        has_torques=True,
        has_reference=recordings[0].q_ref is not None,
        decisions=tuple(notes.decisions),
    )


@dataclass(frozen=True)
class _Sources:
    """What was named by whoever asks for a draft."""

    path: str | Path
    facts: LogFacts
    logs: tuple[Log, ...]

    @property
    def robot(self) -> Path:
        return Path(self.path)

    @property
    def joints(self) -> tuple[str, ...] | None:
        return None if self.facts.joints is None else tuple(self.facts.joints)

    @property
    def loads(self) -> dict[str, float | None]:
        loads = self.facts.carried([(log.file, log.record) for log in self.logs])
        return {name: one.mass for name, one in loads.items()}


def _of_sensor(
    files: _Sources, robot: Robot, columns: dict[str, Column], notes: _Notes
) -> StudyDraft:
    """Draft a study of a wrench sensor alone, where nothing is known of the drives."""
    (frame,) = frames_in(list(columns))
    columns = in_radians(columns, files.logs, robot, notes.take)
    wanted = WrenchColumns(frame=frame, joints=robot.names, columns=columns)
    recordings = [
        read_wrench(log.file, wanted, log.record or None, layout=log.layout).select(robot.names)
        for log in files.logs
    ]
    return StudyDraft(
        robot=files.robot,
        joints=files.joints,
        columns={ours: one for ours, one in columns.items() if not ours.startswith("v.")},
        otherwise=None,
        recordings=drafted_recordings(files.logs, recordings, files.facts, notes.take),
        filter=None,
        loads=files.loads,
        torque="measured",
        torque_unit="N m",
        effects=(),
        rate_hz=min(one.rate_hz for one in recordings),
        usual=suited_filter(recordings),
        gravity=tuple(float(x) for x in robot.gravity),
        is_mounted_otherwise=False,
        has_torques=False,
        has_reference=False,
        decisions=tuple(notes.decisions),
    )


def _require_no_motors(facts: LogFacts, where: str) -> None:
    """Refuse what was said of motors, where the files hold a wrench sensor and no torques."""
    if facts.columns or facts.gears is not None:
        what = "gears and columns are stated of drives, and the files hold no torques of any"
        raise RecordingError(what, where, "leave out --gears and --column")


@dataclass
class _Notes:
    """Decisions so far."""

    ask: Ask | None
    decisions: list[Decision] = field(default_factory=list)

    def take(self, subject: str, choices: Sequence[str], reason: str) -> int:
        """Note a decision, and have it taken."""
        one = decided(Decision(subject=subject, choices=tuple(choices), reason=reason), self.ask)
        self.decisions.append(one)
        return one.chosen


def _named(
    data: Sequence[str | Path], robot: Robot, facts: LogFacts, notes: _Notes
) -> tuple[Log, ...]:
    """Every record of every file, whose columns have names, if only ours."""
    layout = FileLayout(names="numbered", rate_hz=facts.rate_hz, topic=facts.topic)
    logs = _opened(data, layout)
    if logs[0].is_unnamed:
        told = {f"{signal}.{joint}" for signal in ("q", "tau") for joint in robot.names}
        if told <= facts.columns.keys():
            names = tuple(name for name in logs[0].names if name != "t")
        else:
            names = _by_numbers(logs[0], robot, facts.rate_hz, notes)
        logs = _opened(data, replace(layout, names=names))
    return logs


def _opened(data: Sequence[str | Path], layout: FileLayout) -> tuple[Log, ...]:
    """Every record of every file."""
    paths = [path for one in data for path in find_all(str(one), Path()).values()]
    # A file that is named twice would judge itself.
    distinct = dict.fromkeys(path.resolve() for path in paths)
    logs = tuple(log for path in distinct for log in logs_of(path, layout))
    if not logs:
        raise RecordingError("no file of measurements", remedy="name at least one")
    same_columns(logs)
    return logs


def _by_numbers(log: Log, robot: Robot, rate_hz: float | None, notes: _Notes) -> tuple[str, ...]:
    """Names for columns that have none."""
    for name, error in log.unread.items():
        if name not in log.texts:
            raise error
    samples = len(next(iter(log.columns.values())))
    # Columns of text keep their places: without them others would move.
    nothing = np.full(samples, np.nan)
    own = [log.columns.get(name, nothing) for name in log.names if name != "t"]
    found = named_by_numbers(np.column_stack(own), robot, rate_hz, log.where)
    taken = notes.take("columns", found.choices, found.reason)
    return found.named(taken, robot.names)


def _chosen(matched: Matched, notes: _Notes) -> dict[str, int]:
    """Which group of columns stands for each signal."""
    chosen = {}
    for signal, groups in matched.groups.items():
        titles = [group.title for group in groups]
        reason = groups[0].reason
        if groups[0].origin in ("reference", "command") and signal != "q_ref":
            reason += f"; they are called a {groups[0].origin}, and nothing measured is there"
        elif len(groups) > 1:
            alike = groups[0].origin == groups[1].origin
            reason += "; they come first" if alike else "; their name says that they were measured"
        chosen[signal] = notes.take(signal, titles, reason)
    return chosen


def _with_clock(
    columns: dict[str, Column], log: Log, matched: Matched, robot: Robot, notes: _Notes
) -> dict[str, Column]:
    """The columns with the clock in seconds."""
    if log.layout.rate_hz is not None:
        notes.take("t", [f"samples at {log.layout.rate_hz:g} Hz"], "the rate was given")
        return {ours: one for ours, one in columns.items() if ours != "t"}
    column, why = require_clock(matched, log, robot)
    if column.scale != 1.0 or column.name not in log.columns:
        notes.take("t", [column.name], f"{why}; its name says the unit")
        return columns
    stamps = log.columns[column.name]
    q, v = (
        [log.columns[one.name] for ours, one in columns.items() if ours.startswith(f"{signal}.")]
        for signal in ("q", "v")
    )
    seconds = clock_from_speeds(stamps, q, v)
    step = float(np.median(np.diff(stamps)))
    if seconds is not None:
        scale, unit = seconds
        notes.take("t", [f"{column.name}, in {unit}"], f"{why}, and so the speeds have it")
        return {**columns, "t": Column(column.name, scale)}
    scale, unit = clock_scale(stamps)
    reason = f"{why}, by {step:.4g} from sample to sample"
    if np.all(np.diff(stamps) == 1.0):
        reason += "; if it counts samples, write rate_hz in its place"
    notes.take("t", [f"{column.name}, in {unit}"], reason)
    return {**columns, "t": Column(column.name, scale)}


def _of_joints(
    matched: dict[str, Column], robot: Robot, facts: LogFacts, logs: Sequence[Log], notes: _Notes
) -> Reading:
    """The columns of the joints' side, by what was given, and what motors turn if not one joint."""
    columns, motors = matched, None
    if (ratios := require_ratios(facts.gears, robot)) is not None:
        columns = joint_side(columns, robot, ratios)
        notes.take("gears", ["on the motors' side"], "the ratios were given")
    if facts.columns:
        found = with_stated(facts.columns, matched, columns, robot, logs[0].columns)
        columns, motors = found.columns, found.motors
        reason = "so it was said"
        if found.followed:
            joints = ", ".join(f"tau.{joint}" for joint in found.followed)
            follow = "follow" if found.followed[1:] else "follows"
            reason += f"; {joints} {follow}, for power is the same on either side of gears"
        if facts.gears is not None and (bare := _named_torques(facts, logs[0])):
            reason += f"; {bare} of the joint: a motor's would be multiplied by its gear"
        if motors is not None and len(couplings := couplings_of(motors, robot)) == 1:
            reason += f"; {couplings[0].words}"
        notes.take("stated", [", ".join(facts.columns)], reason)
    return Reading(
        robot=robot,
        columns=columns,
        geared=facts.gears is not None,
        stated=facts.states_positions,
        motors=motors,
    )


def _named_torques(facts: LogFacts, log: Log) -> str:
    """Torques that were stated by the name of a column alone, which no gear multiplies."""
    found = [ours for ours, text in facts.columns.items() if text in log.columns]
    return ", ".join(ours for ours in found if ours.startswith("tau."))


def _read(logs: Sequence[Log], reading: Reading) -> tuple[Recording, ...]:
    robot = reading.robot
    with without_warnings():
        # The draft looks for other units itself, and says what it finds.
        each = [
            read(
                log.file,
                robot.names,
                reading.columns,
                robot.stated_kinds,
                log.record or None,
                layout=log.layout,
            )
            for log in logs
        ]
    return tuple(within_limits(each, robot.position_limits))


def _without_gaps(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """Recordings as they are, or the error that their study would end with."""
    with without_warnings():
        for one in recordings:
            uniform(one)
    return recordings


def _without_strangers(reading: Reading, logs: Sequence[Log], notes: _Notes) -> dict[str, Column]:
    """The columns without references that nothing follows, whose name promised more."""
    columns = reading.columns
    if f"q_ref.{reading.robot.names[0]}" not in columns:
        return columns
    first = _read(logs[:1], reading)[0]
    assert first.q_ref is not None
    q, asked = (x - x.mean(axis=0) for x in (first.q, first.q_ref))
    sizes = np.linalg.norm(q, axis=0) * np.linalg.norm(asked, axis=0)
    if np.all(np.sum(q * asked, axis=0) >= _FOLLOWS * sizes):
        return columns
    notes.take("q_ref", ["left out"], "the positions do not follow these columns")
    return {ours: one for ours, one in columns.items() if not ours.startswith("q_ref.")}


def _with_units(
    reading: Reading, torque: Group, facts: LogFacts, logs: Sequence[Log], notes: _Notes
) -> Reading:
    """The reading with the unit of what stands for torques, and positions beside it in rad."""
    sized = not (torque.is_current or _is_unnamed(logs))
    if not (sized or reading.geared or reading.stated):
        reading = positions_in_radians(reading, _read(logs, reading), notes.take)
    unit = _unit(torque, logs, reading, notes)
    if unit == "A":
        require_no_sums(reading.columns, facts.columns)
    return replace(reading, torque_unit=unit)


def _is_unnamed(logs: Sequence[Log]) -> bool:
    """Whether columns were told by how they move, or by position."""
    return logs[0].layout.names not in ((), "numbered")


def _unit(
    torque: Group, logs: Sequence[Log], reading: Reading, notes: _Notes
) -> Literal["N m", "A"]:
    """The unit of what stands for torques."""
    identified = "the gain of each joint is identified with the rest"
    if torque.is_current:
        why = f"the columns are called currents: {identified}"
        choices = ["A, the drives' own", "N m, although the columns are called currents"]
        return "A" if notes.take("torque_unit", choices, why) == 0 else "N m"
    if not (_is_unnamed(logs) or torque.roles[0].word in _ANYTHING):
        return "N m"
    sizes = drive_sizes(reading.robot, _read(logs, reading))
    if sizes.are_newton_metres:
        return "N m"
    choices = ["A, or another unit of the drives", "N m"]
    taken = notes.take("torque_unit", choices, f"{sizes.reason}: {identified}")
    return "A" if taken == 0 else "N m"


def _filter_of(
    reading: Reading,
    effects: Sequence[str],
    entries: Sequence[DraftedRecording],
    recordings: Sequence[Recording],
    notes: _Notes,
) -> Filter | None:
    """The filter that the recordings need; None for the usual one."""
    # Repetitions tell noise by themselves, and of currents there is no model yet.
    if reading.torque_unit == "A" or any(entry.period for entry in entries):
        return None
    train = [one for one, entry in zip(recordings, entries, strict=True) if entry.use == "train"]
    model = reduce(add, effects, Model(reading.robot))
    return suitable_filter(model, train, notes.take)


def _is_held(
    reading: Reading, recordings: tuple[Recording, ...], named: bool, notes: _Notes
) -> bool:
    """Whether torques are commands that are held from sample to sample."""
    choices = ["measured", "held_command"]
    if named:
        return notes.take("torque", choices[::-1], "the columns are called commands") == 0
    late = samples_late(reading, recordings)
    if late > 0.5:
        reason = f"torques fit far better {late:g} samples later: a delay, for `explain` to find"
        notes.take("torque", ["measured"], reason)
        return False
    if late:
        reason = "torques fit the motion far better half a sample later"
        return notes.take("torque", choices[::-1], reason) == 0
    notes.take("torque", ["measured"], "nothing shows that it is a command held between samples")
    return False
