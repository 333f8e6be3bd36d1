"""A diagnosis of currents: torques as they were recorded, effects in N m."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.recorded_units import in_recorded_units
from dynident.fitting.drive_gains import DriveGains, GainProblem, fit_drive_gains
from dynident.recording import Dataset
from study_files import recording
from synthetic import arm

GAINS = np.array([20.0, -4.0])


@pytest.fixture(scope="module")
def found() -> tuple[Diagnosis, DriveGains]:
    model = di.Model(arm()) + "viscous_friction"
    data = Dataset((recording(1).replace(period=8.0),))
    known = dict(zip(arm().names, GAINS, strict=True))
    amperes = Dataset((data.recordings[0].replace(tau=data.recordings[0].tau / GAINS),))
    return di.diagnose(model, data, most=0), fit_drive_gains(GainProblem(model, amperes, known))


@pytest.mark.slow
def test_joints_and_traces_are_in_amperes(found: tuple[Diagnosis, DriveGains]) -> None:
    plain, drives = found
    shown = in_recorded_units(plain, drives)
    for before, after, gain in zip(plain.joints, shown.joints, GAINS, strict=True):
        assert after.torque_unit == "A"
        assert after.torque_rms == pytest.approx(before.torque_rms / abs(gain))
        assert after.error_before == before.error_before
        assert after.noise_share == pytest.approx(before.noise_share)
    gain_of = dict(zip(arm().names, GAINS, strict=True))
    for before, after in zip(plain.traces, shown.traces, strict=True):
        np.testing.assert_allclose(after.measured * gain_of[before.joint], before.measured)
    for before, after in zip(plain.maps, shown.maps, strict=True):
        assert np.all(after.band[np.isfinite(after.band)] >= 0)
        sizes = np.abs(after.after * gain_of[before.joint])
        np.testing.assert_allclose(sizes, np.abs(before.after))
    assert [one["torque_unit"] for one in shown.to_dict()["joints"]] == ["A", "A"]


def test_newton_metres_stay(found: tuple[Diagnosis, DriveGains]) -> None:
    plain, drives = found
    assert in_recorded_units(plain, None) is plain
    assert in_recorded_units(plain, replace(drives, unit="N m")) is plain
