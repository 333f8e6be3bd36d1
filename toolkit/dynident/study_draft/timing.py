"""When things happen in recordings: their clock, their repetitions, and which of them are to judge.

Standing still at either end needs no line in a study: `recording.usable` leaves it out by itself.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from dynident.recording import Recording, as_points, turning_round
from dynident.recording.plausibility import LONGEST_STEP
from dynident.recording.repetition import repeats_after, shift_mismatch

_CLOCKS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))
_FASTEST = 2e4  # Hz that a robot is sampled at
_REPEATS = 0.05  # of the motion that two repetitions may differ by
_DERIVATIVE = 0.9  # correlation of a speed with the difference of its position
_NEAR = 0.2  # of a ratio of units, by which it may miss one
_UNIFORM = 0.5  # steps of a clock over the usual one, of nine in ten
_WHOLE = 0.3  # samples by which a period is known
_EVERY = 4  # of so many recordings one is held out
_TRAIN, _TEST = ("train", "fit", "ident", "exc"), ("test", "val", "check")


def is_clock(x: np.ndarray) -> bool:
    """Return whether numbers go forward, nine in ten of them by a like step.

    Parameters
    ----------
    x : (T,) of a column.
    """
    steps = np.diff(x)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if not (usual > 0 and np.all(steps > 0)):
        return False
    return bool(np.quantile(np.abs(steps - usual), 0.9) < _UNIFORM * usual)


def clock_scale(t: np.ndarray) -> tuple[float, str]:
    """Seconds per unit of a clock, and the unit's name, from its usual step.

    Parameters
    ----------
    t : (T,) stamps.

    Returns
    -------
    The largest unit in which samples are neither slower nor faster than those of any robot.
    """
    step = float(np.median(np.diff(t)))
    for scale, unit in _CLOCKS:
        if step * scale <= LONGEST_STEP:
            return (scale, unit) if step * scale >= 1 / _FASTEST else (1.0, "s")
    return 1.0, "s"


def clock_from_speeds(
    t: np.ndarray, q: Sequence[np.ndarray], v: Sequence[np.ndarray]
) -> tuple[float, str] | None:
    """Seconds per unit of a clock, and the unit's name, from recorded speeds.

    Parameters
    ----------
    t : (T,) stamps.
    q, v : columns (T,) of positions and speeds, in the same units of length or angle.

    Returns
    -------
    None where no speed is the derivative of its position.
    """
    ratios = []
    for position, speed in zip(q, v, strict=False):
        change = np.gradient(position, t)
        both = np.linalg.norm(change) * np.linalg.norm(speed)
        if both and change @ speed > _DERIVATIVE * both:
            ratios.append(float(change @ change / (change @ speed)))
    if not ratios:
        return None
    ratio = float(np.median(ratios))
    for scale, unit in _CLOCKS:
        if abs(ratio / scale - 1) < _NEAR:
            return scale, unit
    step = float(np.median(np.diff(t)))
    if np.all(np.diff(t) == step):
        rate = float(f"{1 / (ratio * step):.2g}")
        return 1 / (rate * step), f"samples at {rate:g} Hz"
    return None


def period_of(recording: Recording) -> float | None:
    """Time after which the positions of a recording repeat, s; None where they do not.

    Parameters
    ----------
    recording : on any clock; jitter counts as none.
    """
    positions = as_points(recording.q, turning_round(recording))
    moves = np.ptp(positions, axis=0) > 0
    if recording.samples < 40 or not moves.any():
        return None
    q = positions[:, moves] - positions[:, moves].mean(axis=0)
    q = q / np.std(q, axis=0)
    lag = repeats_after(q, recording.samples // 2 + 1)
    if lag is None or shift_mismatch(q, lag) > _REPEATS:
        return None
    period = lag / recording.rate_hz
    # References are made of round times: of the times that the samples cannot tell, the roundest.
    round_ones = (float(f"{period:.{digits}g}") for digits in range(1, 9))
    return next((x for x in round_ones if abs(x - period) * recording.rate_hz < _WHOLE), period)


def uses_of(names: Sequence[str], folders: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Which recordings are to fit and which to judge by, and why.

    Parameters
    ----------
    names : of files or records.
    folders : of the files, from the folder that holds all of them.

    Returns
    -------
    "train" or "test" for each; at least one is "train".
    """
    by_folders = [_told(name) or _told(folder) for name, folder in zip(names, folders, strict=True)]
    ways = (([_told(name) for name in names], "files"), (by_folders, "folders"))
    for told, what in ways:
        if "train" in told and "test" in told:
            return tuple(one or "train" for one in told), f"as the names of the {what} say"
    count = len(names)
    if count == 1:
        return ("train",), "there is one: blocks of its time are held out to judge by"
    if count < _EVERY:
        return (*("train",) * (count - 1), "test"), "the last one is held out to judge by"
    uses = tuple("test" if k % _EVERY == _EVERY - 1 else "train" for k in range(count))
    return uses, "every fourth one is held out to judge by"


def _told(name: str) -> str:
    words = re.findall(r"[a-z]+", name.lower())
    for use, stems in (("train", _TRAIN), ("test", _TEST)):
        if any(word.startswith(stem) for word in words for stem in stems):
            return use
    return ""
