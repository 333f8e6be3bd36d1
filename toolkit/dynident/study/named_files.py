"""What a study file names: its robot, and its recordings with their loads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynident.data_files import find_all
from dynident.errors import DynidentError, RecordingError, RobotError, StudyError
from dynident.fitting.loads import Load, loads_of
from dynident.recording import (
    Column,
    FileLayout,
    Filter,
    Recording,
    common_filter,
    counted_window,
    default_cutoff,
    default_position_cutoff,
    frame_of,
    read,
    sound_part,
    suited_position_cutoff,
    with_suited_order,
    within_limits,
)
from dynident.robot import Robot
from dynident.settings import LONGEST_SESSION
from dynident.study.study_file import FilterEntry, RecordingEntry, StudyFile


@contextmanager
def naming(path: Path, key: str) -> Iterator[None]:
    """Name the file in complaints about one of its tables."""
    try:
        yield
    except DynidentError as error:
        raise StudyError(error.what, f"{path}: {key}", error.remedy) from None


def robot_of(said: StudyFile, path: Path) -> Robot:
    """Return the robot of a study.

    Raises
    ------
    RobotError
        If its description is unusable.
    StudyError
        If the choice of joints is.
    """
    file = path.parent / said.robot
    try:
        robot = Robot.from_file(file, said.joints, said.gravity)
    except RobotError as error:
        if said.joints is None:
            raise
        Robot.from_file(file)  # it is either unusable, or it is the choice of joints
        raise StudyError(str(error), f"{path}: joints") from None
    for link in robot.links:
        if not np.all(np.isfinite(link.phi)):
            what, remedy = "its inertia is not finite", "fix the numbers of its inertial element"
            raise RobotError(what, f"{file}: link '{link.name}'", remedy)
    return robot


def filter_of(said: FilterEntry | None, recordings: list[Recording]) -> Filter | None:
    """Return the filter of a study: what it leaves out is chosen to suit what it states.

    Without a table it is that which suits all recordings, if there is one.
    Only "none" leaves positions unfiltered, or lets columns and torque through where positions are
    filtered; but a recipe that says how ends or decimation are to be treated is followed as it is.
    """
    if said is None:
        return common_filter(recordings)
    values = said.model_dump()
    cutoff = said.cutoff_hz if isinstance(said.cutoff_hz, float) else None
    position = said.position_cutoff_hz
    is_recipe = said.decimation != "pick" or said.ends != "drop"
    usual = position == "default"
    if position == "default":
        position = default_position_cutoff(min(one.rate_hz for one in recordings), cutoff)
    if said.cutoff_hz == "default" and position != "none" and not is_recipe:
        cutoff, values["rate_hz"] = default_cutoff(position, said.rate_hz)
    if usual and not is_recipe:
        position = suited_position_cutoff(recordings, cutoff)
    values |= {"position_cutoff_hz": None if position == "none" else position, "cutoff_hz": cutoff}
    return with_suited_order(Filter(**values), recordings)


def recordings_of(
    said: StudyFile, path: Path, robot: Robot
) -> tuple[list[Recording], tuple[Load, ...]]:
    """Read every recording of a study.

    Parameters
    ----------
    said : the study.
    path : its file.
    robot : whose joints are recorded.

    Returns
    -------
    The recordings, and the loads that they name.

    Raises
    ------
    StudyError
        If the study contradicts itself.
    DynidentError
        If a recording cannot be read.
    """
    columns = {
        ours: theirs for ours, theirs in columns_of(said, path).items() if not frame_of(ours)
    }
    names, loads = loads_of((one.payload for one in said.recordings), said.loads, str(path))
    payloads = [one.payload for one in said.recordings if not loads]
    if "unknown" in payloads and any(isinstance(one, bool) for one in payloads):
        remedy = 'state true or false for every recording, or "unknown" for all of them'
        raise StudyError("a payload is known and unknown", f"{path}: recordings", remedy)

    def read_file(one: NamedFile, sound_in: tuple[float, float] | None = None) -> Recording:
        return read(
            one.file,
            robot.names,
            columns,
            robot.stated_kinds,
            one.record,
            layout=one.layout,
            sound_in=sound_in,
        )

    known: dict[NamedFile, Recording] = {}
    found: list[Recording] = []
    for number, one in enumerate(named_files(said, path), start=1):
        key, entry = replace(one, place=0), said.recordings[one.place]
        try:
            # Entries with windows of one file share its samples where all of it is sound.
            if key not in known:
                known[key] = read_file(one)
            window = counted_window(entry.window, known[key].provenance.began)
            recording = sound_part(known[key], window)
        except RecordingError:
            if entry.window is None:
                raise
            recording = read_file(one, entry.window)
            window = counted_window(entry.window, recording.provenance.began)
        found.append(
            recording.replace(
                name=entry.record or one.name,
                use=entry.use,
                period=entry.period,
                start=entry.start,
                window=window,
                payload=entry.payload if isinstance(entry.payload, bool) else None,
                load=names[one.place],
                torque=said.torque,
                number=number,
            )
        )
    if not any("start" in entry.model_fields_set for entry in said.recordings):
        found = _started(found)
    return within_limits(found, robot.position_limits), loads


def _started(recordings: list[Recording]) -> list[Recording]:
    """Say when recordings began whose clocks count from before the session, where none states it.

    After the earliest one; those that are further apart than a session lasts are left alone. Beside
    clocks that do not, the time that each shows counts.
    """
    began = [one.provenance.began for one in recordings]
    shown = [known or float(one.t[0]) for one, known in zip(recordings, began, strict=True)]
    if not shown or max(shown) - min(shown) > LONGEST_SESSION:
        return recordings
    first = min(began)
    return [
        one.replace(start=known - first) if known else one
        for one, known in zip(recordings, began, strict=True)
    ]


@dataclass(frozen=True, kw_only=True)
class NamedFile:
    """A file that an entry of [[recordings]] names.

    Attributes
    ----------
    place : of the entry.
    name : for tables.
    file, record, layout : where the recording is, and what the file does not say of itself.
    """

    place: int
    name: str
    file: Path
    record: str | None
    layout: FileLayout


def named_files(said: StudyFile, path: Path) -> Iterator[NamedFile]:
    """Yield the files of a study, those of patterns one by one.

    Raises
    ------
    StudyError
        If an entry names none, or a record of several.
    FileError
        If one is not there.
    """
    for place, entry in enumerate(said.recordings):
        where = f"{path}: recordings.{place}"
        with naming(path, f"recordings.{place}"):
            layout = FileLayout(
                names=tuple(entry.columns or ()), rate_hz=entry.rate_hz, topic=entry.topic
            )
        for name, file in _files(entry, path.parent, where).items():
            yield NamedFile(place=place, name=name, file=file, record=entry.record, layout=layout)


def columns_of(said: StudyFile, path: Path) -> dict[str, Column]:
    """Return the mapping of columns, ours -> theirs, those of wrench sensors with it.

    Raises
    ------
    StudyError
        If a name or a scale is none.
    """
    with naming(path, "columns"):
        return {
            ours: Column(theirs, 1.0) if isinstance(theirs, str) else Column(**theirs.model_dump())
            for ours, theirs in said.columns.items()
        }


def _files(entry: RecordingEntry, folder: Path, where: str) -> dict[str, Path]:
    """Name of each file that an entry names -> where it is."""
    patterns = [entry.file] if isinstance(entry.file, str) else entry.file
    found: dict[str, Path] = {}
    for pattern in patterns:
        found |= find_all(pattern, folder)
    if not found:
        raise StudyError("file = [] names no file", where, "name at least one")
    if entry.record is not None and len(found) > 1:
        what = f"record = {entry.record!r} is of one file, and {len(found)} are named"
        raise StudyError(what, where, "write an entry for each file")
    return found
