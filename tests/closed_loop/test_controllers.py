"""Controllers: their laws, sample by sample, and what they refuse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.synthetic import arm

from dynident.closed_loop import Controller, ControllerFile
from dynident.closed_loop.controllers import Drive
from dynident.errors import SimulationError, StudyError
from dynident.robot import Robot

RATE = 100.0
Q, Q_REF, V_REF = (np.array(x) for x in ([0.1, -0.2], [0.3, 0.1], [1.0, -2.0]))
BEFORE = np.array([0.09, -0.21])
SPEED = (Q - BEFORE) * RATE


def first_command(controller: Controller) -> np.ndarray:
    return Drive(controller, BEFORE, np.zeros(2)).command(Q, Q_REF, V_REF)


def test_pd() -> None:
    kp, kd = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    u = first_command(Controller("pd", RATE, (10.0, 20.0), (1.0, 2.0)))
    np.testing.assert_allclose(u, kp * (Q_REF - Q) + kd * (V_REF - SPEED), rtol=1e-12)


def test_pd_without_reference_velocity() -> None:
    kp, kd = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    u = first_command(Controller("pd", RATE, (10.0, 20.0), (1.0, 2.0), velocity_reference=False))
    np.testing.assert_allclose(u, kp * (Q_REF - Q) - kd * SPEED, rtol=1e-12)


def test_cascade() -> None:
    kp, kv = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    u = first_command(Controller("cascade", RATE, (10.0, 20.0), kv=(1.0, 2.0)))
    np.testing.assert_allclose(u, kv * (kp * (Q_REF - Q) - SPEED), rtol=1e-12)


def test_pid_integrates_and_stops_at_the_limit() -> None:
    gains: dict[str, Any] = {"kp": (1.0,), "ki": (10.0,), "kd": (0.0,)}
    drive = Drive(Controller("pid", RATE, **gains), np.zeros(1), np.zeros(1))
    zero, one = np.zeros(1), np.ones(1)
    found = [float(drive.command(zero, one, zero)[0]) for _ in range(20)]
    np.testing.assert_allclose(found, 1.0 + 0.1 * np.arange(1, 21))
    drive = Drive(Controller("pid", RATE, **gains, limit=(1.45,)), np.zeros(1), np.zeros(1))
    held = [float(drive.command(zero, one, zero)[0]) for _ in range(1000)]
    assert max(held) == 1.45
    released = float(drive.command(one, one, zero)[0])
    assert abs(released) <= 0.5, "the integral has wound up"


def test_limit_binds_both_ways() -> None:
    for sign in (1, -1):
        controller = Controller("pd", RATE, (1e4, 1e4), (0.0, 0.0), limit=(3.0, 5.0))
        drive = Drive(controller, np.zeros(2), np.zeros(2))
        u = drive.command(np.zeros(2), sign * np.ones(2), np.zeros(2))
        np.testing.assert_array_equal(u, sign * np.array([3.0, 5.0]))


def test_filtered_derivative_of_a_ramp_settles_on_its_slope() -> None:
    controller = Controller("pd", RATE, (0.0,), (1.0,), derivative_cutoff_hz=5.0)
    drive = Drive(controller, np.zeros(1), np.zeros(1))
    zero = np.zeros(1)
    u = [float(drive.command(np.array([0.02 * k]), zero, zero)[0]) for k in range(1, 200)]
    assert u[0] == pytest.approx(-2.0 * (1 - np.exp(-2 * np.pi * 5.0 / RATE)))
    assert u[-1] == pytest.approx(-2.0)
    assert np.all(np.diff(u) <= 1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "fuzzy"}, "kinds: pd"),
        ({"kd": ()}, "needs kd"),
        ({"kv": (1.0, 1.0)}, "takes no kv"),
        ({"kd": (1.0,)}, "1 gains for 2 joints"),
        ({"kp": (-1.0, 1.0)}, "not negative"),
        ({"kp": (np.nan, 1.0)}, "finite"),
        ({"kp": (np.inf, 1.0)}, "finite"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": np.nan}, "rate_hz"),
        ({"limit": (1.0, 0.0)}, "limit"),
        ({"limit": (1.0,)}, "limit"),
        ({"derivative_cutoff_hz": -1.0}, "derivative_cutoff_hz"),
        ({"delay_s": -1.0}, "delay_s"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], words: str) -> None:
    good: dict[str, Any] = {"kind": "pd", "rate_hz": RATE, "kp": (1.0, 1.0), "kd": (1.0, 1.0)}
    Controller(**good)
    with pytest.raises(SimulationError, match=words):
        Controller(**(good | changes))


def test_a_delay_is_stated_but_not_simulated() -> None:
    controller = Controller("pd", RATE, (1.0,), (1.0,), delay_s=0.002)
    with pytest.raises(SimulationError, match=r"0\.002 s cannot be simulated yet"):
        Drive(controller, np.zeros(1), np.zeros(1))


def test_table_of_a_file() -> None:
    robot: Robot = arm()
    said = ControllerFile(kind="pd", rate_hz=200.0, kp=[3.0, 4.0], kd=2.0)
    assert said.controller(robot, "here").kd == (2.0, 2.0)
    short = ControllerFile(kind="pd", rate_hz=200.0, kp=[3.0], kd=[2.0])
    with pytest.raises(StudyError, match=r"study.toml: controller.kp: 1 values for 2 joints"):
        short.controller(robot, "study.toml: controller")
    with pytest.raises(StudyError, match="needs kd"):
        ControllerFile(kind="pd", rate_hz=200.0, kp=1.0).controller(robot, "here")
