"""What the numbers of a recording look like: SI units, an encoder's steps, a motion, a torque.

Plausible ranges of robots, not units that are computed with: a library of units has no part here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.errors import RecordingError, warn
from dynident.recording.masks import within
from dynident.recording.recording import Recording
from dynident.tables import percent

LONGEST_STEP = 0.25
"""s between samples beyond which the time stamps are rather milliseconds."""
WIDEST_TURN = 8 * np.pi
"""rad that a revolute joint travels beyond which its position is rather in degrees."""
LONGEST_STROKE = 20.0
"""m that a prismatic joint travels beyond which its position is rather in mm."""
HOTTEST = 200.0
"""Degrees Celsius of a motor beyond which its temperature is rather in kelvin."""
LEAST_TRAVEL = {"revolute": 1e-3, "prismatic": 1e-4}
"""rad and m below which a joint, over all recordings, counts as standing still."""
_AT_A_LIMIT = 0.005
"""Share of samples at one and the same torque from which that is a limit."""
_OFTEN = 4.0
"""Times as many samples as at the next value that are at a limit."""
_WHOLE = 0.05
"""Steps by which a position may miss a whole number of them."""


def warn_of_units(recording: Recording, kinds: Sequence[str] | None = None) -> None:
    """Warn of time stamps, positions and velocities that do not look like SI units.

    Parameters
    ----------
    recording : to look at.
    kinds : "revolute", "continuous" (which may turn as far as it likes) or "prismatic" for each
        joint; without them positions are not judged.

    Warns
    -----
    DynidentWarning
        For each oddity, naming the column and the likely unit.
    """
    found = list(_oddities(recording, kinds))
    # A velocity that does not fit an odd clock or position says nothing new.
    for column, oddity in found or _velocity_oddities(recording):
        where = f"{recording.where}, column {column}"
        remedy = "convert it, or give its scale in the column mapping"
        if column.startswith("temperature."):
            remedy = "subtract 273.15"
        warn(f"{where}: {oddity} If so, {remedy}")


def _oddities(recording: Recording, kinds: Sequence[str] | None):
    step = 1 / recording.rate_hz
    if step > LONGEST_STEP:
        unit = "ms" if step < 250 else "us" if step < 250e3 else "ns"
        yield "t", f"{step:g} s between samples: are the time stamps in {unit}?"
    for joint, kind in enumerate(kinds or ()):
        name = f"q.{recording.joints[joint]}"
        travel = float(np.ptp(recording.q[:, joint]))
        if kind == "revolute" and travel > WIDEST_TURN:
            turns = f"travels {travel:.4g} rad ({travel / (2 * np.pi):.3g} turns)"
            yield name, f"{turns}: is the position in degrees, or that of a motor before its gear?"
        if kind == "prismatic" and travel > LONGEST_STROKE:
            yield name, f"travels {travel:.4g} m: is the position in mm?"
    highest = [] if recording.temperature is None else recording.temperature.max(axis=0)
    for name, hottest in zip(recording.joints, highest, strict=False):
        if hottest > HOTTEST:
            yield f"temperature.{name}", f"is up to {hottest:.4g}: is it in kelvin?"


def _velocity_oddities(recording: Recording):
    """Recorded velocity against the derivative of the position, where the two clearly belong."""
    if recording.v is None or recording.samples < 5:
        return
    slope = np.gradient(recording.q, recording.t, axis=0)
    for joint, name in enumerate(recording.joints):
        dq, v = slope[:, joint], recording.v[:, joint]
        power, cross = float(dq @ dq), float(dq @ v)
        if power == 0 or cross**2 < 0.8 * power * float(v @ v):
            continue
        ratio = cross / power
        if ratio < 0:
            yield f"v.{name}", "has the opposite sign of the derivative of q: is its sign wrong?"
        elif not 0.5 < ratio < 2:
            yield f"v.{name}", f"is {ratio:.3g} times the derivative of q: are the units different?"


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
        warn(f"{what}. Is it the right column?")


def warn_of_limited_torque(recordings: Sequence[Recording]) -> None:
    """Warn of torques that end at a value at which they stay while the joint moves.

    A drive that gives no more than its limit is recorded rightly; a log that holds no more is not,
    and no model predicts it.

    Warns
    -----
    DynidentWarning
        Naming the joints, the values and the largest share of samples at them.
    """
    found: dict[str, tuple[float, float]] = {}
    for sign in (1.0, -1.0):
        furthest = np.max if sign > 0 else np.min
        ends = sign * furthest([furthest(one.tau, axis=0) for one in recordings], axis=0)
        for joint, name in enumerate(recordings[0].joints):
            share = _share_at(recordings, joint, sign, float(ends[joint]))
            if share > max(_AT_A_LIMIT, found.get(name, (0.0, 0.0))[1]):
                found[name] = sign * float(ends[joint]), share
    for name, (value, share) in found.items():
        what = (
            f"{recordings[0].where}: tau.{name} is {value:.4g} in {percent(share)} of the samples, "
            "over all recordings, and never beyond, while the joint moves: is that the limit of "
            "the drive, or of the log, or a steady motion? What a log cuts off no model predicts: "
            "if so, record within its range, or leave these times out by a window"
        )
        warn(what)


def _share_at(recordings: Sequence[Recording], joint: int, sign: float, end: float) -> float:
    """Share of samples at a value where the torque stays, moving; zero if it only passes there."""
    if end <= 0.0:
        return 0.0  # nothing is cut off at no torque
    at = staying = below = samples = 0
    second = max(
        float(np.max(x[x < end], initial=-np.inf)) for x in _signed(recordings, joint, sign)
    )
    for one, tau in zip(recordings, _signed(recordings, joint, sign), strict=True):
        here, moves = tau == end, np.diff(one.q[:, joint], prepend=np.nan) != 0.0
        at += int(np.count_nonzero(here))
        staying += int(np.count_nonzero(here & moves & np.roll(here, 1)))
        below += int(np.count_nonzero(tau == second))
        samples += len(tau)
    # Of a torque in coarse steps the last one is seldom reached more often than the one before.
    return at / samples if staying > 0.5 * at and at > _OFTEN * below else 0.0


def _signed(recordings: Sequence[Recording], joint: int, sign: float) -> list[np.ndarray]:
    return [sign * one.tau[:, joint] for one in recordings]


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
        warn(
            f"{what} and part of the inertias cannot be identified. Record a motion of every joint"
        )


def _used(recording: Recording) -> np.ndarray:
    """Positions within the recording's window, (T, n)."""
    if recording.window is None:
        return recording.q
    return recording.q[within(recording.t, *recording.window, recording.where)]


def resolution(q: np.ndarray) -> np.ndarray:
    """Steps on whose multiples recorded positions lie.

    Parameters
    ----------
    q : (T, n) rad or m.

    Returns
    -------
    (n,) rad or m; zero at joints whose positions lie on no lattice.
    """
    return np.array([_step(column) for column in np.asarray(q, dtype=float).T])


def _step(x: np.ndarray) -> float:
    seen = np.unique(x)
    gaps = np.diff(seen)
    gaps = gaps[gaps > 1e-9 * max(float(np.ptp(seen)), 1e-300)]
    if len(gaps) == 0:
        return 0.0
    # The smallest gap is rounded as numbers are; the mean over all gaps is not.
    steps = np.round(gaps / gaps.min())
    step = float(gaps.sum() / steps.sum())
    count = (seen - seen[0]) / step
    return step if np.all(np.abs(count - np.round(count)) < _WHOLE) else 0.0
