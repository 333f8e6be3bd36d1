"""Columns of other people's logs: what their names say, and which joint each is of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.recording import FileLayout
from dynident.robot import Robot
from dynident.study_draft.column_roles import role_of
from dynident.study_draft.log import Log
from dynident.study_draft.matching import match
from synthetic import ARM

JOINTS = ("shoulder", "elbow")


def two_links() -> Robot:
    return Robot.from_text(ARM)


def log_of(*names: str, **values: np.ndarray) -> Log:
    """A log of 50 samples; the columns are alike but for those given, and the clocks."""
    rng = np.random.default_rng(0)
    columns = {name: rng.normal(size=50) for name in names}
    columns |= values
    return Log(
        file=Path("log.csv"),
        record="",
        columns=columns,
        names=tuple(columns),
        skipped=(),
        layout=FileLayout(),
    )


CLOCK = np.arange(50) / 100

LAYOUTS = {
    "ours": ("q.shoulder q.elbow", "tau.shoulder tau.elbow"),
    "order of a table": ("q[0] q[1]", "tau[0] tau[1]"),
    "counted from one": ("q1 q2", "tau1 tau2"),
    "joints lead": ("J1_pos J2_pos", "J1_torque J2_torque"),
    "a controller's": ("actual_q_0 actual_q_1", "actual_current_0 actual_current_1"),
    "joint states by name": (
        "/joint_states/shoulder/position /joint_states/elbow/position",
        "/joint_states/shoulder/effort /joint_states/elbow/effort",
    ),
    "joint states by number": ("field.position0 field.position1", "field.effort0 field.effort1"),
    "long names": ("arm_shoulder_position arm_elbow_position", "arm_shoulder_trq arm_elbow_trq"),
    "camel case": ("jointPosition1 jointPosition2", "jointTorque1 jointTorque2"),
    "units alone": ("axis1_deg axis2_deg", "axis1_Nm axis2_Nm"),
    "an angle and a length": ("J1_position_deg J2_position_mm", "J1_torque_Nm J2_force_N"),
    "units in brackets": ("J1[rad] J2[rad]", "J1[Nm] J2[Nm]"),
    "a drive's": ("motorPos_1 motorPos_2", "motorCurrent_1 motorCurrent_2"),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts_are_matched_whatever_order_the_columns_are_in(layout: str) -> None:
    positions, torques = (names.split() for names in LAYOUTS[layout])
    log = log_of(*torques[::-1], *positions[::-1], t=CLOCK)
    matched = match(log, two_links())
    found = matched.columns(two_links(), {})
    assert found["t"].name == "t"
    assert [found[f"q.{joint}"].name for joint in JOINTS] == positions
    assert [found[f"tau.{joint}"].name for joint in JOINTS] == torques


def test_speeds_references_and_temperatures_are_not_taken_for_positions() -> None:
    names = [
        f"{kind}_{k}"
        for k in (0, 1)
        for kind in ("target_q", "actual_q", "actual_qd", "target_qd", "effort", "motor_temp")
    ]
    found = match(log_of(*names, timestamp=CLOCK), two_links()).columns(two_links(), {})
    kinds = {ours: theirs.name for ours, theirs in found.items() if ours.endswith("elbow")}
    assert kinds == {
        "q.elbow": "actual_q_1",
        "v.elbow": "actual_qd_1",
        "tau.elbow": "effort_1",
        "q_ref.elbow": "target_q_1",
        "temperature.elbow": "motor_temp_1",
    }


def test_measured_torques_come_before_commands_and_the_others_are_told() -> None:
    names = ["q1", "q2", "tau_con1", "tau_con2", "tau_meas1", "tau_meas2"]
    groups = match(log_of(*names, t=CLOCK), two_links()).groups["tau"]
    assert [group.title for group in groups] == [
        "tau_meas1 ... tau_meas2",
        "tau_con1 ... tau_con2",
    ]


@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("q1_deg", np.pi / 180),
        ("velocity_deg_1", np.pi / 180),
        ("time_ms", 1e-3),
        ("tau1_mNm", 1e-3),
        ("axis1_deg", np.pi / 180),
        ("axis1_rpm", np.pi / 30),
        ("J1_pos [mm]", 1e-3),
        ("axis1_mm", 1e-3),
        ("J1 [mm/s]", 1e-3),
        ("axis1_mNm", 1e-3),
    ],
)
def test_units_in_names_become_scales(name: str, scale: float) -> None:
    role = role_of(name, JOINTS)
    assert role is not None and role.scale == pytest.approx(scale)


def test_seconds_and_nanoseconds_make_one_clock() -> None:
    names = ["q1", "q2", "tau1", "tau2"]
    stamps = 1.7e9 + CLOCK
    log = log_of(
        *names, **{"stamp.sec": np.floor(stamps), "stamp.nanosec": np.round(stamps % 1 * 1e9)}
    )
    time = match(log, two_links()).time
    assert time is not None and time[0].name == "stamp.sec + 1e-9*stamp.nanosec"


def test_a_clock_that_does_not_go_forward_is_none() -> None:
    log = log_of("q1", "q2", "tau1", "tau2", t=np.zeros(50))
    assert match(log, two_links()).time is None


@pytest.mark.parametrize(
    ("names", "what"),
    [
        (["tau1", "tau2", "x1", "x2"], "no positions"),
        (["q1", "q2", "x1", "x2"], "no torques or currents"),
        (["q1", "tau1", "tau2"], "no positions of 2 joints"),
        (["q.shoulder", "q1", "tau1", "tau2"], "no positions of elbow"),
        (["q.shoulder", "q.elbow", "tau.shoulder"], "no torques or currents of elbow are told"),
    ],
)
def test_what_is_not_told_by_name_is_refused_with_what_is_there(
    names: list[str], what: str
) -> None:
    with pytest.raises(RecordingError, match=what) as caught:
        match(log_of(*names, t=CLOCK), two_links())
    assert "it holds" in str(caught.value) and "shoulder, elbow" in str(caught.value)


@pytest.mark.parametrize(
    "name", ["actual_TCP_force_1", "tau_ext_1", "pos_err_1", "torque_limit_1", "wrench_force_0"]
)
def test_what_is_no_signal_of_a_joint_is_left_alone(name: str) -> None:
    assert role_of(name, JOINTS) is None


@pytest.mark.parametrize(
    ("name", "signal", "origin"),
    [
        ("tau_J_d_1", "tau", "reference"),
        ("q_d_0", "q", "reference"),
        ("FbkPosition1", "q", "measured"),
        ("SetPosition1", "q", "reference"),
        ("A1_torque", "tau", "plain"),
        ("header.stamp.nsecs", "t", "plain"),
        ("tau_current_1", "current", "plain"),
        ("axis_1_deg/s", "v", "plain"),
        ("axis_1 [rad/s^2]", "a", "plain"),
        ("A1_rpm_act", "v", "measured"),
        ("axis1_deg_soll", "q", "reference"),
    ],
)
def test_vendors_words_are_understood(name: str, signal: str, origin: str) -> None:
    role = role_of(name, JOINTS)
    assert role is not None and (role.signal, role.origin) == (signal, origin)


@pytest.mark.parametrize("name", ["A1_acc_rad/s^2", "axis_1 [deg/s2]", "accel 1 (rad/s**2)"])
def test_the_square_of_a_unit_counts_no_joints(name: str) -> None:
    role = role_of(name, JOINTS)
    assert role is not None and (role.signal, role.number) == ("a", 1)


def test_a_joint_may_be_called_after_a_signal() -> None:
    role = role_of("q.theta", ("theta",))
    assert role is not None and (role.signal, role.joint) == ("q", 0)


def test_measured_currents_come_before_what_a_controller_wants() -> None:
    names = [f"{kind}_{k}" for k in (0, 1) for kind in ("q", "target_moment", "actual_current")]
    groups = match(log_of(*names, t=CLOCK), two_links()).groups["tau"]
    assert [group.is_current for group in groups] == [True, False]


def test_two_signals_of_one_joint_are_a_choice_never_a_mixture() -> None:
    names = [f"{kind}_{joint}" for joint in JOINTS for kind in ("q", "theta", "tau")]
    groups = match(log_of(*names, t=CLOCK), two_links()).groups["q"]
    assert [group.title for group in groups] == [
        "q_shoulder ... q_elbow",
        "theta_shoulder ... theta_elbow",
    ]


def test_columns_that_no_name_tells_are_those_that_were_said_to_be() -> None:
    """A clock is told by its steps, and a torque may be an expression of its column."""
    log = log_of("k1", "k2", "m1", "m2", zyklus=np.arange(50.0), zeit=CLOCK)
    told = {"q.shoulder": "k2", "q.elbow": "k1", "tau.shoulder": "-m1", "tau.elbow": "0.5*m2"}
    matched = match(log, two_links(), told=told)
    found = {ours: theirs.name for ours, theirs in matched.columns(two_links(), {}).items()}
    assert found == {
        "t": "zeit",
        "q.shoulder": "k2",
        "q.elbow": "k1",
        "tau.shoulder": "m1",
        "tau.elbow": "m2",
    }


def test_of_a_sum_that_was_said_each_motor_is_taken_once() -> None:
    log = log_of("k1", "k2", "m1", "m2", zeit=CLOCK)
    told = {"q.shoulder": "k1/32 - k2/45", "q.elbow": "k1", "tau.shoulder": "m1", "tau.elbow": "m2"}
    found = match(log, two_links(), told=told).columns(two_links(), {})
    assert [found[f"q.{joint}"].name for joint in JOINTS] == ["k2", "k1"]


def test_a_column_that_was_said_and_is_not_there_is_named() -> None:
    log = log_of("k1", "k2", "m1", "m2", zeit=CLOCK)
    told = {"q.shoulder": "k1", "q.elbow": "k3", "tau.shoulder": "m1", "tau.elbow": "m2"}
    with pytest.raises(RecordingError, match="'k3' is no column of the files"):
        match(log, two_links(), told=told)


def test_the_number_of_the_sample_is_no_clock() -> None:
    assert match(log_of("q1", "q2", "tau1", "tau2", nr=np.arange(50.0)), two_links()).time is None


@pytest.mark.parametrize(
    "name",
    [
        "J1_degC",
        "temp1 [deg C]",
        "k1 [Nm/rad]",
        "damping_1_Nm_s",
        "x1 [N mm]",
        "J1 [N/mm]",
        "load1_kg_mm",
    ],
)
def test_other_units_are_no_positions_and_no_torques(name: str) -> None:
    role = role_of(name, JOINTS)
    assert role is None or role.signal == "temperature"


@pytest.mark.parametrize("name", ["pos_degrees2", "p_radians2", "axis2_rad"])
def test_a_number_behind_a_unit_counts_joints(name: str) -> None:
    role = role_of(name, JOINTS)
    assert role is not None and role.number == 2


@pytest.mark.parametrize("missing", ["q.elbow", "tau.shoulder"])
def test_what_was_said_of_some_joints_only_tells_no_signal(missing: str) -> None:
    log = log_of("k1", "k2", "m1", "m2", zeit=CLOCK)
    told = {"q.shoulder": "k1", "q.elbow": "k2", "tau.shoulder": "m1", "tau.elbow": "m2"}
    del told[missing]
    with pytest.raises(RecordingError, match="--column"):
        match(log, two_links(), told=told)


@pytest.mark.parametrize(
    ("joints", "columns"),
    [
        (("arm.shoulder", "arm.elbow"), ("q.shoulder", "q.elbow")),
        (("left/arm shoulder joint", "left/arm elbow joint"), ("pos_shoulder", "pos_elbow")),
        (("ur_shoulder_pan_joint", "ur_elbow_joint"), ("shoulder_pan_position", "elbow_position")),
    ],
)
def test_what_all_joints_are_called_need_not_be_in_columns(joints, columns) -> None:
    """Nor do numbers tell joints where only they are left of the names: they may begin at 0."""
    for number, column in enumerate(columns):
        role = role_of(column, joints)
        assert role is not None and (role.signal, role.joint) == ("q", number)
    counted = role_of("position_1", ("panda_joint1", "panda_joint2"))
    assert counted is not None and (counted.joint, counted.number) == (None, 1)
    (only,) = (role_of("q_1", ("joint",)),)
    assert only is not None and only.joint is None
