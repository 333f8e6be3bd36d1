"""Wrench sensors in files: six columns a sensor, beside the positions of the joints."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynident.recording.formats.column_names import Column, locate
from dynident.recording.formats.column_table import FileLayout
from dynident.recording.formats.open_table import DEFAULT_LAYOUT, open_table
from dynident.recording.formats.read import named_otherwise
from dynident.recording.formats.recorded import Wanted, recorded
from dynident.recording.recording import Recording

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
"""Force (N) and torque (N m) along the axes of the sensor: `wrench.<frame>.fx` and so on."""
_OURS = re.compile(r"wrench\.(?P<frame>.+)\.(?:fx|fy|fz|tx|ty|tz)")


@dataclass(frozen=True, eq=False, kw_only=True)
class WrenchColumns:
    """Which sensor is meant, and under which names a file has its columns.

    Attributes
    ----------
    frame : the link of the description whose frame the wrench is stated in.
    joints : of the robot, whose positions are read.
    columns : ours -> theirs, for files with other names or units.
    """

    frame: str
    joints: tuple[str, ...]
    columns: Mapping[str, Column | str]

    @property
    def names(self) -> tuple[str, ...]:
        """Our six names."""
        return tuple(f"wrench.{self.frame}.{component}" for component in COMPONENTS)


def frame_of(column: str) -> str:
    """Return the frame of the sensor that one of our columns is of; empty for other columns."""
    found = _OURS.fullmatch(column)
    return found["frame"] if found else ""


def frames_in(names: Sequence[str]) -> tuple[str, ...]:
    """Return the frames of the sensors that columns are of, in their order."""
    return tuple(dict.fromkeys(frame for name in names if (frame := frame_of(name))))


def sensed_frames(
    path: str | Path, record: str | None = None, *, layout: FileLayout = DEFAULT_LAYOUT
) -> tuple[str, ...]:
    """Return the frames of the sensors whose columns a file holds under our names.

    Parameters
    ----------
    path, record, layout : as of `read`.

    Raises
    ------
    DynidentError
        If the file cannot be read.
    """
    return frames_in(open_table(Path(path), record, layout=layout).names)


def read_wrench(
    path: str | Path,
    wanted: WrenchColumns,
    record: str | None = None,
    *,
    layout: FileLayout = DEFAULT_LAYOUT,
    sound_in: tuple[float, float] | None = None,
) -> Recording:
    """Read the motion of a robot and what a wrench sensor on it records; no torques of joints.

    Parameters
    ----------
    path, record, layout, sound_in : as of `read`.
    wanted : the sensor, and names of columns.

    Returns
    -------
    Recording
        Of the robot's joints and six more, `wrench.<frame>.fx` and so on, which stand still: the
        wrench is their torque, as that of three sliding and three turning joints would be. Torques
        of the robot's own joints are zero.

    Raises
    ------
    DynidentError
        As `read`.
    """
    path = Path(path)
    table = open_table(path, record, layout=layout)
    joints, names = wanted.joints, wanted.names
    mapping = named_otherwise(table, joints, wanted.columns, layout)
    located = locate(table, ["t", *(f"q.{joint}" for joint in joints), *names], mapping)

    def signals(part: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        q = np.column_stack([part[f"q.{joint}"] for joint in joints])
        wrench = np.column_stack([part[name] for name in names])
        tau = np.hstack([np.zeros_like(q), wrench])
        return {"t": part["t"], "q": np.hstack([q, np.zeros_like(wrench)]), "tau": tau}

    return recorded(
        table,
        Wanted(
            columns=located,
            signals=signals,
            joints=(*joints, *names),
            path=path,
            record=record or "",
        ),
        sound_in,
    )
