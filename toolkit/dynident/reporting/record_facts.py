"""What a study has read: the facts of its recordings, and their picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dynident import files
from dynident.recording import (
    Recording,
    as_points,
    count_rows,
    default_filter,
    turning_round,
    uniform,
    unwrapped_notes,
)
from dynident.recording.repetition import shift_mismatch
from dynident.reporting.pictures.recordings_picture import by_record, recordings_figure
from dynident.study import Study
from dynident.tables import Table, percent


@dataclass(frozen=True, kw_only=True)
class RecordFacts:
    """A record of a file, as a study uses it.

    Attributes
    ----------
    name : of the recording.
    uses : "train" and "test" -> entries of the study.
    duration, longest_gap : s.
    rate_hz : mean sampling rate.
    jitter : largest departure of a time step from the mean one, relative to it.
    period : s, as stated; None where none is.
    repeats_to : difference of positions a period apart, relative to the motion; None likewise.
    left_out : stretches that are not used, and why.
    rows : that pass the filter and count, of all entries.
    not_read : what else the file holds, in words each.
    unwrapped : joints whose positions jumped by whole turns, and are read as going on.
    began : s that the clock of the file showed at t = 0; zero where t is that clock.
    """

    name: str
    uses: dict[str, int]
    duration: float
    rate_hz: float
    jitter: float
    longest_gap: float
    period: float | None
    repeats_to: float | None
    left_out: tuple[str, ...]
    rows: int
    not_read: tuple[str, ...] = ()
    unwrapped: tuple[str, ...] = ()
    began: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """The facts as JSON has them."""
        return asdict(self)


def record_facts(study: Study) -> tuple[RecordFacts, ...]:
    """Return the facts of each record that a study uses, in its order."""
    settings = study.train.filter
    found = []
    for some in by_record(study):
        one = some[0]
        rows = [
            count_rows(uniform(entry), settings or default_filter(entry.rate_hz)).used
            for entry in some
        ]
        gone = dict.fromkeys(
            f"{stretch.reason} {stretch.start:.4g} to {stretch.stop:.4g} s"
            for entry in some
            for stretch in entry.left_out or ()
        )
        found.append(
            RecordFacts(
                name=one.name,
                uses=dict(Counter(entry.use for entry in some)),
                duration=one.duration,
                rate_hz=one.rate_hz,
                jitter=one.jitter,
                longest_gap=float(np.diff(one.t).max()),
                period=one.period,
                repeats_to=_repeats_to(one),
                left_out=tuple(gone),
                rows=sum(rows),
                not_read=one.provenance.skipped,
                unwrapped=one.provenance.unwrapped,
                began=one.provenance.began,
            )
        )
    return tuple(found)


def _repeats_to(one: Recording) -> float | None:
    q = as_points(one.q, turning_round(one))
    q = q[:, np.ptp(q, axis=0) > 0]
    if one.period is None or not q.shape[1]:
        return None
    off = shift_mismatch((q - q.mean(axis=0)) / np.std(q, axis=0), one.period * one.rate_hz)
    return off if np.isfinite(off) else None


def recordings_table(facts: Sequence[RecordFacts]) -> Table:
    """Return the facts as a table, a record a row."""
    columns = ("", "use", "length", "rate", "jitter", "longest gap", "repeats", "left out", "rows")
    rows = tuple(
        (
            one.name,
            ", ".join(f"{n} x {use}" if n > 1 else use for use, n in one.uses.items()),
            f"{one.duration:.4g} s",
            f"{one.rate_hz:.5g} Hz",
            percent(one.jitter),
            f"{one.longest_gap:.3g} s",
            "-" if one.period is None else f"{one.period:g} s, to {percent(one.repeats_to)}",
            "; ".join(one.left_out) or "-",
            str(one.rows),
        )
        for one in facts
    )
    notes = (
        "Rows are those that pass the filter; jitter is the largest of a time step.",
        *(f"Not read of {one.name}: {'; '.join(one.not_read)}." for one in facts if one.not_read),
        *(
            f"Times in {one.name} count from its first sample, at {one.began:.0f} s of its clock."
            for one in facts
            if one.began
        ),
        *unwrapped_notes((one.name, one.unwrapped) for one in facts),
    )
    return Table("Recordings as they were read", columns, rows, notes)


def show_recordings(study: Study, to: str | Path) -> Path:
    """Draw positions and torques of all recordings: what fits, what judges, what is left out.

    Parameters
    ----------
    study : as it was loaded.
    to : PNG, SVG or PDF, by its suffix.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    to = Path(to)
    return files.write_bytes(to, recordings_figure(study, to.suffix.lower().removeprefix(".")))
