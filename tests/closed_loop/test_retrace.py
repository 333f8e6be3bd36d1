"""Recorded references, and recordings run again through a model in closed loop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.synthetic import arm

from dynident.closed_loop import (
    ClosedLoop,
    Controller,
    Experiment,
    ExperimentRun,
    Fourier,
    Mechanism,
    SampledReference,
    Sensors,
    TrueEffect,
    retrace,
)
from dynident.errors import SimulationError
from dynident.recording import Recording

RATE = 250.0
PD = Controller(kind="pd", rate_hz=RATE, kp=(300.0, 100.0), kd=(40.0, 5.0))
FRICTION = {"viscous_friction": [0.5], "coulomb_friction": [0.3]}
LOAD = {"mass": 0.8, "mx": 0.2, "Ixx": 0.01, "Iyy": 0.1, "Izz": 0.1}


def experiment(**changes: Any) -> Experiment:
    robot = arm()
    effects = [one for name, x in FRICTION.items() for one in TrueEffect.of(name, robot, x)]
    settings: dict[str, Any] = {
        "robot": robot,
        "controller": PD,
        "runs": tuple(
            ExperimentRun(
                trajectory=Fourier.random(robot, 2.0, k, speed=2.0),
                duration=1.0 + k,
                file=f"run{k}.csv",
                start=5.0 * k,
            )
            for k in range(2)
        ),
        "effects": (*effects, *TrueEffect.of("payload", robot, LOAD)),
        "sensors": Sensors(),
        "lead_in": 0.0,
    }
    return Experiment(**(settings | changes))


# --- references ---------------------------------------------------------------------------------


def test_a_sampled_reference_is_the_motion_that_was_sampled() -> None:
    motion = Fourier.random(arm(), 4.0, 1)
    t = np.arange(401) / 100.0
    q, v, _ = motion.at(t)
    between = np.linspace(0.1, 3.9, 777)
    expected = motion.at(between)
    for sampled, tolerance in (
        (SampledReference(t + 7.0, q), (1e-6, 1e-4, 1e-2)),
        (SampledReference(t, q, v), (1e-6, 1e-4, 5e-2)),
    ):
        assert (sampled.n, sampled.duration) == (2, pytest.approx(4.0))
        for found, exact, within in zip(sampled.at(between), expected, tolerance, strict=True):
            np.testing.assert_allclose(found, exact, atol=within)
        np.testing.assert_allclose(sampled.at(t)[0], q, atol=1e-12)


def test_outside_its_samples_a_reference_comes_to_rest() -> None:
    t = np.linspace(2.0, 3.0, 50)
    sampled = SampledReference(t, np.column_stack([t**2, 1.0 + t]))
    q, v, _ = sampled.at(np.array([-9.0, 0.0, 1.0, 9.0]))
    np.testing.assert_allclose(v, [[0.0, 0.0], [4.0, 1.0], [6.0, 1.0], [0.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(q[1:3], [[4.0, 3.0], [9.0, 4.0]])
    fine = np.arange(-0.5, 1.5, 1e-4)
    q, v, a = sampled.at(fine)
    np.testing.assert_allclose(np.gradient(q, fine, axis=0), v, atol=5e-3)
    steady = (np.abs(fine) > 1e-3) & (np.abs(fine - 1.0) > 1e-3)
    np.testing.assert_allclose(np.gradient(v, fine, axis=0)[steady], a[steady], atol=5e-2)


@pytest.mark.parametrize(
    ("t", "q", "reason"),
    [
        ([0.0, 1.0, 0.5], np.zeros((3, 1)), "clock"),
        ([0.0, 1.0], np.zeros((3, 1)), "reference"),
        ([0.0, 1.0], np.zeros(2), "reference"),
        ([0.0], np.zeros((1, 1)), "reference"),
        ([0.0, 1.0], [[0.0], [np.nan]], "reference"),
        ([0.0, np.inf], np.zeros((2, 1)), "reference"),
    ],
)
def test_unfit_references_are_refused(t: Any, q: Any, reason: str) -> None:
    with pytest.raises(SimulationError) as caught:
        SampledReference(np.array(t), np.array(q))
    assert caught.value.reason == reason


# --- recordings run again -----------------------------------------------------------------------


@pytest.mark.parametrize("torque", ["held_command", "measured"])
@pytest.mark.parametrize("delay", [0.0, 0.4, 1.0])
def test_the_true_robot_makes_the_recording_again(torque: Any, delay: float) -> None:
    """Two recordings of different length, one with a payload, in one plant."""
    gentle = Controller(
        kind="pd", rate_hz=RATE, kp=(150.0, 30.0), kd=(25.0, 2.0), delay_s=delay / RATE
    )
    truth = experiment(torque=torque, controller=gentle)
    runs = tuple(replace(run, payload=k == 1) for k, run in enumerate(truth.runs))
    truth = replace(truth, runs=runs)
    recordings = truth.run()
    bodies = [truth.mechanism(carries_payload=run.payload) for run in runs]
    loop = ClosedLoop()
    again = retrace(loop, bodies, recordings, truth.controller)
    assert loop.builds == 1
    for one, measured in zip(again, recordings, strict=True):
        found = one.recording
        np.testing.assert_array_equal(found.t, measured.t)
        np.testing.assert_allclose(found.q, measured.q, atol=2e-5)
        scale = np.abs(measured.tau).max()
        assert np.sqrt(np.mean((found.tau - measured.tau) ** 2)) < 2e-3 * scale
        assert (found.name, found.period, found.start, found.payload, found.torque) == (
            measured.name,
            measured.period,
            measured.start,
            measured.payload,
            torque,
        )
        assert found.v is None and found.a is None
        np.testing.assert_array_equal(one.saturated, 0.0)


def test_a_recording_on_another_clock_is_met_at_its_own_times() -> None:
    truth = experiment()
    body = truth.mechanism(carries_payload=False)
    (full, _) = truth.run()
    reference = truth.runs[0].trajectory
    (whole,) = retrace(ClosedLoop(), [body], [full], PD)
    exact = whole.rollout
    for torque in ("held_command", "measured"):
        t = 3.0 + np.arange(90) / 97.3
        other = Recording(
            t,
            np.zeros((90, 2)),
            np.zeros((90, 2)),
            full.joints,
            v=np.zeros((90, 2)),
            a=np.zeros((90, 2)),
            q_ref=reference.at(t - 3.0)[0],
            torque=torque,
        )
        (again,) = retrace(ClosedLoop(), [body], [other], PD)
        found, own = again.recording, t - 3.0
        for joint in range(2):
            for name, within in (("q", 3e-4), ("v", 2e-2)):
                near = np.interp(own, exact.t, getattr(exact, name)[:, joint])
                np.testing.assert_allclose(getattr(found, name)[:, joint], near, atol=within)
        held = exact.u[np.floor(own * RATE + 1e-9).astype(int)]
        if torque == "held_command":
            assert np.sqrt(np.mean((found.tau - held) ** 2)) < 0.02 * np.abs(held).max()
        assert np.abs(found.tau - held).max() < 0.2 * np.abs(held).max()
        assert found.v is not None and found.a is not None
        middle = slice(2, -2)
        slope = np.gradient(found.v, found.t, axis=0)[middle]
        assert np.sqrt(np.mean((found.a[middle] - slope) ** 2)) < 0.1 * np.abs(slope).max()


def test_saturation_is_reported_and_no_error() -> None:
    truth = experiment()
    body = truth.mechanism(carries_payload=False)
    (recording, _) = truth.run()
    limited = replace(PD, limit=(25.0, 1000.0))
    (again,) = retrace(ClosedLoop(), [body], [recording], limited)
    assert again.saturated[0] > 0.05 and again.saturated[1] == 0.0
    assert np.abs(again.recording.tau[:, 0]).max() == 25.0


def test_feedback_scale_moves_the_loop_and_not_the_feed_forward() -> None:
    truth = experiment(effects=())
    body = truth.mechanism()
    (recording, _) = truth.run()
    fed = replace(PD, feedforward=True)
    errors = []
    for controller in (PD, fed):
        for scale in (1.0, 0.25):
            (again,) = retrace(
                ClosedLoop(), [body], [recording], controller, feedback_scale=np.full(2, scale)
            )
            errors.append(np.abs(again.rollout.q - again.rollout.q_ref).max())
    assert errors[1] > 2 * errors[0]
    assert max(errors[2:]) < 0.1 * errors[0]


def test_what_cannot_be_run_again_is_refused() -> None:
    truth = experiment()
    body = truth.mechanism()
    (recording, _) = truth.run()
    silent = recording.replace(q_ref=None)
    with pytest.raises(SimulationError, match=r"no reference.*q_ref\.shoulder") as caught:
        retrace(ClosedLoop(), [body], [silent], PD)
    assert caught.value.reason == "reference"
    with pytest.raises(SimulationError, match="1 mechanisms for 2 recordings"):
        retrace(ClosedLoop(), [body], [recording] * 2, PD)
    with pytest.raises(SimulationError, match="other joints"):
        retrace(ClosedLoop(), [body], [recording.select(["elbow", "shoulder"])], PD)
    with pytest.raises(SimulationError, match="rate is not stated") as caught:
        retrace(ClosedLoop(), [body], [recording], replace(PD, rate_hz=None))
    assert caught.value.reason == "clock"
    lost = Mechanism.of(body.robot.with_theta(-body.robot.theta))
    with pytest.raises(SimulationError, match="not positive") as caught:
        retrace(ClosedLoop(), [lost], [recording], PD)
    assert caught.value.reason == "inertia"
