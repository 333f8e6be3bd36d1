"""`draft_study`: from a robot description and files of measurements to a study with reasons."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from dynident.data_files import find_all
from dynident.errors import DynidentWarning, RecordingError
from dynident.recording import Column, FileLayout, Recording, read, usable
from dynident.robot import Robot
from dynident.study_draft.by_numbers import named_by_numbers
from dynident.study_draft.decision import Ask, Decision, decided
from dynident.study_draft.draft import DraftedRecording, StudyDraft
from dynident.study_draft.log import Log, logs_of, same_columns
from dynident.study_draft.matching import Matched, match
from dynident.study_draft.motor_side import joint_side, require_ratios, turned
from dynident.study_draft.timing import clock_scale, period_of, uses_of
from dynident.study_draft.torque_timing import looks_held
from dynident.study_draft.wiring_guess import WiringGuess, guess_wiring
from dynident.study_draft.zeros import guess_zeros
from dynident.threads import single_threaded

_FRICTION = ("viscous_friction", "coulomb_friction", "torque_offset")
_FOLLOWS = 0.7
"""Correlation of a position with the reference that it follows, be it late."""


@single_threaded
def draft_study(
    robot: str | Path,
    data: Sequence[str | Path],
    *,
    joints: Sequence[str] | None = None,
    gears: Sequence[float] | None = None,
    rate_hz: float | None = None,
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
    joints : of the robot that were recorded, in order; by default all that move.
    gears : ratio of each joint's gear, where the files are of the motors' side; negative where the
        joint turns the other way.
    rate_hz : of the samples, where the files have no clock.
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
        If a file holds no positions, torques and time of every joint, or files differ in their
        columns.
    """
    described = Robot.from_file(robot, joints)
    notes = _Notes(ask)
    layout = FileLayout(names="numbered", rate_hz=rate_hz)
    logs = _opened(data, layout)
    if logs[0].is_unnamed:
        names = _by_numbers(logs[0], described, rate_hz, notes)
        logs = _opened(data, FileLayout(names=names, rate_hz=rate_hz))
    matched = match(logs[0], described)
    chosen = _chosen(matched, notes)
    columns = matched.columns(described, chosen)
    columns = _with_clock(columns, logs[0], matched, notes)
    ratios = require_ratios(gears, described)
    if ratios is not None:
        columns = joint_side(columns, described, ratios)
        notes.take("gears", ["on the motors' side"], "the ratios were given")
    recordings = _read(logs, described, columns)
    columns = _without_strangers(columns, recordings, notes)
    columns = _with_zeros(columns, recordings, described, notes)
    recordings = _read(logs, described, columns)
    unit = _unit(matched, notes)
    wiring = guess_wiring(described, recordings, columns, unit)
    columns = _wired(columns, wiring, logs[0].where, notes)
    recordings = _read(logs, described, columns)
    origin = matched.groups["tau"][chosen.get("tau", 0)].origin
    held = _is_held(described, recordings, origin == "command", notes)
    return StudyDraft(
        robot=Path(robot),
        joints=None if joints is None else tuple(joints),
        columns=columns,
        recordings=_drafted(logs, recordings, notes),
        torque="held_command" if held else "measured",
        torque_unit=unit,
        effects=(*_FRICTION, "rotor_inertia")
        if wiring.gears or ratios or matched.drive
        else _FRICTION,
        rate_hz=min(one.rate_hz for one in recordings),
        gravity=tuple(float(x) for x in described.gravity),
        has_reference=recordings[0].q_ref is not None,
        decisions=tuple(notes.decisions),
    )


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


def _opened(data: Sequence[str | Path], layout: FileLayout) -> tuple[Log, ...]:
    """Every record of every file."""
    paths = [path for one in data for path in find_all(str(one), Path()).values()]
    logs = tuple(log for path in paths for log in logs_of(path, layout))
    if not logs:
        raise RecordingError("no file of measurements", remedy="name at least one")
    same_columns(logs)
    return logs


def _by_numbers(log: Log, robot: Robot, rate_hz: float | None, notes: _Notes) -> tuple[str, ...]:
    """Names for columns that have none."""
    own = [x for name, x in log.columns.items() if name != "t"]
    found = named_by_numbers(np.column_stack(own), robot, rate_hz, log.where)
    taken = notes.take("columns", found.choices, found.reason)
    return found.named(taken, robot.names)


def _chosen(matched: Matched, notes: _Notes) -> dict[str, int]:
    """Which group of columns stands for each signal."""
    chosen = {}
    for signal, groups in matched.groups.items():
        titles = [group.title for group in groups]
        reason = groups[0].reason
        if len(groups) > 1:
            reason += ", and its name is the plainest for what was measured"
        chosen[signal] = notes.take(signal, titles, reason)
    return chosen


def _with_clock(
    columns: dict[str, Column], log: Log, matched: Matched, notes: _Notes
) -> dict[str, Column]:
    """The columns with the clock in seconds."""
    if log.layout.rate_hz is not None:
        notes.take("t", [f"samples at {log.layout.rate_hz:g} Hz"], "the rate was given")
        return {ours: one for ours, one in columns.items() if ours != "t"}
    if matched.time is None:
        what = "no column is a clock that goes forward"
        remedy = "name it t, or write the study by hand"
        raise RecordingError(what, log.where, remedy)
    column, why = matched.time
    if column.scale != 1.0 or column.name not in log.columns:
        notes.take("t", [column.name], f"{why}; its name says the unit")
        return columns
    scale, unit = clock_scale(log.columns[column.name])
    step = float(np.median(np.diff(log.columns[column.name])))
    notes.take("t", [f"{column.name}, in {unit}"], f"{why}, by {step:.4g} from sample to sample")
    return {**columns, "t": Column(column.name, scale)}


def _read(logs: Sequence[Log], robot: Robot, columns: dict[str, Column]) -> tuple[Recording, ...]:
    with warnings.catch_warnings():
        # The draft looks for other units itself, and says what it finds.
        warnings.simplefilter("ignore", DynidentWarning)
        return tuple(
            read(
                log.file,
                robot.names,
                columns,
                robot.kinds,
                log.record or None,
                layout=log.layout,
            )
            for log in logs
        )


def _without_strangers(
    columns: dict[str, Column], recordings: Sequence[Recording], notes: _Notes
) -> dict[str, Column]:
    """The columns without references that nothing follows, whose name promised more."""
    first = recordings[0]
    if first.q_ref is None:
        return columns
    q, asked = (x - x.mean(axis=0) for x in (first.q, first.q_ref))
    sizes = np.linalg.norm(q, axis=0) * np.linalg.norm(asked, axis=0)
    if np.all(np.sum(q * asked, axis=0) >= _FOLLOWS * sizes):
        return columns
    notes.take("q_ref", ["left out"], "the positions do not follow these columns")
    return {ours: one for ours, one in columns.items() if not ours.startswith("q_ref.")}


def _with_zeros(
    columns: dict[str, Column], recordings: tuple[Recording, ...], robot: Robot, notes: _Notes
) -> dict[str, Column]:
    """The columns with the zeros of joints where the description has them."""
    guess = guess_zeros(robot, recordings)
    if not guess.evidence:
        return columns
    moved = [
        f"{q} by {90 * k:+d} deg" for q, k in zip(robot.names, guess.quarters, strict=True) if k
    ]
    choices = [f"moved: {', '.join(moved)}", "as recorded"]
    if notes.take("zeros", choices, guess.evidence) == 1:
        return columns
    return turned(columns, robot, guess.quarters)


def _unit(matched: Matched, notes: _Notes) -> Literal["N m", "A"]:
    """The unit of what stands for torques."""
    if not matched.drive:
        return "N m"
    why = "the file has currents and no torques: the gain of each joint is identified with the rest"
    choices = ["A, the drives' own", "N m, although the columns are called currents"]
    return "A" if notes.take("torque_unit", choices, why) == 0 else "N m"


def _wired(
    columns: dict[str, Column], wiring: WiringGuess, where: str, notes: _Notes
) -> dict[str, Column]:
    """The columns in units, gears and signs as whoever is asked takes them."""
    if wiring.unknown_gears:
        what = (
            f"positions of {', '.join(wiring.unknown_gears)} are on the motor side of gears, whose "
            "ratios the data do not tell"
        )
        raise RecordingError(what, where, "give them: --gears 32,-48,1 for three joints, say")
    if wiring.note:
        notes.take("units", ["as recorded"], f"they could not be compared: {wiring.note}")
    if not wiring.findings:
        return columns
    what = "; ".join(what for what, _ in wiring.findings)
    why = "; ".join(dict.fromkeys(evidence for _, evidence in wiring.findings))
    taken = notes.take("units and signs", [what, "as recorded"], why)
    return wiring.columns if taken == 0 else columns


def _is_held(robot: Robot, recordings: tuple[Recording, ...], named: bool, notes: _Notes) -> bool:
    """Whether torques are commands that are held from sample to sample."""
    choices = ["measured", "held_command"]
    if named:
        return notes.take("torque", choices[::-1], "the columns are called commands") == 0
    if looks_held(robot, recordings):
        reason = "torques fit the motion far better half a sample later"
        return notes.take("torque", choices[::-1], reason) == 0
    notes.take("torque", ["measured"], "nothing shows that it is a command held between samples")
    return False


def _drafted(
    logs: Sequence[Log], recordings: Sequence[Recording], notes: _Notes
) -> tuple[DraftedRecording, ...]:
    """The recordings with their use, their periods and what is to know of them."""
    uses, why = uses_of([log.record or log.file.stem for log in logs])
    notes.take("use", [", ".join(dict.fromkeys(uses))], why)
    periods = [period_of(one) for one in recordings]
    if any(periods):
        shown = ", ".join(f"{x:g} s" for x in dict.fromkeys(x for x in periods if x))
        reason = "positions repeat after this time, which gives a noise floor"
        if notes.take("period", [shown, "none"], reason) == 1:
            periods = [None] * len(periods)
    else:
        notes.take("period", ["none"], "no motion repeats within its recording")
    return tuple(
        DraftedRecording(
            file=log.file,
            record=log.record,
            layout=log.layout,
            use="test" if use == "test" else "train",
            period=period,
            remark=_remark(one, period),
        )
        for log, use, period, one in zip(logs, uses, periods, recordings, strict=True)
    )


def _remark(recording: Recording, period: float | None) -> str:
    """What a reader of the study wants to know of a recording, in a line."""
    said = [f"{recording.duration:.4g} s at {recording.rate_hz:.5g} Hz"]
    if recording.jitter > 0.01:
        said.append(f"time steps vary by {100 * recording.jitter:.2g} %")
    if period:
        said.append(f"{recording.duration / period:.3g} repetitions")
    looked = usable(replace(recording, period=period))
    said += [
        f"{one.reason} from {one.start:.4g} to {one.stop:.4g} s is left out by itself"
        for one in looked.left_out or ()
    ]
    return "; ".join(said)
