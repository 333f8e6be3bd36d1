"""A designed recording read back from its folder: what it settles, and its motion."""

from __future__ import annotations

import hashlib
from pathlib import Path

from pydantic import Field

from dynident import files
from dynident.closed_loop import BSpline, Fourier, Trajectory
from dynident.errors import DynidentError, StudyError
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.file_groups import folder_of, groups_below, in_group
from dynident.settings import Duration, SettingsTable, read_toml

DESIGN, MOTION_PAGE = "design.toml", "motion.html"


class DesignFile(SettingsTable):
    """A file `design.toml`, which stands beside the reference that is to be followed."""

    sentence: str
    """What the recording is worth, in plain words."""
    study: str = ""
    """SHA-256 of the study that it was designed for, as its text was."""
    motion: str = ""
    """SHA-256 of `motion.html`; empty where there is none."""
    repeat: int = Field(ge=1)
    """How often the motion is to be followed."""
    duration: Duration
    """Of one repetition."""
    load: float = Field(default=0.0, ge=0)
    """What the last link carries, kg."""
    joints: list[str]
    """Their names, in the order of the coefficients."""
    centre: list[float] = Field(default_factory=list)
    """Of a Fourier series: of each joint, rad or m."""
    sine: list[list[float]] = Field(default_factory=list)
    """Coefficients of each joint, rad or m."""
    cosine: list[list[float]] = Field(default_factory=list)
    """Likewise."""
    points: list[list[float]] = Field(default_factory=list)
    """Of a B-spline, in the place of a series: a row for each joint, rad or m."""

    @property
    def trajectory(self) -> Trajectory:
        """One repetition."""
        if self.points:
            return BSpline(self.duration, self.points)  # type: ignore[arg-type]
        return Fourier(self.duration, self.centre, self.sine, self.cosine)  # type: ignore[arg-type]


def design_file(design: RecordingDesign, study: str, motion: str = "") -> DesignFile:
    """Return what is written of a design.

    Parameters
    ----------
    design : of `dynident.experiment_design.design`.
    study : digest of the study that it is for; empty where there is none.
    motion : page that shows it; likewise.
    """
    return DesignFile(
        sentence=design.sentence,
        study=study,
        motion=_digest(motion.encode()) if motion else "",
        repeat=design.task.repeat,
        duration=design.task.duration,
        load=design.task.load,
        joints=list(design.model.robot.names),
        **design.trajectory.coefficients,
    )


def _digest(page: bytes) -> str:
    return hashlib.sha256(page).hexdigest()


def motion_page(folder: Path) -> bytes | None:
    """Return the page that shows the motion of a design; none where it is of another motion.

    Parameters
    ----------
    folder : that `dynident.experiment_design.design_files.write_design` wrote.
    """
    try:
        page = files.read_bytes(in_group(folder, MOTION_PAGE))
        told = read_toml(in_group(folder, DESIGN), DesignFile)
    except DynidentError:
        return None
    return page if _digest(page) == told.motion else None


def folders_with_designs(folder: Path) -> tuple[Path, ...]:
    """Return the folders in a folder that hold a designed recording, the newest first."""
    try:
        found = {folder_of(one): one.stat().st_mtime for one in groups_below(folder, DESIGN)}
    except OSError:  # one that goes meanwhile, or may not be looked at
        return ()
    return tuple(sorted(found, key=lambda one: (-found[one], one.name)))


def read_design(folder: Path, joints: tuple[str, ...]) -> DesignFile:
    """Read a designed recording of a robot.

    Parameters
    ----------
    folder : that `dynident.experiment_design.design_files.write_design` wrote.
    joints : names of the robot's joints.

    Raises
    ------
    DynidentError
        If the file cannot be read, is none of a design, or one of another robot.
    """
    path = in_group(folder, DESIGN)
    found = read_toml(path, DesignFile)
    if tuple(found.joints) != joints:
        raise StudyError("is the design of another robot", str(path), "design one for this study")
    try:
        of = found.trajectory.n
    except (DynidentError, ValueError) as error:
        raise StudyError(f"has no motion: {error}", str(path)) from None
    if of != len(joints):
        raise StudyError(f"has a motion of {of} joints, not {len(joints)}", str(path))
    return found
