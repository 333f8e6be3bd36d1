"""Recordings of wrench sensors that a study names; they need no torques of joints."""

from __future__ import annotations

from pathlib import Path

from dynident.fitting.loads import Load, loads_of
from dynident.fitting.wrench_sensor import WrenchProblem
from dynident.recording import (
    Dataset,
    Recording,
    WrenchColumns,
    counted_window,
    frames_in,
    read_wrench,
    sensed_frames,
)
from dynident.settings import read_toml
from dynident.study.named_files import (
    NamedFile,
    columns_of,
    filter_of,
    named_files,
    naming,
    robot_of,
)
from dynident.study.study_file import StudyFile

_PAYLOAD = "payload"


def load_wrenches(path: str | Path) -> tuple[WrenchProblem, ...]:
    """Read the training recordings of the wrench sensors of a study.

    A sensor is named by its columns, `wrench.<link>.fx` to `wrench.<link>.tz`, in the files or in
    [columns]. Torques of joints are not read, and need not be there.

    Returns
    -------
    A problem for each sensor; none where the study has no such columns.

    Raises
    ------
    StudyError
        If the file is no study, or a sensor is at no link behind the last joint.
    DynidentError
        If the robot or a recording is unusable.
    """
    path = Path(path)
    said = read_toml(path, StudyFile)
    trained = [one for one in named_files(said, path) if said.recordings[one.place].use == "train"]
    columns = columns_of(said, path)
    mapped = frames_in(list(columns))
    frames_of = {one: tuple(dict.fromkeys((*mapped, *_own_frames(one)))) for one in trained}
    frames = tuple(dict.fromkeys(frame for some in frames_of.values() for frame in some))
    if not frames:
        return ()
    robot = robot_of(said, path)
    carried, loads = loads_of((one.payload for one in said.recordings), said.loads, str(path))
    if not loads and any(one.payload is True for one in said.recordings):
        # A load under study has no name of its own.
        carried = tuple(_PAYLOAD if one.payload is True else "" for one in said.recordings)
        loads = (Load(name=_PAYLOAD),)
    motion = {ours: one for ours, one in columns.items() if ours == "t" or ours.startswith("q.")}
    problems = []
    for frame in frames:
        own = {ours: one for ours, one in columns.items() if frames_in([ours]) == (frame,)}
        wanted = WrenchColumns(frame=frame, joints=robot.names, columns=motion | own)
        recordings = []
        for one in trained:
            if frame not in frames_of[one]:
                continue
            entry = said.recordings[one.place]
            recording = _read(one, wanted, entry.window)
            recordings.append(
                recording.replace(
                    name=entry.record or one.name,
                    period=entry.period,
                    window=counted_window(entry.window, recording.provenance.began),
                    load=carried[one.place],
                    number=len(recordings) + 1,
                )
            )
        with naming(path, "filter"):
            settings = filter_of(said.filter, recordings)
        used = {one.load for one in recordings}
        some = tuple(load for load in loads if load.name in used)
        problems.append(WrenchProblem(robot, frame, Dataset(tuple(recordings), settings), some))
    return tuple(problems)


def _own_frames(one: NamedFile) -> tuple[str, ...]:
    return sensed_frames(one.file, one.record, layout=one.layout)


def _read(one: NamedFile, wanted: WrenchColumns, window: tuple[float, float] | None) -> Recording:
    return read_wrench(one.file, wanted, one.record, layout=one.layout, sound_in=window)
