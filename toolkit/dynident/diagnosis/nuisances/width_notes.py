"""What is said of friction widths that are other than the study's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.nuisances.friction_width import WidthProfile
from dynident.diagnosis.nuisances.sticking import left_out_at
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.fitting.reversals.standing_joints import width_advice
from dynident.model import dry_joints
from dynident.tables import number

_HARDLY = 0.1
"""Change of a width, as a logarithm, below which nobody need write another: the jitter of a drive
makes as much, and the data tell it to a part of that."""


@dataclass(frozen=True, kw_only=True)
class FoundWidths:
    """Friction widths that are other than the given model's.

    Attributes
    ----------
    notes : what is said of them.
    to_state : of every joint, rad/s or m/s, as a study is to have them; empty where its own will
        do, or the data do not tell others.
    """

    notes: tuple[str, ...]
    to_state: Mapping[str, float]


def found_widths(evidence: Evidence, fitted: EvidenceFit) -> FoundWidths:
    """Joints whose dry friction has another width than the given model's, in plain words."""
    model, given = fitted.model, evidence.model.friction_widths
    sticking, moving, standing, wider = left_out_at(evidence), [], [], False
    stated = dict(zip(model.robot.names, given, strict=True))
    found: dict[str, float] = {}
    for joint, unit in zip(model.robot.names, model.robot.units, strict=True):
        profile = WidthProfile(evidence, fitted, joint)
        if joint not in dry_joints(model) or abs(np.log(profile.width / stated[joint])) < _HARDLY:
            continue
        if f"presliding@{joint}" in model.slices:
            continue  # presliding tells how friction reverses: the width is of what is beside it
        low, high = _interval(profile, stated[joint])
        says = f"the model has {number(stated[joint], 2)}"
        known = f"at {joint} {_in_words(profile.width, (low, high), f'{unit}/s', says)}"
        sticks = joint in sticking
        (standing if sticks else moving).append(known)
        wider = wider or (profile.width > stated[joint] and not sticks)
        # Where stops are left out "at most" is enough: beyond them friction has reversed.
        if np.isfinite(high) and (low > 0 or sticks):
            found[joint] = float(number(profile.width, 2))
    notes = []
    if moving:
        noise = ". Noise that a drive feeds into its joint widens it" if wider else ""
        notes.append(
            f"Friction width, over which dry friction reverses: {'; '.join(moving)}{noise}."
        )
    if standing:
        where = "; ".join(standing)
        notes.append(
            f"Friction width by the rows that count, stops left out: {where}. That is how friction "
            "looks in motion, and no finding of how sharply it reverses."
        )
    if not found:
        return FoundWidths(notes=tuple(notes), to_state={})
    widths = {joint: float(width) for joint, width in (stated | found).items()}
    notes[-1] += f" Fits take those of the model: for these {width_advice(widths)}"
    return FoundWidths(notes=tuple(notes), to_state=widths)


def _interval(profile: WidthProfile, stated: float) -> tuple[float, float]:
    """95 % interval of a width, from 0 or to infinity where the search for it ended."""
    own = profile.evidence.criteria.nuisances
    low, high = profile.interval()
    low = 0.0 if profile.width <= own.at_bound * own.narrowest_width * stated else low
    high = np.inf if profile.width >= own.widest_width * stated / own.at_bound else high
    return low, high


def _in_words(width: float, interval: tuple[float, float], unit: str, says: str) -> str:
    """What is known of a width."""
    low, high = interval
    if low > 0 and np.isfinite(high):
        digits = 2 if number(low, 2) != number(high, 2) else 3
        between = f"95 % interval {number(low, digits)} to {number(high, digits)}"
        return f"{number(width, digits)} {unit} ({between}; {says})"
    if low > 0:
        return f"at least {number(low, 2)} {unit} ({says})"
    if np.isfinite(high):
        return f"at most {number(high, 2)} {unit} ({says})"
    return f"hardly seen ({number(width, 2)} {unit} fits best; {says})"
