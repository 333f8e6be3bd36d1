"""Torques, residuals and noise of a diagnosis in the unit in which the drives record them.

Effects, laws and what could have been seen stay in N m: they are physics, not currents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.diagnosis.details import JointResult, Trace
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.switches import Switches
from dynident.errors import FitError, StudyError
from dynident.evidence.maps import SPECTRA, ResidualMap
from dynident.fitting.drive_gains import (
    DriveGains,
    GainProblem,
    fit_drive_gains,
    with_gain_errors,
)


def with_gains(
    diagnosis: Diagnosis, drives: DriveGains | None, problem: GainProblem | None
) -> Diagnosis:
    """Return a diagnosis with the gains and loads that it rests on, and with their errors.

    Gains that were found with the model as given carry what it lacks: with the effects added they
    are fitted anew, beside those that the diagnosis rests on.

    Parameters
    ----------
    diagnosis : of recordings that `in_newton_metres` made.
    drives : by which it did; None where nothing had to be found.
    problem : what `drives` solves.
    """
    if drives is None or problem is None:
        return diagnosis
    before = with_gain_errors(diagnosis.before, drives)
    same = diagnosis.after is diagnosis.before
    after = before if same else with_gain_errors(diagnosis.after, drives)
    return replace(
        diagnosis,
        drives=drives,
        drives_anew=_anew(diagnosis, drives, problem),
        before=before,
        after=after,
    )


def _anew(diagnosis: Diagnosis, drives: DriveGains, problem: GainProblem) -> DriveGains | None:
    """Gains and loads with the effects added; None where nothing was, or they cannot be told.

    A drive gain that was added makes up for gains that were found without the other effects: it is
    in those that are found with them.
    """
    after = diagnosis.after.model
    wider = replace(after, effects=tuple(one for one in after.effects if one.name != "drive_gain"))
    if wider.names == problem.model.names:
        return None
    try:
        return fit_drive_gains(replace(problem, model=wider), drives.unit)
    except (FitError, StudyError):  # such as a gain of its own that the search added
        return None


def made_up_for(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return drive gains among the effects added that stand for gains found without the others.

    Parameters
    ----------
    diagnosis : from `with_gains`.
    """
    drives = diagnosis.drives
    # Where all gains are given, one that is another is a finding.
    if drives is None or diagnosis.drives_anew is None or np.all(drives.given):
        return ()
    return tuple(x.effect.label for x in diagnosis.steps if x.effect.name == "drive_gain")


def begun_again(diagnosis: Diagnosis, labels: Sequence[str]) -> Diagnosis:
    """Return a diagnosis whose notes say that it began again with other gains.

    Parameters
    ----------
    diagnosis : by gains with the effects that were found first.
    labels : the drive gains that were among these.
    """
    said = (
        f"{' and '.join(labels)} made up for gains that were found without the other effects: with "
        "these in the model the gains were fitted anew, and the search was begun again."
    )
    return replace(diagnosis, notes=(*diagnosis.notes, said))


def in_recorded_units(diagnosis: Diagnosis, drives: DriveGains | None) -> Diagnosis:
    """Return a diagnosis whose torques, residuals and noise are in amperes or percent.

    Parameters
    ----------
    diagnosis : of recordings that `in_newton_metres` made.
    drives : by which it did; None, or in N m, and nothing changes.
    """
    if drives is None or drives.unit == "N m":
        return diagnosis
    gains = dict(zip(drives.joints, drives.gains, strict=True))
    unit = drives.unit

    def of_joint(one: JointResult) -> JointResult:
        size = abs(float(gains[one.name]))
        noise = None if one.noise_rms is None else one.noise_rms / size
        return replace(one, torque_unit=unit, torque_rms=one.torque_rms / size, noise_rms=noise)

    def of_map(one: ResidualMap) -> ResidualMap:
        gain = float(gains[one.joint])
        # An amplitude has no sign, and neither has the width of a band.
        spectrum = one.against in SPECTRA
        by = abs(gain) if spectrum else gain
        before, after, band = one.before / by, one.after / by, one.band / abs(gain)
        return replace(one, torque_unit=unit, before=before, after=after, band=band)

    def of_trace(one: Trace) -> Trace:
        parts = {name: getattr(one, name) / gains[one.joint] for name in _OF_TRACE}
        return replace(one, torque_unit=unit, **parts)

    def of_switches(one: Switches) -> Switches:
        by = np.array([gains[joint.name] for joint in diagnosis.joints])
        choices = tuple(replace(c, predicted=c.predicted / by) for c in one.choices)
        return replace(one, measured=one.measured / by, choices=choices)

    return replace(
        diagnosis,
        switches=None if diagnosis.switches is None else of_switches(diagnosis.switches),
        joints=tuple(map(of_joint, diagnosis.joints)),
        maps=tuple(map(of_map, diagnosis.maps)),
        traces=tuple(map(of_trace, diagnosis.traces)),
    )


_OF_TRACE = ("measured", "before", "after")
