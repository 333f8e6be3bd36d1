"""Virtual experiments: seeds, sensors, files, and silence about what is hidden."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.synthetic import ARM, arm

from dynident.closed_loop import (
    Controller,
    Experiment,
    ExperimentRun,
    Fourier,
    Sensors,
    TrueEffect,
    load_experiment,
    write_experiment,
)
from dynident.errors import DynidentError, EffectError, SimulationError, StudyError
from dynident.recording import read
from dynident.study import load
from experiment_files import HEAD, HIDDEN_STRIBECK, SHORT_RUN, STIFF

RATE = 250.0
LOAD = {"mass": 0.8, "mx": 0.2, "Ixx": 0.01, "Iyy": 0.1, "Izz": 0.1}
FRICTION = """
[[effects]]
effect = "viscous_friction"
values = {Fv = 0.5}
"""
SENSORS = """
[sensors]
position_std = 2e-5
position_resolution = 1e-5
torque_std = [0.05, 0.02]
torque_resolution = 0.001
"""
RESTING_RUN = """
[[recordings]]
file = "run2.csv"
use = "test"
duration = 0.5
period = 0.5
start = 10.0
"""
FILE = HEAD + FRICTION + HIDDEN_STRIBECK + STIFF + SENSORS + SHORT_RUN + RESTING_RUN


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "experiment.toml").write_text(FILE)
    return tmp_path / "experiment.toml"


def small(**changes: Any) -> Experiment:
    robot = arm()
    settings: dict[str, Any] = {
        "robot": robot,
        "controller": Controller(kind="pd", rate_hz=RATE, kp=(300.0, 100.0), kd=(40.0, 5.0)),
        "runs": tuple(
            ExperimentRun(
                trajectory=Fourier.random(robot, 0.5, k, speed=2.0),
                duration=1.0,
                file=f"run{k}.csv",
            )
            for k in range(2)
        ),
        "sensors": Sensors(
            position_std=2e-5, position_resolution=1e-5, torque_std=0.05, torque_resolution=1e-3
        ),
        "seed": 1,
        "lead_in": 0.5,
    }
    return Experiment(**(settings | changes))


def test_seeds_reproduce_and_recordings_differ() -> None:
    first, again, other = (small(seed=seed).run() for seed in (1, 1, 2))
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.q, two.q)
        np.testing.assert_array_equal(one.tau, two.tau)
    assert not np.array_equal(first[0].tau, other[0].tau)
    same = small().runs[0]
    twins = small(runs=(same, replace(same, file="twin.csv"))).run()
    noise = [run.tau - run.tau.mean(0) for run in twins]
    assert not np.array_equal(*noise)


def test_the_noise_is_as_stated() -> None:
    sensors = Sensors(
        position_std=(1e-4, 2e-4),
        position_resolution=0.0,
        torque_std=(0.5, 0.1),
        torque_resolution=0.0,
    )
    experiment = small(sensors=sensors, runs=small().runs[:1])
    (rollout,), (recording,) = experiment.rollouts(), experiment.run()
    noise = recording.q - rollout.q, recording.tau - rollout.u
    np.testing.assert_allclose(noise[0].std(0), (1e-4, 2e-4), rtol=0.2)
    np.testing.assert_allclose(noise[1].std(0), (0.5, 0.1), rtol=0.2)
    np.testing.assert_array_equal(rollout.q_measured, recording.q)


def test_resolution_is_seen_in_the_record() -> None:
    (recording, _) = small(
        sensors=Sensors(
            position_std=0.0, position_resolution=(1e-3, 0.0), torque_std=0.0, torque_resolution=0.5
        )
    ).run()
    steps = recording.q / 1e-3
    np.testing.assert_allclose(steps[:, 0], np.round(steps[:, 0]), atol=1e-9)
    assert np.abs(steps[:, 1] - np.round(steps[:, 1])).max() > 0.1
    np.testing.assert_array_equal(recording.tau, np.round(recording.tau * 2) / 2)


def test_the_motion_is_in_its_periodic_state() -> None:
    (recording, _) = small(sensors=Sensors(), lead_in=2.0).run()
    half = round(0.5 * RATE)
    np.testing.assert_allclose(recording.q[:half], recording.q[half:], atol=1e-5)


def test_measured_torque_is_the_mean_around_a_sample() -> None:
    held, measured = (
        small(sensors=Sensors(), torque=torque).run()[0] for torque in ("held_command", "measured")
    )
    assert (held.torque, measured.torque) == ("held_command", "measured")
    np.testing.assert_allclose(measured.tau[1:], (held.tau[1:] + held.tau[:-1]) / 2, rtol=1e-12)


def test_a_drive_gain_is_seen_in_the_record_only() -> None:
    gain = TrueEffect.of("drive_gain", arm(), [0.25])
    with_gain, without = small(sensors=Sensors(), effects=gain), small(sensors=Sensors())
    # The controller's gains see a plant that is 1.25 times as heavy: give it the equivalent.
    stiffer = Controller(kind="pd", rate_hz=RATE, kp=(375.0, 125.0), kd=(50.0, 6.25))
    found = replace(with_gain, controller=stiffer).run()[0]
    np.testing.assert_allclose(found.q, without.run()[0].q, atol=1e-6)
    np.testing.assert_allclose(found.tau, 1.25 * without.run()[0].tau, atol=1e-3)


def test_payload_acts_where_it_is_and_is_told_only_if_known() -> None:
    robot = arm()
    runs = tuple(replace(run, payload=k == 1) for k, run in enumerate(small().runs))
    bare = small(runs=runs).run()
    for hidden in (True, False):
        load = TrueEffect.of("payload", robot, LOAD, hidden=hidden)
        found = small(runs=runs, effects=load).run()
        np.testing.assert_allclose(found[0].tau, bare[0].tau, atol=0.05)
        assert np.abs(found[1].tau - bare[1].tau).max() > 0.5
        assert [one.payload for one in found] == ([None, None] if hidden else [False, True])


def test_progress_reaches_its_end() -> None:
    told: list[tuple[str, float, float]] = []
    small().run(lambda *step: told.append(step))
    done = [step[1] for step in told]
    assert done == sorted(done)
    assert done[-1] == pytest.approx(told[-1][2]) == pytest.approx(1.5)


@pytest.mark.parametrize(
    "controller",
    [
        Controller(
            kind="computed_torque", rate_hz=RATE, kp=(100.0, 100.0), kd=(20.0, 20.0), delay_s=0.001
        ),
        Controller(
            kind="cascade", rate_hz=RATE, kp=(8.0, 8.0), kv=(4.0, 0.5), drive_gain=(10.0, 10.0)
        ),
        Controller(
            kind="pid",
            rate_hz=RATE,
            kp=(300.0, 100.0),
            kd=(40.0, 5.0),
            ki=(10.0, 10.0),
            velocity_reference=False,
            limit=(150.0, 50.0),
            derivative_cutoff_hz=80.0,
            feedforward=True,
        ),
    ],
)
def test_the_study_states_the_controller_as_it_is(tmp_path: Path, controller: Controller) -> None:
    runs = (replace(small().runs[0], duration=0.1),)
    write_experiment(small(controller=controller, runs=runs), tmp_path)
    assert load(tmp_path / "study.toml").controller == controller


def test_a_feed_forward_knows_the_nominal_robot_only() -> None:
    robot = arm()
    lighter = robot.with_theta(0.7 * robot.theta)
    fed = Controller(kind="pd", rate_hz=RATE, kp=(300.0, 100.0), kd=(40.0, 5.0), feedforward=True)
    errors = []
    for nominal in (None, lighter):
        found = small(controller=fed, nominal=nominal, sensors=Sensors()).run()[0]
        assert found.q_ref is not None
        errors.append(np.abs(found.q - found.q_ref).max())
    assert errors[1] > 2 * errors[0]


# --- files ---------------------------------------------------------------------------------------


def test_what_is_written_can_be_studied(file: Path) -> None:
    out = file.parent / "made" / "here"
    written = write_experiment(load_experiment(file), out)
    assert [path.name for path in written] == ["run1.csv", "run2.csv", "arm.urdf", "study.toml"]
    assert sorted(path.name for path in out.iterdir()) == sorted(path.name for path in written)
    study = load(out / "study.toml")
    assert [one.label for one in study.model.effects] == [
        "viscous_friction@shoulder",
        "viscous_friction@elbow",
    ]
    assert study.controller == load_experiment(file).controller
    (train,), (test,) = study.train.recordings, study.test.recordings
    assert (train.period, train.start, train.torque) == (0.5, 0.0, "held_command")
    assert (test.use, test.start) == ("test", 10.0)
    np.testing.assert_array_equal(study.robot.theta, load_experiment(file).robot.theta)
    expected = load_experiment(file).run()[0]
    np.testing.assert_array_equal(train.q, expected.q)
    np.testing.assert_array_equal(train.q_ref, expected.q_ref)  # type: ignore[arg-type]


@pytest.mark.parametrize("label", ["stribeck_friction@elbow", "payload", "joint_spring@shoulder"])
def test_nothing_written_mentions_what_is_hidden(tmp_path: Path, label: str) -> None:
    robot = arm()
    values = LOAD if label == "payload" else [0.1] * (2 if "spring" in label else 1)
    effects = (
        *TrueEffect.of("coulomb_friction", robot, [0.3]),
        *TrueEffect.of(label, robot, values, hidden=True),
    )
    runs = tuple(replace(run, payload=label == "payload") for run in small().runs)
    written = write_experiment(small(effects=effects, runs=runs), tmp_path)
    name = label.partition("@")[0]
    for path in written:
        text = path.read_text().lower()
        for word in (name, name.split("_")["joint" in name], "hidden", "true_", "seed"):
            assert word not in text, f"{path.name} says '{word}'"
    study = tomllib.loads((tmp_path / "study.toml").read_text())
    assert study["effects"] == ["coulomb_friction"]


def test_known_payload_and_single_joints_are_stated(tmp_path: Path) -> None:
    robot = arm()
    effects = (
        *TrueEffect.of("viscous_friction@elbow", robot, [0.3]),
        *TrueEffect.of("payload", robot, LOAD),
    )
    runs = (small().runs[0], replace(small().runs[1], payload=True))
    write_experiment(small(effects=effects, runs=runs, friction_width=0.02), tmp_path)
    study = tomllib.loads((tmp_path / "study.toml").read_text())
    assert study["effects"] == ["viscous_friction@elbow", "payload"]
    assert [one["payload"] for one in study["recordings"]] == [False, True]
    assert study["friction_width"] == 0.02


def test_the_nominal_robot_is_what_the_user_gets(file: Path) -> None:
    (file.parent / "nominal.urdf").write_text(ARM.replace('mass value="2"', 'mass value="1.7"'))
    file.write_text('nominal = "nominal.urdf"\ngravity = [0.0, 0.0, -1.62]\n' + FILE)
    experiment = load_experiment(file)
    write_experiment(experiment, file.parent / "out")
    study = load(file.parent / "out" / "study.toml")
    assert not (file.parent / "out" / "arm.urdf").exists()
    masses = study.robot.theta[::10]
    np.testing.assert_allclose(masses, [4.0, 1.7])
    np.testing.assert_array_equal(study.robot.gravity, [0, 0, -1.62])
    recording = read(file.parent / "out" / "run1.csv", ("shoulder", "elbow"))
    np.testing.assert_array_equal(recording.tau, experiment.run()[0].tau)


def test_a_failed_simulation_writes_nothing(tmp_path: Path) -> None:
    wild = Controller(kind="pd", rate_hz=RATE, kp=(3000.0, 3000.0), kd=(400.0, 400.0))
    with pytest.raises(SimulationError, match=r"run[01]\.csv, t = "):
        write_experiment(small(controller=wild), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seed = 3", "seeds = 3", "unknown key 'seeds'. did you mean 'seed'"),
        ("hidden = true", "hiden = true", "did you mean 'hidden'"),
        ("position_std", "positon_std", "did you mean 'position_std'"),
        ("harmonics", "harmonic", "did you mean 'harmonics'"),
        ('robot = "arm.urdf"', "", "'robot' is missing"),
        ('robot = "arm.urdf"', 'robot = "leg.urdf"', "no such file"),
        ("seed = 3", "seed = -3", "seed"),
        ("seed = 3", "seed = [", "is not TOML"),
        ("Fv = 0.5", "Fw = 0.5", "effects.0.*no parameter 'Fw'. parameters: Fv"),
        ("Fv = 0.5", "Fv = -0.5", "choose it between 0"),
        ("Fv = 0.5", "Fv = inf", "finite"),
        ("stribeck_friction@elbow", "stribek_friction@elbow", "did you mean 'stribeck_friction'"),
        ("stribeck_friction@elbow", "stribeck_friction@knee", "joints: shoulder, elbow"),
        ("vs = 0.1", "vs = 100.0", "vs = 100"),
        ("[controller]", '[[effects]]\neffect = "viscous_friction@elbow"\n[controller]', "twice"),
        ("kp = [300.0, 100.0]", "kp = [300.0]", "controller.kp: 1 values for 2 joints"),
        ('kind = "pd"', 'kind = "pdd"', "controller.kind"),
        ('kind = "pd"', 'kind = "cascade"', "takes no kd|needs kv"),
        ("rate_hz = 250.0", "rate_hz = 0.0", "rate_hz"),
        ("rate_hz = 250.0", "rate_hz = 250.0\ndelay_s = -0.1", "delay_s"),
        ("speed = 2.0", "speed = 200.0", "recordings.0.*beyond the joint's limit"),
        ("harmonics = 2", "harmonics = 0", "harmonics"),
        ("duration = 0.5", "duration = 0.0", "duration"),
        ("run2.csv", "run1.csv", "two recordings have this name"),
        ("run2.csv", "../run2.csv", "without folder"),
        ("run2.csv", "run2.xls", "ends in .csv"),
        ('use = "test"', 'use = "tests"', "recordings.1.use"),
        ('"shoulder", "elbow"]', '"shoulder", "knee"]', "knee"),
        ("torque_std = [0.05, 0.02]", "torque_std = [0.05]*3", "TOML"),
        ("torque_std = [0.05, 0.02]", "torque_std = [0.05, 0.02, 0.1]", "3 values for 2 joints"),
        ("torque_std = [0.05, 0.02]", "torque_std = -1.0", "torque_std"),
    ],
)
def test_bad_files_are_refused_with_one_clear_line(
    file: Path, old: str, new: str, words: str
) -> None:
    assert old in FILE
    file.write_text(FILE.replace(old, new))
    out = file.parent / "out"
    with pytest.raises(DynidentError, match=words) as caught:
        write_experiment(load_experiment(file), out)
    assert "\n" not in str(caught.value)
    assert not out.exists()


def test_bad_experiments_are_refused_before_anything_is_simulated() -> None:
    robot = arm()
    for changes, error, words in (
        ({"runs": ()}, SimulationError, "no recordings"),
        ({"friction_width": 0.0}, SimulationError, "friction_width"),
        ({"torque": "commanded"}, SimulationError, "held_command"),
        ({"effects": TrueEffect.of("coulomb_friction", robot, [1.0]) * 2}, EffectError, "twice"),
    ):
        with pytest.raises(error, match=words):
            small(**changes)


def test_complaints_name_the_file(file: Path) -> None:
    file.write_text(FILE.replace("Fv = 0.5", "Fw = 0.5"))
    with pytest.raises(StudyError) as caught:
        load_experiment(file)
    assert str(caught.value).startswith(f"{file}: effects.0")
