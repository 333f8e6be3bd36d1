"""What errors of measured positions do to the torque, and that a diagnosis sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.criteria import DEFAULTS
from dynident.diagnosis.dependence.position_errors import position_error_columns
from dynident.diagnosis.dependence.residual_record import FittedBody, ResidualRecord
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from residuals import record
from study_files import true_model
from synthetic import ARM, arm, synthetic, true_values

SIZE = 1e-4
BODY = FittedBody(arm(), np.zeros(2))


def moved_by(one: ResidualRecord, joint: int, error, slope, bend) -> np.ndarray:
    """Torque (T, n) at the positions that a sensor reports, less that at the true ones."""
    q, v, a = one.q.copy(), one.v.copy(), one.a.copy()
    at, speed = one.q[:, joint], one.v[:, joint]
    q[:, joint] += SIZE * error(at)
    v[:, joint] += SIZE * slope(at) * speed
    a[:, joint] += SIZE * (bend(at) * speed**2 + slope(at) * one.a[:, joint])
    robot = arm()
    return robot.inverse_dynamics(q, v, a) - robot.inverse_dynamics(one.q, one.v, one.a)


ROUND = FittedBody(Robot.from_text(ARM.replace('"revolute"', '"continuous"')), np.zeros(2))


def test_the_error_of_a_sensor_is_the_same_after_each_turn_of_its_joint() -> None:
    one = record(1, {})
    q = one.q + 2.0 * one.t[:, None]
    records = (replace(one, q=q, v=one.v + 2.0, body=ROUND),)
    waves = [lambda q: np.sin(3 * q), lambda q: 3 * np.cos(3 * q), lambda q: -9 * np.sin(3 * q)]
    rows = np.arange(0, len(one.t), 7)
    torque = moved_by(records[0], 1, *waves)[rows, 1]
    columns = position_error_columns(records, rows, 1)
    q, v, a = (x[rows] for x in (records[0].q, records[0].v, records[0].a))
    known = np.column_stack([columns, ROUND.robot.regressor(q, v, a)[:, 1], a[:, [1]]])
    left = torque - known @ np.linalg.lstsq(known, torque, rcond=None)[0]
    assert np.linalg.norm(left) < 0.01 * np.linalg.norm(torque)


@pytest.mark.parametrize("sensor", [0, 1])
@pytest.mark.parametrize("joint", [0, 1])
def test_what_a_sensor_with_an_error_does_is_a_combination_of_the_columns(
    sensor: int, joint: int
) -> None:
    """An error of a wave over the range, which is no polynomial, at any of two joints."""
    records = tuple(replace(record(seed, {}), body=BODY) for seed in (1, 2))
    position = np.concatenate([one.q[:, sensor] for one in records])
    k = 2 * np.pi / np.ptp(position)
    made = [
        moved_by(
            one,
            sensor,
            lambda q: np.sin(k * q),
            lambda q: k * np.cos(k * q),
            lambda q: -(k**2) * np.sin(k * q),
        )
        for one in records
    ]
    rows = np.arange(0, sum(len(one.t) for one in records), 7)
    torque = np.concatenate(made)[rows, joint]
    columns = position_error_columns(records, rows, joint)
    # What inertial parameters would make of it the fit takes; a constant error is a joint zero.
    q, v, a = (np.concatenate([getattr(one, name) for one in records])[rows] for name in "qva")
    zero = arm().torque_derivatives(q, v, a).by_q[:, joint, sensor]
    inertial = np.column_stack([arm().regressor(q, v, a)[:, joint], a[:, joint]])
    columns = np.column_stack([columns, zero, inertial])
    left = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    assert np.linalg.norm(left) < 0.05 * np.linalg.norm(torque)


def test_joints_that_stand_still_and_robots_that_nobody_knows_have_none() -> None:
    one = record(3, {})
    rows = np.arange(len(one.t))
    assert position_error_columns((one,), rows, 0).shape == (len(rows), 0)
    still = [0.0, 1.0]
    one = replace(one, q=one.q * still, v=one.v * still, a=one.a * still)
    known = replace(one, body=BODY)
    both = replace(record(3, {}), body=BODY)
    columns = position_error_columns((known,), rows, 0)
    assert 0 < columns.shape[1] < position_error_columns((both,), rows, 0).shape[1]
    np.testing.assert_allclose(np.mean(columns**2), 1.0)


def test_a_body_with_a_first_moment_and_no_mass_has_none() -> None:
    """Its derivatives are no numbers; the regression goes on without them."""
    theta = arm().theta.copy()
    theta[0] = 0.0
    one = replace(record(3, {}), body=FittedBody(arm().with_theta(theta), np.zeros(2)))
    assert position_error_columns((one,), np.arange(200), 0).shape == (200, 0)


def once(seed: int, size: float) -> Recording:
    """An arm that never repeats; its elbow's encoder is eccentric by `size`, rad."""
    model = true_model()
    values = true_values(model, Fv__shoulder=2.0, Fv__elbow=1.0, Fc__elbow=1.5)
    made = synthetic(
        model, values, seed, rate_hz=200.0, period=None, position_std=1e-5, torque_std=0.02
    )
    q = made.q.copy()
    q[:, 1] += size * np.sin(2.0 * q[:, 1])
    return replace(made, q=q)


@pytest.mark.slow
def test_an_eccentric_encoder_is_no_noise_without_a_noise_floor() -> None:
    """A ripple or an offset may take a part; the rest goes with accelerations, in no other way."""
    train = Dataset(tuple(once(seed, 0.05) for seed in (0, 1, 2)))
    found = di.diagnose(true_model(), train, Dataset((once(3, 0.05),)), propose="never")
    assert found.noise_source == "unknown"
    assert found.verdict == "unexplained" and found.following_motion
    told = {
        name for one in found.residual_dependence for name in one.of_the_motion(DEFAULTS.verdict)
    }
    assert "position errors" in told
    assert any(
        "errors of the measured positions that depend on the position" in one.sentence
        for one in found.residual_dependence
    )
