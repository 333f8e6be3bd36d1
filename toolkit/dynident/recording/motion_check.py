"""Whether recordings show anything at all: joints that move, torques that are not zero."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from dynident.errors import DynidentWarning, RecordingError
from dynident.recording.masks import within
from dynident.recording.recording import Recording

LEAST_TRAVEL = {"revolute": 1e-3, "prismatic": 1e-4}
"""rad and m below which a joint, over all recordings, counts as standing still."""


def require_torque(recordings: Sequence[Recording]) -> None:
    """Refuse recordings without any torque.

    Raises
    ------
    RecordingError
        If every torque of every recording is zero.
    """
    if recordings and not any(np.any(recording.tau) for recording in recordings):
        where = recordings[0].where
        raise RecordingError("the torque is zero throughout", where, "is it the right column?")


def warn_of_missing_torque(recordings: Sequence[Recording]) -> None:
    """Warn of single joints whose torque is zero in every recording.

    Warns
    -----
    DynidentWarning
        Naming the joints.
    """
    some = np.any([np.any(recording.tau != 0, axis=0) for recording in recordings], axis=0)
    missing = [name for name, there in zip(recordings[0].joints, some, strict=True) if not there]
    if missing:
        what = f"{recordings[0].where}: the torque of {', '.join(missing)} is zero throughout"
        warnings.warn(f"{what}. Is it the right column?", DynidentWarning, stacklevel=3)


def require_motion(recordings: Sequence[Recording], kinds: Sequence[str]) -> None:
    """Refuse recordings of a robot at rest; warn of single joints at rest.

    A joint that stands elsewhere in another recording does move.

    Parameters
    ----------
    recordings : to be fitted, each within its window.
    kinds : "revolute" or "prismatic" for each joint.

    Raises
    ------
    RecordingError
        If no joint moves.

    Warns
    -----
    DynidentWarning
        Naming the joints that stand still, if others move.
    """
    lowest = np.min([_used(recording).min(axis=0) for recording in recordings], axis=0)
    highest = np.max([_used(recording).max(axis=0) for recording in recordings], axis=0)
    travel = highest - lowest
    still = [
        name
        for name, kind, moved in zip(recordings[0].joints, kinds, travel, strict=True)
        if moved < LEAST_TRAVEL[kind]
    ]
    where = recordings[0].where
    if len(still) == len(travel):
        remedy = "record a motion that excites every joint"
        raise RecordingError("the robot does not move", where, remedy)
    if still:
        names = ", ".join(still)
        what = f"{where}: {names} stands still in every training recording, so that its friction"
        warnings.warn(
            f"{what} and part of the inertias cannot be identified. Record a motion of every joint",
            DynidentWarning,
            stacklevel=3,
        )


def _used(recording: Recording) -> np.ndarray:
    """Positions within the recording's window, (T, n)."""
    if recording.window is None:
        return recording.q
    return recording.q[within(recording.t, *recording.window, recording.where)]
