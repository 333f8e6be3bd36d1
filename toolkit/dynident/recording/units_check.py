"""Whether the numbers look like SI units: warnings, never errors."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from dynident.errors import DynidentWarning
from dynident.recording.recording import Recording

LONGEST_STEP = 0.25
"""s between samples beyond which the time stamps are rather milliseconds."""
WIDEST_TURN = 8 * np.pi
"""rad that a revolute joint travels beyond which its position is rather in degrees."""
LONGEST_STROKE = 20.0
"""m that a prismatic joint travels beyond which its position is rather in mm."""
HOTTEST = 200.0
"""Degrees Celsius of a motor beyond which its temperature is rather in kelvin."""


def warn_of_units(recording: Recording, kinds: Sequence[str] | None = None) -> None:
    """Warn of time stamps, positions and velocities that do not look like SI units.

    Parameters
    ----------
    recording : to look at.
    kinds : "revolute" or "prismatic" for each joint; without them positions are not judged.

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
        warnings.warn(f"{where}: {oddity} If so, {remedy}", DynidentWarning, stacklevel=3)


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
            yield name, f"{turns}: is the position in degrees?"
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
