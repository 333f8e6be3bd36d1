"""The recordings of a draft: which are to judge by, which repeat, and what is to know of each."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace

from dynident.recording import UNWRAPPED, Recording, usable
from dynident.study_draft.draft import DraftedRecording
from dynident.study_draft.log import Log
from dynident.study_draft.log_facts import LogFacts, carried_by
from dynident.study_draft.timing import period_of, uses_of


def drafted_recordings(
    logs: Sequence[Log],
    recordings: Sequence[Recording],
    facts: LogFacts,
    take: Callable[[str, list[str], str], int],
) -> tuple[DraftedRecording, ...]:
    """Return the entries of a study.

    Parameters
    ----------
    logs : of the files.
    recordings : read from them.
    facts : loads that files carry.
    take : takes a decision: (subject, choices, reason) -> which of them.

    Returns
    -------
    One for each log.
    """
    pairs = [(log.file, log.record) for log in logs]
    loads = facts.carried(pairs)
    carried = [carried_by(pair, loads) for pair in pairs]
    above = os.path.commonpath([log.file.parent for log in logs])
    uses, why = uses_of(
        [log.record or log.file.stem for log in logs],
        [os.path.relpath(log.file.parent, above) for log in logs],
    )
    uses = _with_each_load(uses, carried)
    for name in loads:
        files = ", ".join(
            log.file.name for log, one in zip(logs, carried, strict=True) if one == name
        )
        take(f"load '{name}'", [files], "so it was said")
    take("use", [", ".join(dict.fromkeys(uses))], why)
    periods = [period_of(one) for one in recordings]
    if any(periods):
        shown = ", ".join(f"{x:g} s" for x in dict.fromkeys(x for x in periods if x))
        reason = "positions repeat after this time, which gives a noise floor"
        if take("period", [shown, "none"], reason) == 1:
            periods = [None] * len(periods)
    else:
        take("period", ["none"], "no motion repeats within its recording")
    return tuple(
        DraftedRecording(
            file=log.file,
            record=log.record,
            layout=log.layout,
            use="test" if use == "test" else "train",
            period=period,
            load=load,
            remark=_remark(one, period),
        )
        for log, use, period, load, one in zip(
            logs, uses, periods, carried, recordings, strict=True
        )
    )


def _with_each_load(uses: Sequence[str], carried: Sequence[str]) -> list[str]:
    """Uses of recordings, at least one with each load, and one without, among those to fit."""
    found = list(uses)
    for load in dict.fromkeys(carried):
        own = [k for k, one in enumerate(carried) if one == load]
        if all(found[k] == "test" for k in own):
            found[own[0]] = "train"
    return found


def _remark(recording: Recording, period: float | None) -> str:
    """What a reader of the study wants to know of a recording, in a line."""
    said = [f"{recording.duration:.4g} s at {recording.rate_hz:.5g} Hz"]
    if recording.jitter > 0.01:
        said.append(f"time steps vary by {100 * recording.jitter:.2g} %")
    if period:
        said.append(f"{recording.duration / period:.3g} repetitions")
    said += [f"q.{joint} {UNWRAPPED}" for joint in recording.provenance.unwrapped]
    looked = usable(replace(recording, period=period))
    said += [
        f"{one.reason} from {one.start:.4g} to {one.stop:.4g} s is left out by itself"
        for one in looked.left_out or ()
    ]
    return "; ".join(said)
