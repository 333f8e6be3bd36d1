"""Controllers: their laws, sample by sample, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.synthetic import arm

from dynident.closed_loop import Controller, ControllerFile
from dynident.closed_loop.controllers import LAWS
from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
from dynident.errors import SimulationError, StudyError
from dynident.robot import Robot

RATE = 100.0
Q, Q_REF, V_REF, A_REF = (np.array(x) for x in ([0.1, -0.2], [0.3, 0.1], [1.0, -2.5], [3.0, 1.0]))
BEFORE = np.array([0.09, -0.21])
SPEED = (Q - BEFORE) * RATE

PENDULUM = """<robot name="pendulum"><link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="20" effort="50"/></joint></robot>"""


def constant(samples: int, q: Any, v: Any, a: Any = 0.0) -> ReferenceSamples:
    rows = (
        np.tile(np.asarray(x, dtype=float) + np.zeros(np.shape(q)), (samples, 1)) for x in (q, v, a)
    )
    return ReferenceSamples(*rows)


def second_command(controller: Controller, scale: Any = None) -> np.ndarray:
    """The command at Q, one sample after BEFORE."""
    drive = Drive(controller, constant(2, Q_REF, V_REF, A_REF), [arm()], scale)
    drive.command(0, BEFORE)
    return drive.command(1, Q)


def one_joint(controller: Controller, q_ref: float, samples: int) -> Drive:
    return Drive(controller, constant(samples, [q_ref], 0.0), [arm()])


def test_pd() -> None:
    kp, kd = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    expected = kp * (Q_REF - Q) + kd * (V_REF - SPEED)
    pd = Controller(kind="pd", rate_hz=RATE, kp=(10.0, 20.0), kd=(1.0, 2.0))
    np.testing.assert_allclose(second_command(pd), expected, rtol=1e-12)
    np.testing.assert_allclose(
        second_command(pd, np.array([2.0, 0.5])), [2.0, 0.5] * expected, rtol=1e-12
    )
    amplified = Controller(
        kind="pd", rate_hz=RATE, kp=(1.0, 10.0), kd=(0.1, 1.0), drive_gain=(10.0, 2.0)
    )
    np.testing.assert_allclose(second_command(amplified), expected, rtol=1e-12)


def test_pd_without_reference_velocity() -> None:
    kp, kd = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    u = second_command(
        Controller(
            kind="pd", rate_hz=RATE, kp=(10.0, 20.0), kd=(1.0, 2.0), velocity_reference=False
        )
    )
    np.testing.assert_allclose(u, kp * (Q_REF - Q) - kd * SPEED, rtol=1e-12)


def test_cascade_of_the_paper() -> None:
    """tau = g (kp kv (q_ref - q) - kv v)."""
    kp, kv, g = np.array([10.0, 20.0]), np.array([1.0, 2.0]), np.array([3.0, 4.0])
    expected = g * (kp * kv * (Q_REF - Q) - kv * SPEED)
    u = second_command(
        Controller(kind="cascade", rate_hz=RATE, kp=(10.0, 20.0), kv=(1.0, 2.0), drive_gain=(3, 4))
    )
    np.testing.assert_allclose(u, expected, rtol=1e-12)
    u = second_command(Controller(kind="cascade", rate_hz=RATE, kp=(10.0, 20.0), kv=(3.0, 8.0)))
    np.testing.assert_allclose(u, expected, rtol=1e-12)


def test_computed_torque_is_the_inverse_dynamics_of_the_wanted_acceleration() -> None:
    kp, kd = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    controller = Controller(kind="computed_torque", rate_hz=RATE, kp=(10.0, 20.0), kd=(1.0, 2.0))
    for factor in (1.0, 0.5):
        wanted = A_REF + factor * (kp * (Q_REF - Q) + kd * (V_REF - SPEED))
        (expected,) = arm().inverse_dynamics(Q[None], SPEED[None], wanted[None])
        u = second_command(controller, np.full(2, factor))
        np.testing.assert_allclose(u, expected, rtol=1e-12)
    fed = second_command(replace(controller, feedforward=True), np.full(2, factor))
    np.testing.assert_array_equal(fed, u)


def test_feed_forward_adds_the_torque_along_the_reference() -> None:
    pd = Controller(kind="pd", rate_hz=RATE, kp=(10.0, 20.0), kd=(1.0, 2.0))
    (along,) = arm().inverse_dynamics(Q_REF[None], V_REF[None], A_REF[None])
    for scale in (np.ones(2), np.array([0.5, 2.0])):
        added = second_command(replace(pd, feedforward=True), scale) - second_command(pd, scale)
        np.testing.assert_allclose(added, along, rtol=1e-12)


def test_robots_side_by_side_are_driven_by_their_own_models() -> None:
    light = arm()
    heavy = light.with_theta(2.0 * light.theta)
    controller = Controller(kind="computed_torque", rate_hz=RATE, kp=(10.0, 20.0), kd=(1.0, 2.0))
    both = constant(1, np.tile(Q_REF, 3), np.tile(V_REF, 3), np.tile(A_REF, 3))
    u = Drive(controller, both, [light, heavy, light]).command(0, np.tile(Q, 3))
    np.testing.assert_allclose(u[2:4], 2.0 * u[:2], rtol=1e-12)
    np.testing.assert_array_equal(u[4:], u[:2])


def test_pid_integrates_and_stops_at_the_limit() -> None:
    gains: dict[str, Any] = {"kp": (1.0,), "ki": (10.0,), "kd": (0.0,)}
    zero, one = np.zeros(1), np.ones(1)
    drive = one_joint(Controller(kind="pid", rate_hz=RATE, **gains), 1.0, 20)
    found = [float(drive.command(k, zero)[0]) for k in range(20)]
    np.testing.assert_allclose(found, 1.0 + 0.1 * np.arange(1, 21))
    drive = one_joint(Controller(kind="pid", rate_hz=RATE, **gains, limit=(1.45,)), 1.0, 1001)
    held = [float(drive.command(k, zero)[0]) for k in range(1000)]
    assert max(held) == 1.45
    assert drive.saturated.all()
    released = float(drive.command(1000, one)[0])
    assert abs(released) <= 0.5, "the integral has wound up"
    assert not drive.saturated.any()


def test_an_integral_may_begin_settled() -> None:
    gains: dict[str, Any] = {"kp": (1.0,), "ki": (10.0,), "kd": (2.0,)}
    reference = constant(2, [1.0], [3.0])
    for feedforward in (False, True):
        controller = Controller(kind="pid", rate_hz=RATE, **gains, feedforward=feedforward)
        nominal = Robot.from_text(PENDULUM)
        drive = Drive(controller, reference, [nominal], None, np.array([7.0]))
        np.testing.assert_allclose(drive.command(0, reference.q[0]), [7.0], rtol=1e-12)


def test_limit_binds_both_ways() -> None:
    for sign in (1, -1):
        controller = Controller(
            kind="pd", rate_hz=RATE, kp=(1e4, 1e4), kd=(0.0, 0.0), limit=(3.0, 5.0)
        )
        drive = Drive(controller, constant(1, sign * np.ones(2), 0.0), [arm()])
        u = drive.command(0, np.zeros(2))
        np.testing.assert_array_equal(u, sign * np.array([3.0, 5.0]))


def test_filtered_derivative_of_a_ramp_settles_on_its_slope() -> None:
    controller = Controller(kind="pd", rate_hz=RATE, kp=(0.0,), kd=(1.0,), derivative_cutoff_hz=5.0)
    drive = one_joint(controller, 0.0, 200)
    u = [float(drive.command(k, np.array([0.02 * k]))[0]) for k in range(200)][1:]
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
        ({"drive_gain": (1.0, 0.0)}, "drive_gain"),
        ({"kind": "computed_torque", "drive_gain": (1.0, 1.0)}, "makes torques, not signals"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], words: str) -> None:
    good: dict[str, Any] = {"kind": "pd", "rate_hz": RATE, "kp": (1.0, 1.0), "kd": (1.0, 1.0)}
    Controller(**good)
    with pytest.raises(SimulationError, match=words):
        Controller(**(good | changes))


def test_table_of_a_file() -> None:
    robot: Robot = arm()
    said = ControllerFile(kind="pd", rate_hz=200.0, kp=[3.0, 4.0], kd=2.0)
    assert said.controller(robot, "here").kd == (2.0, 2.0)
    short = ControllerFile(kind="pd", rate_hz=200.0, kp=[3.0], kd=[2.0])
    with pytest.raises(StudyError, match=r"study.toml: controller.kp: 1 values for 2 joints"):
        short.controller(robot, "study.toml: controller")
    with pytest.raises(StudyError, match="needs kd"):
        ControllerFile(kind="pd", rate_hz=200.0, kp=1.0).controller(robot, "here")


# --- what every kind keeps to: a new one is an entry of LAWS and nothing here ---------------------

every_kind = pytest.mark.parametrize("kind", LAWS)


def of_kind(kind: str, **settings: Any) -> Controller:
    gains: dict[str, Any] = {name: (4.0, 9.0) for name in LAWS[kind].gains}
    return Controller(kind=kind, rate_hz=RATE, **gains, **settings)


def commands(controller: Controller, *measured: np.ndarray) -> np.ndarray:
    """The last command at some positions, under a reference that stands still."""
    drive = Drive(controller, constant(len(measured), Q_REF, 0.0), [arm()])
    return np.array([drive.command(k, q) for k, q in enumerate(measured)])[-1]


@every_kind
def test_every_kind_pulls_towards_its_reference_and_damps(kind: str) -> None:
    off = np.array([0.01, -0.02])
    still = commands(of_kind(kind), Q_REF, Q_REF)
    behind = commands(of_kind(kind), Q_REF - off, Q_REF - off)
    moving = commands(of_kind(kind), Q_REF - off, Q_REF)
    assert off @ (behind - still) > 0.0 and off @ (moving - still) < 0.0


@every_kind
def test_every_kind_keeps_its_limit(kind: str) -> None:
    far = Q_REF - np.array([50.0, -50.0])
    limit = (0.5, 0.25)
    held = commands(of_kind(kind, limit=limit), far, far)
    free = commands(of_kind(kind), far, far)
    np.testing.assert_allclose(held, np.clip(free, np.negative(limit), limit))
    assert np.any(np.abs(free) > limit)


@every_kind
def test_every_kind_is_read_from_a_file_and_asks_for_its_gains(kind: str) -> None:
    gains: dict[str, Any] = {name: [4.0, 9.0] for name in LAWS[kind].gains}
    table = ControllerFile(kind=kind, rate_hz=RATE, **gains)
    assert table.controller(arm(), "here") == of_kind(kind)
    for name in LAWS[kind].gains:
        with pytest.raises(SimulationError, match=f"needs {name}|give one gain per joint"):
            replace(of_kind(kind), **{name: ()})
    assert len(LAWS[kind].powers) == len(LAWS[kind].gains)
    assert np.shape(of_kind(kind).feedback().position) == (2,)


@every_kind
def test_a_loop_without_a_rate_cannot_be_simulated(kind: str) -> None:
    with pytest.raises(SimulationError, match="rate is not stated"):
        replace(of_kind(kind), rate_hz=None).simulated_rate()
