"""A drafted study: its text with the reason for each line, and the file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from dynident import files
from dynident.effects import FRICTION_WIDTH
from dynident.recording import Column, FileLayout, Filter
from dynident.study import load, load_wrenches
from dynident.study_draft.decision import Decision
from dynident.study_draft.drafted_columns import (
    OtherReading,
    as_comment,
    as_lines,
    columns_text,
    quoted,
)
from dynident.tables import Table


@dataclass(frozen=True, kw_only=True)
class DraftedRecording:
    """An entry of `[[recordings]]`.

    Attributes
    ----------
    file, record : where it is; `record` is empty where the file holds one.
    layout : names of its columns by position, and its rate, where the file says neither.
    use, period : as in a study.
    load : name of the load that it carries; empty for none.
    remark : rate, repetitions and idle stretches, in words.
    """

    file: Path
    record: str
    layout: FileLayout
    use: Literal["train", "test"]
    period: float | None
    load: str
    remark: str


@dataclass(frozen=True, kw_only=True)
class StudyDraft:
    """A study that was worked out from files.

    Attributes
    ----------
    robot : path of the description.
    joints : that were recorded; None for all that move.
    columns : ours -> theirs, also where both are called the same.
    otherwise : columns that another reading has in their place; None where there is none.
    recordings : entries of the study.
    filter : that they need; None for the usual one.
    loads : name -> mass, kg, or None.
    torque : "measured" or "held_command".
    torque_unit : "N m", or "A" of drives.
    effects : that the model starts with.
    rate_hz : of the slowest recording.
    usual : the filter of recordings whose study states none.
    gravity : (3) m/s^2, in the base's axes.
    is_mounted_otherwise : whether that is not the description's.
    has_torques : whether the files hold torques or currents of the joints; without them only what
        hangs on a wrench sensor can be weighed.
    has_reference : whether the files hold positions that were asked for.
    decisions : what was decided, and why.
    """

    robot: Path
    joints: tuple[str, ...] | None
    columns: dict[str, Column]
    otherwise: OtherReading | None
    recordings: tuple[DraftedRecording, ...]
    filter: Filter | None
    loads: dict[str, float | None]
    torque: Literal["measured", "held_command"]
    torque_unit: Literal["N m", "A"]
    effects: tuple[str, ...]
    rate_hz: float
    usual: Filter
    gravity: tuple[float, ...]
    is_mounted_otherwise: bool
    has_torques: bool
    has_reference: bool
    decisions: tuple[Decision, ...]

    @property
    def next_command(self) -> str:
        """What to do with the study."""
        return "dynident explain" if self.has_torques else "dynident payload"

    def text(self, folder: str | Path = ".") -> str:
        """Return the study as TOML, with paths relative to a folder."""
        folder = Path(folder)
        parts = [
            self._head(folder),
            self._model() if self.has_torques else "",
            columns_text(self.columns, self.decisions, self.otherwise),
            self._filter(),
            self._loads(),
            *(self._recording(one, folder) for one in self.recordings),
            self._optional(),
        ]
        return "".join(parts)

    def write(self, path: str | Path) -> Path:
        """Write the study, after it has been read back.

        Raises
        ------
        FileError
            If the file cannot be written.
        StudyError
            If what was drafted is no study; whatever the file held is then untouched.
        """
        path = files.require_place(path)
        verify = load if self.has_torques else load_wrenches
        return files.write_bytes(path, self.text(path.parent).encode(), verify=verify)

    def decision_table(self) -> Table:
        """What was decided, and why."""
        return Table(
            "What the files are taken for",
            ("", "taken for", "because"),
            tuple((one.subject, one.words, one.reason) for one in self.decisions),
        )

    @property
    def open_question(self) -> str:
        """What the files suggest and only whoever knows the robot can say; empty for nothing."""
        return "" if self.otherwise is None else self.otherwise.open_question

    def to_dict(self) -> dict[str, Any]:
        """The draft as JSON has it."""
        return {
            "decisions": [
                {"subject": one.subject, "choices": list(one.choices), "chosen": one.words,
                 "reason": one.reason}
                for one in self.decisions
            ],
            "study": self.text(),
        }  # fmt: skip

    # --- parts of the text ----------------------------------------------------------------------

    def _head(self, folder: Path) -> str:
        lines = [
            "# A study of dynident, drafted from the files that it names. Read what was decided,",
            f"# correct what is wrong, then: {self.next_command} <this file>",
            f"robot = {quoted(_relative(self.robot, folder))}",
        ]
        if self.joints is not None:
            lines.append(f"joints = {json.dumps(self.joints, ensure_ascii=False)}")
        return as_lines(lines)

    def _model(self) -> str:
        held = self.torque == "held_command"
        why = "a command is held to the next sample" if held else "as a sensor or drive reports it"
        rotor = [] if "rotor_inertia" in self.effects else ['# Behind gears add "rotor_inertia".']
        return as_lines(
            [
                "",
                "# Effects that any geared joint has, at every joint; `explain` looks for others.",
                *rotor,
                f"effects = {json.dumps(self.effects)}",
                f'torque = "{self.torque}"  # {why}',
                *self._drives(),
                f"# friction_width = {FRICTION_WIDTH:g}  # rad/s; or of joints: {{ j1 = 0.05 }}",
                f"{'' if self.is_mounted_otherwise else '# '}gravity = {json.dumps(self.gravity)}"
                "  # m/s^2 in the base's axes",
            ]
        )

    def _drives(self) -> list[str]:
        """Keys of torques in amperes, and what fixes their scale."""
        if self.torque_unit == "N m":
            return []
        first = next(name for name in self.columns if name.startswith("tau."))
        gains = f"{{ {quoted(first.partition('.')[2])} = 10.0 }}"
        return [
            'torque_unit = "A"  # motor currents: each joint has a gain, which is identified',
            "# A known load (see the end) or a known gain fixes the common scale of the gains:",
            f"# drive_gains = {gains}  # N m/A",
        ]

    def _filter(self) -> str:
        if self.filter is None:
            one, mark = self.usual, "# "
            said = f"Without this table it is what suits samples at {self.rate_hz:.5g} Hz and the"
            said += " noise of these encoders:"
        else:
            one, mark = self.filter, ""
            (taken,) = (each for each in self.decisions if each.subject == "filter")
            said = f"The cut-offs of positions and of columns: {taken.words}, for {taken.reason}."
        return as_lines(
            [
                "",
                *as_comment(said),
                f"{mark}[filter]",
                f"{mark}position_cutoff_hz = {one.position_cutoff_hz:g}  # of q, before it is"
                " differentiated",
                f"{mark}cutoff_hz = {one.cutoff_hz:g}  # of columns and torque alike",
                f"{mark}rate_hz = {one.rate_hz:g}  # rows that are kept",
            ]
        )

    def _loads(self) -> str:
        lines = []
        for name, mass in self.loads.items():
            lines += ["", "# What is left out is identified: centre = [x, y, z] (m), inertia.",
                      f"[loads.{name}]"]  # fmt: skip
            lines += [] if mass is None else [f"mass = {float(mass)!r}  # kg"]
        return as_lines(lines)

    def _recording(self, one: DraftedRecording, folder: Path) -> str:
        lines = ["", *as_comment(f"{one.remark}."), "[[recordings]]"]
        lines.append(f"file = {quoted(_relative(one.file, folder))}")
        if one.record:
            lines.append(f"record = {quoted(one.record)}")
        if one.layout.names and one.layout.names != "numbered":
            names = ", ".join(quoted(name) for name in one.layout.names)
            lines.append(f"columns = [{names}]")
        if one.layout.rate_hz is not None:
            lines.append(f"rate_hz = {one.layout.rate_hz!r}")
        lines.append(f'use = "{one.use}"')
        if one.layout.topic:
            lines.append(f"topic = {quoted(one.layout.topic)}")
        if one.load:
            lines.append(f"payload = {quoted(one.load)}")
        if one.period is not None:
            lines.append(f"period = {one.period!r}")
        return as_lines(lines)

    def _optional(self) -> str:
        lines = [
            "",
            "# In an entry of [[recordings]], where it applies:",
            "# start = 0.0            # s, when it began in the session: motors warm up",
            "# window = [0.0, 10.0]   # s, what to use of it",
            "# payload = true         # a load is carried; false: none; leave out: not known",
            '# payload = "tool"       # one of several, or one of which something is known:',
            "# [loads.tool]",
            "# mass = 2.8                   # kg; what is left out is identified",
            "# centre = [0.0, 0.02, 0.05]   # m, of mass, in the last link's frame",
        ]
        if not any(one.period for one in self.recordings):
            n = len([name for name in self.columns if name.startswith("q.")])
            listed = ", ".join(["0.1"] * n)
            lines += [
                "",
                "# Nothing repeats, so that the noise is unknown: state it if you know it.",
                "# [noise]",
                f"# position_std = {json.dumps([1e-5] * n)}  # rad or m",
                f"# torque_std = [{listed}]  # {'N m or N' if self.torque_unit == 'N m' else 'A'}",
            ]
        if self.has_reference:
            lines += [
                "",
                "# The loop, for instruments and validation (dynident fit --method iv, simulate).",
                "# [controller]",
                '# kind = "pd"',
                f"# rate_hz = {self.rate_hz:.5g}",
            ]
        return as_lines(lines)


def _relative(path: Path, folder: Path) -> str:
    """A path as the study names it: relative where it lies below or beside, else whole."""
    try:
        # Resolved: ".." of a folder that is a link leads elsewhere.
        found = os.path.relpath(path.resolve(), folder.resolve())
    except ValueError:  # another drive of Windows
        return path.absolute().as_posix()
    steps = Path(found).parts.count("..")
    return Path(found).as_posix() if steps <= 4 else path.absolute().as_posix()
