"""Recordings in, from files of any format that is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dynident.arguments import checked
from dynident.errors import RecordingError, warn
from dynident.recording.formats.column_names import (
    OPTIONAL,
    PARTIAL,
    REQUIRED,
    Column,
    joints_in,
    resolve,
)
from dynident.recording.formats.column_table import ColumnTable, FileLayout
from dynident.recording.formats.joint_state_table import prefixed
from dynident.recording.formats.open_table import DEFAULT_LAYOUT, open_table
from dynident.recording.formats.recorded import Wanted, recorded
from dynident.recording.formats.whole_turns import UNWRAPPED, unwrapped
from dynident.recording.plausibility import warn_of_units
from dynident.recording.recording import Recording, _joint_names

SUFFIXES = (".csv", ".npz", ".mat", ".parquet")
"""Suffixes of the files that are read and written; more are read, see `open_table.READABLE`."""


@checked
def read(
    path: str | Path,
    joints: Sequence[str] | None = None,
    columns: Mapping[str, Column | str] | None = None,
    kinds: Sequence[str] | None = None,
    record: str | None = None,
    *,
    layout: FileLayout = DEFAULT_LAYOUT,
    sound_in: tuple[float, float] | None = None,
) -> Recording:
    """Read a recording; the file's suffix says its format.

    Parameters
    ----------
    path : file with `t` (s) and, for each joint, `q.<joint>` and `tau.<joint>`; optionally
        `v.<joint>`, `a.<joint>`, `q_ref.<joint>`, and `temperature.<joint>` (degrees Celsius) at
        any of the joints; SI units. In MAT files `q_<joint>`, without dots. Whatever else it
        holds is not read, and said in the provenance. In a bag of ROS (.bag, .mcap, .db3, or the
        folder of a recording of ROS 2), messages `sensor_msgs/JointState` hold them: joints go
        by their names, with or without a prefix that all have.
    joints : names, the order of the columns; by default every joint of the file, in its order.
    columns : ours -> theirs, or a linear expression of theirs, for files with other names or
        units, as `{"tau.a": Column("vir", 35.15), "q.a": "x/32"}`; what it leaves out is ours.
    kinds : "revolute", "continuous" or "prismatic" for each joint, for warnings of units. An angle
        that jumps by whole turns, as one does that is kept in [-pi, pi), is read as going on: that
        changes no torque. The provenance names the joints.
    record : which one of an NPZ or MAT file that holds several: a two-dimensional array each, a row
        a sample, and one array of text, `columns`, that names the columns of all.
    layout : what the file does not say of itself: names of columns without a header line, the rate
        where there is no column of time, the topic of a bag.
    sound_in : (t0, t1) s. The file may then have faults (what is no number, a clock that goes back,
        a long gap) outside that window, and what is beyond them is not kept, which the provenance
        says. A recording without faults is kept as a whole.

    Returns
    -------
    Recording
        Named after the record, else the file; period, use and so on are set with
        `Recording.replace`. CSV, NPY, NPZ, Parquet and HDF5 files are read some rows at a time, and
        what is larger than `spooled.IN_MEMORY` never is in memory as a whole: it is mapped from
        files that are there for as long as the recording is. The provenance then says so.

    Raises
    ------
    FileError
        If the file is not there, is no regular file, cannot be read or is too large.
    RecordingError
        If its content is not a recording: see `Recording` and the readers of each format; if there
        is no room for it.

    Warns
    -----
    DynidentWarning
        If time stamps, positions or velocities do not look like SI units, or positions jumped by
        whole turns.
    """
    path = Path(path)
    where = str(path)
    table = open_table(path, record, layout=layout)
    names = joints_in(table) if joints is None else _joint_names(joints, where)
    if kinds is not None and len(kinds) != len(names):
        raise RecordingError(f"{len(kinds)} kinds for {len(names)} joints", where)
    located = resolve(table, names, named_otherwise(table, names, columns, layout))
    wanted = Wanted(
        columns=located,
        signals=lambda part: _signals(part, names),
        joints=names,
        path=path,
        record=record or "",
    )
    recording = recorded(table, wanted, sound_in)
    if kinds is not None:
        recording = _turned(recording, names, kinds)
    warn_of_units(recording, kinds)
    return recording


def _turned(recording: Recording, names: Sequence[str], kinds: Sequence[str]) -> Recording:
    """The recording without jumps by whole turns, which says which joints turn without end."""
    found = unwrapped(recording, kinds)
    if found.provenance.unwrapped:
        columns = ", ".join(f"q.{name}" for name in found.provenance.unwrapped)
        what = f"{found.where}, column {columns}: {UNWRAPPED}"
        warn(what)
    turn = tuple(name for name, kind in zip(names, kinds, strict=True) if kind == "continuous")
    return found.replace(continuous=turn)


def _signals(found: Mapping[str, np.ndarray], joints: Sequence[str]) -> dict[str, Any]:
    """Time stamps (k,) and some rows (k, n) of each signal of all joints, from their columns."""
    signals: dict[str, Any] = {"t": found["t"]}
    signals |= {
        signal: np.column_stack([found[f"{signal}.{joint}"] for joint in joints])
        for signal in (*REQUIRED, *OPTIONAL)
        if f"{signal}.{joints[0]}" in found
    }
    missing = np.full(len(found["t"]), np.nan)
    for signal in PARTIAL:
        parts = [found.get(f"{signal}.{joint}", missing) for joint in joints]
        if any(part is not missing for part in parts):
            signals[signal] = np.column_stack(parts)
    return signals


def named_otherwise(
    table: ColumnTable,
    joints: Sequence[str],
    columns: Mapping[str, Column | str] | None,
    layout: FileLayout,
) -> dict[str, Column | str]:
    """Return the mapping of columns, with what prefixes of joints and a stated rate make of it.

    Parameters
    ----------
    table : what the file holds.
    joints : of the robot.
    columns : ours -> theirs.
    layout : what the file does not say of itself.

    Raises
    ------
    RecordingError
        If joints come with several prefixes, or there are a rate and a column of time.
    """
    return _with_prefix(table, joints) | _with_rate(table, columns, layout)


def _with_rate(
    table: ColumnTable, columns: Mapping[str, Column | str] | None, layout: FileLayout
) -> dict[str, Column | str]:
    """The mapping of columns without that of the time, where a rate takes its place."""
    mapping = dict(columns or {})
    if layout.rate_hz is not None and "t" in mapping:
        theirs = mapping.pop("t")
        name = theirs.name if isinstance(theirs, Column) else theirs
        if name in table.there:
            what = f"rate_hz = {layout.rate_hz:g} is given, and '{name}' is the column of time"
            raise RecordingError(what, table.file, "leave out one of them")
    return mapping


def _with_prefix(table: ColumnTable, joints: Sequence[str]) -> dict[str, Column | str]:
    """Columns of joints that the file names with a prefix, or without the robot's."""
    if table.joints == "exact":
        return {}
    split = [name.partition(".") for name in table.names]
    theirs = prefixed([joint for _, _, joint in split if joint], joints, table.file)
    return {
        f"{signal}.{ours}": f"{signal}.{name}"
        for ours, name in theirs.items()
        for signal in (*REQUIRED, *OPTIONAL)
        if f"{signal}.{name}" in table.there
    }
