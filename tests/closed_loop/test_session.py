"""What virtual measurements know of their session: time, numbers, temperatures, late torques."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynident.closed_loop import Controller, Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.closed_loop.experiments.virtual_study import write_experiment
from dynident.closed_loop.sensors import delayed
from dynident.robot import Robot
from dynident.study import load

ARM = """<robot name="axis"><link name="base"/><link name="bob"><inertial>
  <origin xyz="0.1 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="50"/></joint></robot>"""
RATE = 200.0
STARTS = (0.0, 100.0)


def experiment(*effects: TrueEffect, **changes: Any) -> Experiment:
    robot = Robot.from_text(ARM)
    trajectory = Fourier.random(robot, 1.0, 1, harmonics=2, speed=2.0)
    runs = [
        ExperimentRun(trajectory=trajectory, duration=2.0, file=f"run{k}.csv", start=s)
        for k, s in enumerate(STARTS)
    ]
    controller = Controller(kind="pd", rate_hz=RATE, kp=(100.0,), kd=(5.0,))
    return Experiment(
        robot=robot,
        controller=controller,
        runs=tuple(runs),
        effects=effects,
        lead_in=1.0,
        **changes,
    )


def true(label: str, values, shape=()) -> TrueEffect:
    (one,) = TrueEffect.of(label, Robot.from_text(ARM), values, shape, hidden=True)
    return one


def test_recordings_are_numbered_as_in_their_study(tmp_path: Path) -> None:
    made = experiment()
    assert [one.number for one in made.run()] == [1, 2]
    write_experiment(made, tmp_path)
    study = load(tmp_path / "study.toml")
    assert [(r.number, r.start) for r in study.train.recordings] == [(1, 0.0), (2, 100.0)]


def test_a_drift_goes_on_from_one_recording_to_the_next() -> None:
    rate = 0.01
    first, second = experiment(true("torque_drift@hinge", [rate])).run()
    np.testing.assert_allclose(np.mean(second.tau - first.tau), rate * 100.0, rtol=1e-3)


def test_a_contact_is_felt_in_its_recording_only() -> None:
    pushed = experiment(true("contact@hinge", [2.0], (2, 101.2, 0.1))).run()
    plain = experiment().run()
    # Two motions in one plant share their steps: the other one moves within the accuracy only.
    assert np.abs(pushed[0].tau - plain[0].tau).max() < 0.02
    change = (pushed[1].tau - plain[1].tau)[:, 0]
    assert 1.0 < change.max() < 3.0
    assert pushed[1].t[np.argmax(change)] == pytest.approx(1.2, abs=0.1)


@pytest.mark.parametrize("torque", ["held_command", "measured"])
@pytest.mark.parametrize("late", [0.013, -0.02])
def test_the_recorded_torque_is_late(torque: Any, late: float) -> None:
    plain = experiment(torque=torque).run()[0]
    behind = experiment(true("torque_delay@hinge", {"d": late}), torque=torque).run()[0]
    np.testing.assert_array_equal(behind.q, plain.q)
    inside = slice(10, -10)
    earlier = np.interp(plain.t - late, plain.t, plain.tau[:, 0])
    np.testing.assert_allclose(behind.tau[inside, 0], earlier[inside], atol=1e-9)
    # A period repeats at the ends too.
    np.testing.assert_allclose(behind.tau[:200], behind.tau[200:], atol=0.02)


def test_a_whole_number_of_samples_is_a_shift() -> None:
    t = np.arange(50) * 0.1
    tau = np.random.default_rng(0).normal(size=(50, 2))
    late = delayed(tau, t, np.array([0.3, 0.0]), 1.0)
    np.testing.assert_allclose(late[3:, 0], tau[:-3, 0], atol=1e-12)
    np.testing.assert_allclose(late[:3, 0], tau[7:10, 0], atol=1e-12)
    np.testing.assert_array_equal(late[:, 1], tau[:, 1])


def test_temperatures_are_recorded_where_there_is_a_sensor(tmp_path: Path) -> None:
    warm = true("thermal_friction@hinge", [1.0, 0.5], (50.0,))
    assert experiment(warm).run()[0].temperature is None
    made = experiment(warm, sensors=Sensors(temperature_std=0.1))
    write_experiment(made, tmp_path)
    for recording in load(tmp_path / "study.toml").train.recordings:
        assert recording.temperature is not None
        law = 25.0 + 10.0 * np.exp(-(recording.t + recording.start) / 50.0)
        noise = recording.temperature[:, 0] - law
        assert noise.std() == pytest.approx(0.1, rel=0.2)
        assert abs(noise.mean()) < 0.02
    # Without that effect nothing else is recorded: a sensor tells nothing of what is hidden.
    assert experiment(sensors=Sensors(temperature_std=0.0)).run()[0].temperature is not None
