"""Recordings belong to a robot's joints by their names, not by their places."""

from __future__ import annotations

import numpy as np
import pytest

import dynident as di
from dynident.errors import FitError, RecordingError
from dynident.recording import Dataset, Filter
from dynident.recording.dataset import Noise
from synthetic import ARM, arm, synthetic, true_values

MODEL = di.Model(arm()) + "viscous_friction" + "coulomb_friction"
TRUTH = true_values(MODEL, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.5, Fc__elbow=0.6)
SETTINGS = Filter(position_cutoff_hz=40.0, cutoff_hz=18.0, rate_hz=50.0)


def recorded(seed: int, noise: Noise | None = None) -> Dataset:
    return Dataset((synthetic(MODEL, TRUTH, seed, rate_hz=250.0, torque_std=0.1),), SETTINGS, noise)


def turned(data: Dataset) -> Dataset:
    recordings = tuple(one.select(one.joints[::-1]) for one in data.recordings)
    noise = data.noise and Noise(data.noise.position_std[::-1], data.noise.torque_std[::-1])
    return Dataset(recordings, data.filter, noise)


@pytest.mark.slow
def test_the_order_of_a_recordings_joints_changes_nothing() -> None:
    noise = Noise(np.array([1e-5, 2e-5]), np.array([0.1, 0.2]))
    train, test = recorded(0, noise), recorded(1, noise)
    assert turned(train).recordings[0].joints == ("elbow", "shoulder")
    fit, other = di.fit(MODEL, train), di.fit(MODEL, turned(train))
    np.testing.assert_array_equal(fit.values, other.values)
    np.testing.assert_array_equal(fit.sigma, other.sigma)
    errors = [di.compare(fit, data).results[0].joint_errors for data in (test, turned(test))]
    np.testing.assert_array_equal(errors[0], errors[1])
    found = [
        di.diagnose(MODEL, *data, most=0, propose="never").test_error
        for data in ((train, test), (turned(train), turned(test)))
    ]
    assert found[0] == found[1]
    back = turned(train).of_joints(MODEL.robot.names).noise
    assert back is not None
    np.testing.assert_array_equal(back.torque_std, [0.1, 0.2])


def test_a_joint_beside_those_of_the_robot_is_left_out() -> None:
    data = recorded(2)
    one = data.recordings[0]
    more = one.replace(
        joints=("gripper", *one.joints),
        **{
            name: np.column_stack([0 * x[:, 0], x])
            for name in ("q", "v", "a", "tau")
            if (x := getattr(one, name)) is not None
        },
    )
    np.testing.assert_array_equal(di.fit(MODEL, more).values, di.fit(MODEL, one).values)


@pytest.mark.parametrize(
    "use",
    [di.fit, lambda m, d: di.diagnose(m, d), lambda m, d: di.compare(di.fit(m, recorded(4)), d)],
)
def test_joints_of_other_names_are_refused(use) -> None:
    data = recorded(3)
    strange = Dataset((data.recordings[0].replace(joints=("axis1", "elbow")),), SETTINGS)
    with pytest.raises(
        RecordingError,
        match=r"no joint 'shoulder', which the robot has; joints: axis1, elbow.*replace\(joints",
    ):
        use(MODEL, strange)


@pytest.mark.slow
def test_a_single_recording_is_data_enough() -> None:
    (train,), (test,) = recorded(5).recordings, recorded(6).recordings
    fit = di.fit(MODEL, train)
    assert (
        di.compare(fit, test).results[0].error == di.compare(fit, Dataset((test,))).results[0].error
    )
    found = di.diagnose(fit, train, test, most=0, propose="never")
    assert (
        found.test_error
        == di.diagnose(
            MODEL, Dataset((train,)), Dataset((test,)), most=0, propose="never"
        ).test_error
    )


def test_models_whose_joints_differ_are_not_compared() -> None:
    data = recorded(7)
    fit = di.fit(MODEL, data)
    turned_robot = di.Robot.from_text(ARM, joints=["elbow", "shoulder"])
    other = di.fit(di.Model(turned_robot) + "viscous_friction", data)
    with pytest.raises(FitError, match="joints elbow, shoulder where another model has shoulder"):
        di.compare({"a": fit, "b": other}, data)
