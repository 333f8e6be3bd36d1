"""The identified robot in the recorded loop: four errors, and what they are held against."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from dynident.closed_loop import (
    Controller,
    Experiment,
    ExperimentRun,
    Fourier,
    Mechanism,
    Sensors,
    TrueEffect,
)
from dynident.criteria import DEFAULTS
from dynident.errors import SimulationError
from dynident.evidence import compare
from dynident.fitting import Estimate
from dynident.fitting.given import given_estimate
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording
from dynident.robot import Robot
from dynident.validation import validate
from dynident.validation.control_law import law_torque, time_constant
from dynident.validation.loop_signals import _noise
from synthetic import arm

GAINS: dict[str, Any] = {"kp": (400.0, 120.0), "kd": (50.0, 8.0)}
CONTROLLER = Controller(kind="pd", rate_hz=250.0, **GAINS)
FRICTION = (1.5, 0.7)


def model() -> Model:
    return Model(arm()) + "viscous_friction"


@cache
def recordings(
    controller: Controller = CONTROLLER, noise: float = 0.0, torque: Any = "held_command"
) -> tuple[Recording, Recording]:
    """Two recordings of the arm with viscous friction, in the steady state of their loop."""
    robot = arm()
    truth = [
        one
        for joint, value in zip(robot.names, FRICTION, strict=True)
        for one in TrueEffect.of(f"viscous_friction@{joint}", robot, [value])
    ]
    runs = [
        ExperimentRun(
            trajectory=Fourier.random(robot, 2.0, seed, harmonics=3),
            duration=4.0,
            file=f"run{seed}.csv",
        )
        for seed in (1, 2)
    ]
    sensors = Sensors(position_std=noise, torque_std=1e3 * noise)
    experiment = Experiment(
        robot=robot,
        controller=controller,
        runs=tuple(runs),
        effects=tuple(truth),
        sensors=sensors,
        torque=torque,
    )
    first, second = experiment.run()
    return first, second


def dataset(*chosen: Recording, **settings: Any) -> Dataset:
    """The first recording where none is chosen."""
    return Dataset(chosen or recordings()[:1], **settings)


def estimate(scale: float = 1.0, friction: tuple[float, float] = FRICTION) -> Estimate:
    """The true parameters, the bodies' times a factor."""
    known = model()
    values = known.given_values() * scale
    values[-2:] = friction
    return replace(given_estimate(arm(), known), values=values, links=None)


def test_a_single_recording_is_taken_as_a_dataset_of_one() -> None:
    one, _ = recordings()
    alone, listed = (validate(estimate(), each, CONTROLLER) for each in (one, dataset(one)))
    assert alone.errors.of("position") == listed.errors.of("position")


def test_the_true_model_in_its_own_loop_moves_as_measured() -> None:
    found = validate(estimate(), dataset(*recordings()), CONTROLLER)
    assert found.verdict == "follows" and not found.skipped
    assert [run.name for run in found.runs] == ["run1.csv", "run2.csv"]
    for quantity, most in (("position", 1e-4), ("velocity", 2e-4), ("acceleration", 1e-3)):
        assert found.errors.of(quantity) < most  # type: ignore[arg-type]
    assert found.errors.of("torque") < 1e-3
    # Without a model the reference is no substitute, but the control law is the torque.
    assert found.without_model.of("position") > 1e-2
    assert found.without_model.of("torque") < 1e-3
    assert found.tracking.of("position") == pytest.approx(
        found.without_model.of("position"), rel=0.05
    )


@pytest.mark.parametrize("kind", ["pid", "cascade", "computed_torque", "late", "measured"])
def test_every_controller_is_simulated_and_recognised(kind: str) -> None:
    controller = {
        "pid": Controller(kind="pid", rate_hz=250.0, **GAINS, ki=(200.0, 60.0)),
        "cascade": Controller(kind="cascade", rate_hz=250.0, kp=(8.0, 15.0), kv=(50.0, 8.0)),
        "computed_torque": Controller(
            kind="computed_torque", rate_hz=250.0, kp=(150.0, 150.0), kd=(25.0, 25.0)
        ),
        "late": Controller(
            kind="pd",
            rate_hz=250.0,
            kp=(300.0, 60.0),
            kd=(35.0, 4.0),
            delay_s=0.003,
            feedforward=True,
        ),
        "measured": Controller(
            kind="pd", rate_hz=250.0, kp=(300.0, 60.0), kd=(35.0, 4.0), delay_s=0.001
        ),
    }[kind]
    made = recordings(controller, torque="measured" if kind == "measured" else "held_command")
    found = validate(estimate(), dataset(made[0]), controller)
    # A slow loop, or an integral that begins at its reference, has not quite forgotten its start.
    assert found.errors.of("position") < 0.02
    assert found.errors.of("torque") < 0.01
    assert found.without_model.of("torque") < 1e-3
    assert found.remarks == ()
    assert found.verdict == "follows"


def test_a_wrong_mass_is_seen_in_torque_and_motion() -> None:
    right = validate(estimate(), dataset(), CONTROLLER)
    wrong = validate(estimate(1.2), dataset(), CONTROLLER)
    assert 0.1 < wrong.errors.of("torque") < 0.3
    assert np.all(wrong.errors.joints > 10 * right.errors.joints)
    # The control law and the reference are the same, whatever the model.
    np.testing.assert_allclose(wrong.without_model.joints, right.without_model.joints, rtol=0.05)


def test_a_poor_model_is_told_from_a_wrong_controller() -> None:
    poor = validate(estimate(2.5), dataset(), CONTROLLER)
    assert poor.verdict == "no_nearer"
    assert poor.sentence.endswith("the model is poor.")
    assert "gives the recorded torque" in poor.notes[1]
    soft = Controller(kind="pd", rate_hz=250.0, kp=(150.0, 40.0), kd=(20.0, 4.0))
    foreign = validate(estimate(), dataset(), soft)
    assert foreign.verdict == "other_controller"
    assert "the stated controller is not the one that ran" in foreign.sentence
    assert "does not give the recorded torque" in foreign.notes[1]
    # Stiffer than the real one: the simulated position is near, and the law is none the less told.
    stiff = replace(CONTROLLER, kp=(800.0, 240.0))
    assert validate(estimate(), dataset(), stiff).verdict == "other_controller"


UNFOLLOWED = replace(CONTROLLER, velocity_reference=False)


@pytest.mark.parametrize("factor", [1.01, 1.02, 1.1, 2.0, 0.5])
def test_a_gain_that_is_a_little_off_accuses_nobody(factor: float) -> None:
    """Without reference velocity kp e and kd v nearly cancel: kp's error is many times larger."""
    made = recordings(UNFOLLOWED)[0]
    stated = replace(UNFOLLOWED, kp=tuple(factor * x for x in UNFOLLOWED.kp))
    found = validate(estimate(), dataset(made), stated)
    assert np.all(found.judgement.errors.law_terms > 5.0)
    assert np.all(found.without_model.joints[3] > 5.0 * abs(factor - 1))
    slight = 0.9 < factor < 1.2
    assert found.verdict == ("follows" if slight else "other_controller")
    assert any("a gain that is a little off" in one for one in found.notes) == (factor == 1.1)


@pytest.mark.parametrize("stated", [True, False])
def test_a_healthy_model_is_not_called_poor_within_the_noise(stated: bool) -> None:
    """A loop that follows better than its encoders can tell, and a model half their noise off."""
    made = recordings(noise=1e-4)[0].replace(period=None)
    noise = Noise(np.full(2, 1e-4), np.full(2, 0.1)) if stated else None
    found = validate(estimate(), dataset(made, noise=noise), CONTROLLER)
    assert found.noise_source == ("given" if stated else "unknown")
    # The encoder's noise is found, stated or not: twice, but for what the filters make of it.
    silent = validate(estimate(), dataset(made), CONTROLLER)
    np.testing.assert_allclose(
        found.judgement.errors.position_noise, silent.judgement.errors.position_noise, rtol=1.0
    )
    assert found.verdict == "follows"
    (run,) = found.runs
    off = shifted(run.simulated, 0.5 * found.judgement.errors.position_noise)
    doubtful = replace(found, runs=(replace(run, simulated=off, reference=run.simulated),))
    assert np.all(doubtful.errors.joints[0] > doubtful.without_model.joints[0])
    assert doubtful.verdict == "follows" and "it cannot be told whether" in doubtful.sentence


def shifted(signals: Any, share: np.ndarray) -> Any:
    """Signals whose position is off by a share of its rms."""
    rms = np.sqrt(np.mean(signals.position**2, axis=0))
    return replace(signals, position=signals.position + share * rms)


def test_no_nearer_demands_a_clear_ratio() -> None:
    found = validate(estimate(), dataset(), CONTROLLER)
    (run,) = found.runs
    for factor, verdict in ((1.1, "follows"), (1.5, "no_nearer")):
        away = run.measured.position + factor * (run.reference.position - run.measured.position)
        other = replace(run, simulated=replace(run.simulated, position=away))
        judged = replace(found, runs=(other,))
        assert judged.verdict == verdict
        assert ("cannot be told" in judged.sentence) == (verdict == "follows")


def test_a_healthy_torque_is_not_accused() -> None:
    """What the controller makes of the encoders' noise is noise; a hundredth is not material."""
    made = recordings(noise=1e-4)[0].replace(period=None)
    below_noise = dataset(made, noise=Noise(np.full(2, 1e-4), np.zeros(2)))
    assert not any(
        "times the noise" in one for one in validate(estimate(), below_noise, CONTROLLER).notes
    )
    tiny = dataset(noise=Noise(np.full(2, 1e-9), np.full(2, 1e-9)))
    near = validate(estimate(1.002), tiny, CONTROLLER)
    assert near.noise is not None and np.all(near.errors.joints[3] > 3 * near.noise.joints[3])
    assert not any("times the noise" in one for one in near.notes)


def test_noise_of_rows_that_do_not_repeat_is_not_zero() -> None:
    """Of 6 s, two periods of 2.4 s fold; the remainder says nothing of the noise."""
    rng = np.random.default_rng(0)
    t = np.arange(1500) / 250.0
    made = recordings()[0]
    motion = np.sin(2 * np.pi * t / 2.4)[:, None] * np.ones(2)
    noisy = made.replace(
        t=t,
        q=motion + 1e-3 * rng.standard_normal(motion.shape),
        tau=motion + 1e-2 * rng.standard_normal(motion.shape),
        q_ref=motion,
        period=2.4,
    )
    found = _noise(noisy, Dataset((noisy,)), lambda one: one.tau, DEFAULTS.loops)
    # The same with two whole periods and nothing besides.
    rows = t >= t[-1] - 4.8 + 1e-9
    whole = noisy.replace(**{x: getattr(noisy, x)[rows] for x in ("t", "q", "tau", "q_ref")})
    other = _noise(whole, Dataset((whole,)), lambda one: one.tau, DEFAULTS.loops)
    assert found is not None and other is not None
    np.testing.assert_allclose(found[[0, 3]], other[[0, 3]], rtol=0.03)


def test_the_rows_are_told_as_they_are() -> None:
    found = validate(estimate(), dataset(), CONTROLLER)
    (run,) = found.runs
    (note,) = found.error_table().notes
    assert f"Rows from {run.t[0]:.4g} s to {run.t[-1]:.4g} s" in note
    assert "the ends of a record" in note


def test_a_joint_that_nothing_holds_is_named() -> None:
    loose = replace(CONTROLLER, kp=(400.0, 0.0))
    (one,) = validate(estimate(), dataset(), loose).skipped
    assert "nothing holds elbow at its reference" in one.reason and "inf" not in one.reason


def test_the_slowest_body_says_when_a_loop_has_settled() -> None:
    known = model() + "payload"
    values = np.concatenate([estimate().values, [9.0, *np.zeros(9)]])
    heavy = replace(given_estimate(arm(), known), values=values, links=None)
    first, second = recordings()
    weak = replace(CONTROLLER, kd=(20.0, 4.0))
    light = validate(heavy, dataset(first), weak)
    both = validate(heavy, dataset(first, second.replace(payload=True)), weak)
    turned = validate(heavy, dataset(second.replace(payload=True), first), weak)
    assert both.settling == pytest.approx(turned.settling) and both.settling > light.settling


def test_noise_is_stated_and_counts() -> None:
    noise = 1e-4
    made = recordings(noise=noise)[:1]
    known = dataset(*made, noise=Noise(np.full(2, noise), np.full(2, 1e3 * noise)))
    single = replace(known, recordings=tuple(r.replace(period=None) for r in known.recordings))
    found = validate(estimate(), single, CONTROLLER)
    assert found.noise_source == "given" and found.noise is not None
    # What is left of the true model is the noise: that of the loop on top of the sensors'.
    ratio = found.errors.joints / found.noise.joints
    assert np.all((ratio > 0.3) & (ratio < 6.0))
    bare = replace(single, noise=None)
    silent = validate(estimate(), bare, CONTROLLER)
    assert silent.noise is None and silent.noise_source == "unknown"
    assert "noise is unknown" in str(silent.yardstick_table())
    repeats = replace(bare, recordings=tuple(r.replace(period=2.0) for r in bare.recordings))
    lacking = validate(estimate(friction=(0.0, 0.0)), repeats, CONTROLLER)
    assert lacking.noise_source == "replicates" and lacking.noise is not None
    np.testing.assert_allclose(lacking.noise.joints[0], found.noise.joints[0], rtol=10.0)
    assert any("times the noise" in note for note in lacking.notes)


def test_recordings_without_a_reference_are_left_out_by_name() -> None:
    first, second = recordings()
    found = validate(estimate(), dataset(first.replace(q_ref=None), second), CONTROLLER)
    assert [(one.name, one.status) for one in found.skipped] == [("run1.csv", "no_reference")]
    assert [run.name for run in found.runs] == ["run2.csv"]
    assert "run1.csv: it has no column q_ref.<joint>." in str(found.recording_table())
    for nothing in (dataset(first.replace(q_ref=None)), Dataset(())):
        with pytest.raises(SimulationError, match=r"q_ref\.<joint>"):
            validate(estimate(), nothing, CONTROLLER)


def test_settings_that_cannot_be_simulated_are_refused_at_once() -> None:
    with pytest.raises(SimulationError, match="rate"):
        validate(estimate(), dataset(), replace(CONTROLLER, rate_hz=None))
    with pytest.raises(SimulationError, match="a controller of 1 joints for a robot of 2"):
        validate(estimate(), dataset(), Controller(kind="pd", rate_hz=250.0, kp=(1.0,), kd=(1.0,)))


def test_what_cannot_be_simulated_leaves_the_others_standing() -> None:
    """The payload of one recording makes its inertia negative."""
    known = model() + "payload"
    values = np.concatenate([estimate().values, [-9.0, *np.zeros(9)]])
    poor = replace(given_estimate(arm(), known), values=values, links=None)
    first, second = recordings()
    found = validate(poor, dataset(first.replace(payload=True), second), CONTROLLER)
    assert [run.name for run in found.runs] == ["run2.csv"]
    (failed,) = found.skipped
    assert failed.name == "run1.csv" and failed.status == "failed"
    assert found.errors.of("position") < 1e-3


def test_an_unstable_loop_is_a_status_not_an_error() -> None:
    wild = Controller(kind="pd", rate_hz=250.0, kp=(4e4, 2e4), kd=(50.0, 8.0))
    found = validate(estimate(), dataset(), wild)
    assert found.verdict == "not_simulated" and found.runs == ()
    assert {one.status for one in found.skipped} == {"failed"}
    assert found.sentence == "No loop could be simulated."
    said = found.to_dict()
    json.dumps(said, allow_nan=False)
    assert said["error"] is None and said["joints"] == []
    assert all(one["reason"] for one in said["recordings"])
    (reason,) = (one.reason for one in found.skipped)
    assert not reason.startswith("run1.csv")
    assert reason.endswith("are gains, rate_hz and delay_s those of the recorded loop?")
    assert "run1.csv: run1.csv" not in str(found.recording_table())
    assert "run1.csv" in "\n".join(str(part) for part in found.tables())


def test_a_recording_shorter_than_the_transient() -> None:
    first, second = recordings()
    found = validate(estimate(), dataset(first.cut(0.0, 0.3), second), CONTROLLER)
    (short,) = found.skipped
    assert short.status == "too_short" and "settles only after" in short.reason
    late = second.replace(window=(0.0, 0.2))
    (short,) = validate(estimate(), dataset(first, late), CONTROLLER).skipped
    assert short.status == "too_short" and "before the loop has settled" in short.reason


def test_a_limit_that_is_reached_is_said() -> None:
    limited = replace(CONTROLLER, limit=(30.0, 2.0))
    found = validate(estimate(), dataset(recordings(limited)[0]), limited)
    assert found.saturated[1] > 0.05
    assert "at the limit" in found.error_table().columns
    assert any("elbow: the simulated command is at its limit" in note for note in found.notes)
    assert found.errors.of("position") < 0.03
    assert not any("the stated limit" in note for note in found.notes)
    told = validate(estimate(), dataset(), limited)
    assert any("elbow: the recorded torque reaches" in note for note in told.notes)


def test_the_window_and_the_time_constant_are_heeded() -> None:
    mechanism = Experiment(
        robot=arm(),
        controller=CONTROLLER,
        runs=(ExperimentRun(trajectory=Fourier.random(arm(), 2.0, 1), duration=1.0),),
    ).mechanism()
    slowest = time_constant(CONTROLLER, mechanism, recordings()[0].q)
    found = validate(estimate(), dataset(), CONTROLLER)
    assert found.settling == pytest.approx(5 * slowest, rel=0.1)
    assert all(run.t[0] >= found.settling for run in found.runs)
    cut = tuple(r.replace(window=(2.0, 3.0)) for r in recordings())
    found = validate(estimate(), dataset(*cut), CONTROLLER)
    assert all(run.t[0] >= 2.0 and run.t[-1] < 3.0 for run in found.runs)
    # 1 / w_n where the damping is critical, and the slower pole where it is more.
    inertia = np.array([4.0])
    slider = Robot.from_text(SLIDER)
    one = mechanism_of(slider, SLOW)
    assert time_constant(SLOW, one, np.zeros((3, 1))) == pytest.approx(1 / 10.0)
    stiff = replace(SLOW, kd=(800.0,))
    poles = np.roots([inertia[0], 800.0, 400.0])
    assert time_constant(stiff, one, np.zeros((3, 1))) == pytest.approx(1 / np.abs(poles).min())


SLIDER = """<robot name="slider"><link name="base"/>
  <link name="mass"><inertial><mass value="4"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="mass"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="2" effort="50"/></joint></robot>"""
SLOW = Controller(kind="pd", rate_hz=250.0, kp=(400.0,), kd=(80.0,))


def mechanism_of(robot: Robot, controller: Controller) -> Mechanism:
    return Experiment(
        robot=robot,
        controller=controller,
        runs=(ExperimentRun(trajectory=Fourier.random(robot, 2.0, 1), duration=1.0),),
    ).mechanism()


def test_the_control_law_at_another_rate_is_near() -> None:
    """A record at half of the controller's rate."""
    made = recordings()[0]
    sparse = made.replace(
        t=made.t[::2],
        q=made.q[::2],
        tau=made.tau[::2],
        q_ref=made.q_ref[::2],  # type: ignore[index]
    )
    torque = law_torque(sparse, CONTROLLER, arm())
    half = len(torque) // 2
    error = np.linalg.norm(torque[half:] - sparse.tau[half:]) / np.linalg.norm(sparse.tau[half:])
    assert error < 0.05
    found = validate(estimate(), dataset(sparse), CONTROLLER)
    assert found.errors.of("position") < 1e-4 and found.verdict == "follows"


def test_json_and_words() -> None:
    found = validate(estimate(1.1), dataset(), CONTROLLER)
    said = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert said["verdict"] == "follows"
    assert set(said["error"]) == {"position", "velocity", "acceleration", "torque"}
    assert [joint["name"] for joint in said["joints"]] == ["shoulder", "elbow"]
    assert said["joints"][1]["error"]["torque"] == pytest.approx(found.errors.joints[3, 1])
    assert [one["status"] for one in said["recordings"]] == ["simulated"]
    text = "\n".join(str(part) for part in found.tables())
    for word in (
        "position",
        "torque",
        "shoulder",
        "all",
        "without a model",
        "PD controller at 250",
    ):
        assert word in text


def test_joints_of_different_units_are_not_added() -> None:
    found = validate(estimate(1.1), dataset(), CONTROLLER)
    mixed = replace(found, units=("rad", "m"))
    expected = np.sqrt(np.mean(found.errors.joints**2, axis=1))
    np.testing.assert_allclose(mixed.errors.overall, expected)
    np.testing.assert_array_equal(mixed.errors.joints, found.errors.joints)


def test_compare_has_the_loop_beside_the_regression() -> None:
    right, wrong = estimate(), estimate(1.2)
    both = compare({"right": right, "wrong": wrong}, dataset(), CONTROLLER)
    text = "\n".join(str(part) for part in both.tables())
    assert "Simulated in closed loop" in text and "wrong: torque" in text
    models = both.to_dict()["models"]
    assert models[0]["closed_loop"]["error"]["torque"] < 1e-3 < 0.1
    assert models[1]["closed_loop"]["error"]["torque"] > 0.1
    # Without a controller, or a reference, there is no such column and no such key.
    for plain in (
        compare(right, dataset()),
        compare(right, dataset(recordings()[0].replace(q_ref=None)), CONTROLLER),
    ):
        assert "closed_loop" not in plain.to_dict()["models"][0]
        assert "in loop" not in str(plain.tables()[0])
    failed = compare(right, dataset(), replace(CONTROLLER, rate_hz=None))
    assert failed.results[0].error == both.results[0].error
    table: Any = failed.tables()[0]
    assert table.columns[-2:] == ("in loop: torque", "in loop: position")
    assert "rate is not stated" in str(table)
    assert failed.to_dict()["models"][0]["closed_loop"]["verdict"] == "not_simulated"
