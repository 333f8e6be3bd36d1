"""The table `[columns]` of a drafted study, with the reason for each line."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dynident.recording import Column
from dynident.study_draft.decision import Decision

_SIGNALS = ("t", "q", "v", "a", "tau", "q_ref", "temperature", "wrench")
_OF_ALL = {
    "units and signs": "Units and signs",
    "zeros": "Zeros",
    "stated": "Stated",
    "coupling": "Coupling",
}
"""Decisions that change columns of several signals, and how remarks begin that say why."""


@dataclass(frozen=True, kw_only=True)
class OtherReading:
    """Columns that would be otherwise.

    Attributes
    ----------
    words : when.
    columns : ours -> theirs, those that differ.
    question : what only whoever knows the robot can say; empty where nothing suggests the reading.
    answers : options of `dynident init` that say it, one for each way in which it may be.
    """

    words: str
    columns: dict[str, Column]
    question: str = ""
    answers: tuple[str, ...] = ()

    @property
    def open_question(self) -> str:
        """The question with its answers, as they are typed; empty where there is none."""
        if not self.question:
            return ""
        return "\n".join([self.question, *(f"    {one}" for one in self.answers)])


def columns_text(
    columns: Mapping[str, Column], decisions: Sequence[Decision], otherwise: OtherReading | None
) -> str:
    """Return the table as TOML.

    Parameters
    ----------
    columns : ours -> theirs.
    decisions : of the draft.
    otherwise : lines that stand in it as a remark.
    """
    if all(one == Column(name) for name, one in columns.items()):
        return as_lines(["", "# The files have the names that a study asks for: no [columns]."])
    lines = [
        "",
        "# Ours = the file's name of it, or a linear expression of its columns.",
        "[columns]",
    ]
    reasons = {one.subject: one for one in decisions}
    for subject, begin in _OF_ALL.items():
        if (one := reasons.get(subject)) is not None:
            lines += as_comment(f"{begin}: {one.words}, because {one.reason}.")
    for signal in _SIGNALS:
        own = [name for name in columns if name.partition(".")[0] == signal]
        if not own:
            continue
        if (one := reasons.get(signal)) is not None:
            others = [choice for k, choice in enumerate(one.choices) if k != one.chosen]
            said = f"{signal}: {one.words}, {one.reason}."
            if others:
                said += f" There are also {'; '.join(others)}."
            lines += as_comment(said)
        lines += [f"{quoted(name)} = {_theirs(columns[name])}" for name in own]
    if otherwise is not None:
        if otherwise.question:
            lines += as_comment(otherwise.question)
            lines += [line for one in otherwise.answers for line in as_comment(one, sys.maxsize)]
        lines += as_comment(f"{otherwise.words}:")
        shown = otherwise.columns.items()
        lines += [f"# {quoted(name)} = {_theirs(one)}" for name, one in shown]
    return as_lines(lines)


def as_lines(lines: list[str]) -> str:
    """Return lines as text."""
    return "".join(f"{line}\n" for line in lines)


def as_comment(text: str, width: int = 98) -> list[str]:
    """Return a remark as lines of comment, without the control characters of hostile names."""
    words = "".join(c if c.isprintable() else " " for c in text).split()
    lines, line = [], "#"
    for word in words:
        if len(line) + 1 + len(word) > width and line != "#":
            lines.append(line)
            line = "#"
        line += f" {word}"
    return [*lines, line]


def quoted(text: str) -> str:
    """Return a text as TOML has it."""
    return json.dumps(text, ensure_ascii=False)


def _theirs(column: Column) -> str:
    if column.scale == 1.0:
        return quoted(column.name)
    scale = repr(column.scale) if _is_exact(column.scale) else f"{column.scale:.6g}"
    scale = scale if any(c in scale for c in ".e") else f"{scale}.0"
    return f"{{ name = {quoted(column.name)}, scale = {scale} }}"


def _is_exact(scale: float) -> bool:
    """Whether a factor is that of a unit, of which every digit counts."""
    return any(math.isclose(abs(scale), x, rel_tol=1e-12) for x in (math.pi / 180, 1e-6, 1e-9))
