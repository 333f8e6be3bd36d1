"""Recordings in, from CSV, NPZ, MAT and Parquet files."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dynident import files
from dynident.errors import RecordingError
from dynident.recording.formats.binary_files import open_mat, open_npz, open_parquet, pick
from dynident.recording.formats.column_names import (
    OPTIONAL,
    PARTIAL,
    REQUIRED,
    Column,
    joints_in,
    resolve,
)
from dynident.recording.formats.column_values import load
from dynident.recording.formats.csv_file import open_csv
from dynident.recording.plausibility import warn_of_units
from dynident.recording.recording import Provenance, Recording, _joint_names

_OPENERS = {".csv": open_csv, ".npz": open_npz, ".mat": open_mat, ".parquet": open_parquet}
SUFFIXES = tuple(_OPENERS)


def read(
    path: str | Path,
    joints: Sequence[str] | None = None,
    columns: Mapping[str, Column | str] | None = None,
    kinds: Sequence[str] | None = None,
    record: str | None = None,
) -> Recording:
    """Read a recording; the file's suffix says its format.

    Parameters
    ----------
    path : file with `t` (s) and, for each joint, `q.<joint>` and `tau.<joint>`; optionally
        `v.<joint>`, `a.<joint>`, `q_ref.<joint>`, and `temperature.<joint>` (degrees Celsius) at
        any of the joints; SI units. In MAT files `q_<joint>`, without dots. Whatever else it
        holds is ignored.
    joints : names, the order of the columns; by default every joint of the file, in its order.
    columns : ours -> theirs, or a linear expression of theirs, for files with other names or
        units, as `{"tau.a": Column("vir", 35.15), "q.a": "x/32"}`; what it leaves out is ours.
    kinds : "revolute" or "prismatic" for each joint, for warnings of units.
    record : which one of an NPZ or MAT file that holds several: a two-dimensional array each, a row
        a sample, and one array of text, `columns`, that names the columns of all.

    Returns
    -------
    Recording
        Named after the record, else the file; period, use and so on are set with
        `Recording.replace`.

    Raises
    ------
    FileError
        If the file is not there or cannot be read.
    RecordingError
        If its content is not a recording: see `Recording` and the readers of each format.

    Warns
    -----
    DynidentWarning
        If time stamps, positions or velocities do not look like SI units.
    """
    path = Path(path)
    where = str(path)
    opener = _OPENERS.get(path.suffix.lower())
    if opener is None:
        raise unknown_suffix(path)
    data = files.read_bytes(path)
    if not data:
        raise RecordingError("is empty", where, "is the file complete?")
    table = opener(data, where)
    if record is not None:
        table = pick(table, record)
    names = joints_in(table) if joints is None else _joint_names(joints, where)
    if kinds is not None and len(kinds) != len(names):
        raise RecordingError(f"{len(kinds)} kinds for {len(names)} joints", where)
    located = resolve(table, names, columns)
    found = load(table, located)
    signals: dict[str, Any] = {
        signal: _stacked([found[f"{signal}.{joint}"] for joint in names])
        for signal in (*REQUIRED, *OPTIONAL)
        if f"{signal}.{names[0]}" in found
    }
    missing = np.full(len(found["t"]), np.nan)
    for signal in PARTIAL:
        parts = [found.get(f"{signal}.{joint}", missing) for joint in names]
        if any(part is not missing for part in parts):
            signals[signal] = _stacked(parts)
    recording = Recording(
        t=found["t"],
        joints=names,
        name=record or path.stem,
        provenance=Provenance(
            where,
            hashlib.sha256(data).hexdigest(),
            record=record or "",
            columns=tuple((ours, one.name, one.scale) for ours, one in located.items()),
        ),
        **signals,
    )
    warn_of_units(recording, kinds)
    return recording


def _stacked(columns: list[np.ndarray]) -> np.ndarray:
    """Return columns side by side, read-only: the recording then shares the array."""
    array = np.column_stack(columns)
    array.setflags(write=False)
    return array


def unknown_suffix(path: Path) -> RecordingError:
    """Return the error for a file whose suffix names no format."""
    what = f"the suffix '{path.suffix}' names no format" if path.suffix else "has no suffix"
    return RecordingError(what, str(path), f"formats: {', '.join(SUFFIXES)}")
