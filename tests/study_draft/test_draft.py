"""Drafts of studies: files in other units and orders become the recordings that they are of."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.errors import DynidentError, RecordingError
from dynident.recording import Recording
from dynident.recording.formats.write import write
from dynident.study_draft import Decision, LogFacts, draft_study
from study_files import recording
from synthetic import ARM

DEG = 180 / np.pi


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = np.column_stack(list(columns.values()))
    header = ",".join(columns)
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def as_logged(one: Recording, **changes: np.ndarray) -> dict[str, np.ndarray]:
    """Columns with names of nobody's in particular."""
    plain = {"time": one.t, "pos_1": one.q[:, 0], "pos_2": one.q[:, 1]}
    return {**plain, "trq_1": one.tau[:, 0], "trq_2": one.tau[:, 1], **changes}


def read_back(arm: Path, columns: dict[str, np.ndarray]) -> tuple[di.Study, tuple[Decision, ...]]:
    data = written(arm.parent / "run.csv", columns)
    draft = draft_study(arm, [data])
    return di.load(draft.write(arm.parent / "study.toml")), draft.decisions


def assert_same(study: di.Study, one: Recording) -> None:
    found = study.train.recordings[0]
    np.testing.assert_allclose(found.t - found.t[0], one.t - one.t[0], atol=1e-9)
    np.testing.assert_allclose(found.q, one.q, atol=1e-9)
    np.testing.assert_allclose(found.tau, one.tau, atol=1e-9)


def test_plain_columns_are_taken_as_they_are(arm: Path) -> None:
    one = recording(1)
    study, decisions = read_back(arm, as_logged(one))
    assert_same(study, one)
    assert study.train.recordings[0].period == pytest.approx(8.0, rel=1e-4)
    assert not any(decision.is_open for decision in decisions if decision.subject != "period")


FAULTS = {
    "degrees": {"pos_1": lambda x: x.q[:, 0] * DEG, "pos_2": lambda x: x.q[:, 1] * DEG},
    "a sign": {"trq_2": lambda x: -x.tau[:, 1]},
    "milliseconds": {"time": lambda x: x.t * 1e3},
    "nanoseconds since long ago": {"time": lambda x: np.round((x.t + 1000.0) * 1e9)},
    "exchanged torques": {"trq_1": lambda x: x.tau[:, 1], "trq_2": lambda x: x.tau[:, 0]},
    "a zero a quarter turn off": {"pos_1": lambda x: x.q[:, 0] - np.pi / 2},
    "milli-newton-metres": {
        "trq_1": lambda x: x.tau[:, 0] * 1e3,
        "trq_2": lambda x: x.tau[:, 1] * 1e3,
    },
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.slow
def test_units_signs_order_and_zeros_are_found_and_said(arm: Path, fault: str) -> None:
    one = recording(1)
    study, decisions = read_back(
        arm, as_logged(one, **{name: change(one) for name, change in FAULTS[fault].items()})
    )
    assert_same(study, one)
    plain = {"q", "tau", "use", "torque", "period"}
    said = [decision for decision in decisions if decision.subject not in plain]
    assert any(decision.subject in ("units and signs", "zeros", "t") for decision in said)


@pytest.mark.slow
def test_gears_that_are_given_bring_columns_to_the_joints_side(arm: Path) -> None:
    one, ratios = recording(1), np.array([32.0, -48.0])
    q, tau = one.q * ratios, one.tau / ratios
    columns = {"time": one.t, "m_pos_1": q[:, 0], "m_pos_2": q[:, 1]}
    columns |= {"m_trq_1": tau[:, 0], "m_trq_2": tau[:, 1]}
    data = written(arm.parent / "run.csv", columns)
    draft = draft_study(arm, [data], facts=LogFacts(gears=ratios.tolist()))
    assert "rotor_inertia" in draft.effects
    assert_same(di.load(draft.write(arm.parent / "study.toml")), one)
    with pytest.raises(RecordingError, match="one number for each of shoulder, elbow"):
        draft_study(arm, [data], facts=LogFacts(gears=[32.0]))
    with pytest.raises(RecordingError, match=r"--gears N1,N2 .*turns elbow too") as refused:
        draft_study(arm, [data])
    assert "--column 'q.elbow = (m_pos_2)/N2 - (m_pos_1)/N1'" in str(refused.value)


def test_held_commands_are_told_from_measured_torques(arm: Path) -> None:
    one = recording(2)
    slow = one.replace(t=one.t[::4], q=one.q[::4], v=None, a=None, tau=one.tau[::4])
    study, _ = read_back(arm, as_logged(slow))
    assert study.train.recordings[0].torque == "measured"
    # A command holds for the step that follows: its sample is the torque half a step later.
    late = np.stack([np.interp(slow.t + 0.02, one.t, x) for x in one.tau.T], 1)
    (arm.parent / "study.toml").unlink()
    study, _ = read_back(arm, as_logged(slow, trq_1=late[:, 0], trq_2=late[:, 1]))
    assert study.train.recordings[0].torque == "held_command"


@pytest.mark.slow
def test_recordings_are_held_out_by_name_or_by_turns(arm: Path) -> None:
    one = recording(1)
    folder = arm.parent
    named = [written(folder / f"{name}.csv", as_logged(one)) for name in ("train_a", "validation")]
    uses = [entry.use for entry in draft_study(arm, named).recordings]
    assert uses == ["train", "test"]
    plain = [written(folder / f"run{k}.csv", as_logged(one)) for k in range(5)]
    uses = [entry.use for entry in draft_study(arm, plain).recordings]
    assert uses == ["train", "train", "train", "test", "train"]


def test_whoever_is_asked_decides(arm: Path) -> None:
    one = recording(1)
    data = written(arm.parent / "run.csv", as_logged(one, trq_2=-one.tau[:, 1]))
    asked: list[Decision] = []

    def last(decision: Decision) -> int:
        asked.append(decision)
        return len(decision.choices) - 1

    draft = draft_study(arm, [data], ask=last)
    assert {"units and signs", "period"} <= {decision.subject for decision in asked}
    assert all(decision.is_open for decision in asked)
    said = tomllib.loads(draft.text(arm.parent))
    assert "period" not in said["recordings"][0]
    assert said["columns"]["tau.elbow"] == "trq_2"  # as recorded: the wrong sign was wanted


def test_names_of_files_and_columns_cannot_break_out_of_the_text(arm: Path) -> None:
    one = recording(1)
    columns = as_logged(one)
    columns['tau" = 1 # \t_1'] = columns.pop("trq_1")
    columns['tau" = 1 # \t_2'] = columns.pop("trq_2")
    data = written(arm.parent / 'odd "name" #1.csv', columns)
    study = di.load(draft_study(arm, [data]).write(arm.parent / "study.toml"))
    assert_same(study, one)


def test_files_with_other_columns_and_without_a_clock_are_refused(arm: Path) -> None:
    one = recording(1)
    folder = arm.parent
    first = written(folder / "a.csv", as_logged(one))
    other = written(folder / "b.csv", as_logged(one, extra=one.t))
    with pytest.raises(RecordingError, match="has no column 'extra'"):
        draft_study(arm, [first, other])
    columns = as_logged(one)
    del columns["time"]
    with pytest.raises(RecordingError, match="clock"):
        draft_study(arm, [written(folder / "c.csv", columns)])


def test_a_draft_that_cannot_be_loaded_leaves_what_was_there(arm: Path) -> None:
    data = written(arm.parent / "run.csv", as_logged(recording(1)))
    draft = draft_study(arm, [data])
    out = arm.parent / "study.toml"
    out.write_text("mine")
    data.unlink()
    with pytest.raises(DynidentError):
        draft.write(out)
    assert out.read_text() == "mine"
    assert sorted(path.name for path in arm.parent.iterdir()) == ["arm.urdf", "study.toml"]


def test_recordings_in_our_own_names_need_no_columns(arm: Path) -> None:
    path = arm.parent / "ours.csv"
    write(recording(1), path)
    assert "columns" not in tomllib.loads(draft_study(arm, [path]).text(arm.parent))


@pytest.mark.slow
def test_files_without_a_header_are_told_by_their_numbers(arm: Path) -> None:
    one = recording(3)
    v = np.gradient(one.q, one.t, axis=0)
    x = np.column_stack([one.t, one.q, v, one.tau])
    data = arm.parent / "bare.csv"
    np.savetxt(data, x, delimiter=",", fmt="%.17g")
    study = di.load(draft_study(arm, [data]).write(arm.parent / "study.toml"))
    assert_same(study, one)
    np.savetxt(data, x[:, 1:], delimiter=",", fmt="%.17g")
    draft = draft_study(arm, [data], facts=LogFacts(rate_hz=100.0))
    assert_same(di.load(draft.write(arm.parent / "study.toml")), one)


def test_patterns_stand_for_files_in_the_order_of_their_numbers(arm: Path) -> None:
    for k in (1, 2, 10):
        written(arm.parent / f"run{k}.csv", as_logged(recording(1)))
    draft = draft_study(arm, [str(arm.parent / "run*.csv")])
    assert [one.file.name for one in draft.recordings] == ["run1.csv", "run2.csv", "run10.csv"]


def test_currents_are_a_study_in_amperes_whose_gains_are_identified(arm: Path) -> None:
    one, gains = recording(1), np.array([25.0, -6.0])
    current = one.tau / gains
    columns = {"timestamp": one.t, "actual_q_0": one.q[:, 0], "actual_q_1": one.q[:, 1]}
    columns |= {"actual_current_0": current[:, 0], "actual_current_1": current[:, 1]}
    study, decisions = read_back(arm, columns)
    assert "A, the drives' own" in [one.words for one in decisions]
    assert study.drives is not None and "common scale" in study.drives.sentence
    # The description is right, and fixes the scale where nothing else does.
    np.testing.assert_allclose(study.drives.gains, gains, rtol=0.02)
    assert np.corrcoef(study.train.recordings[0].tau[:, 1], one.tau[:, 1])[0, 1] > 0.999
    text = (arm.parent / "study.toml").read_text()
    for line in ('# drive_gains = { "shoulder" = 10.0 }', "# [loads.tool]"):
        assert line in text
    shown = tomllib.loads(text)
    assert shown["torque_unit"] == "A" and shown["columns"]["tau.elbow"] == "actual_current_1"


def test_a_robot_on_the_ceiling_is_seen_to_be_one(arm: Path) -> None:
    robot = di.Robot.from_file(arm).with_gravity((0.0, 0.0, 9.81))
    one = recording(1)
    v = di.recording.central_difference(one.q, one.rate_hz)
    a = di.recording.central_difference(v, one.rate_hz)
    tau = robot.inverse_dynamics(one.q, v, a)
    study, decisions = read_back(arm, as_logged(one, trq_1=tau[:, 0], trq_2=tau[:, 1]))
    # In a plane it is one, too: that both are possible is what has to be said.
    (found,) = (one for one in decisions if one.subject in ("zeros", "gravity"))
    assert "gravity = [0, 0, 9.81] in the base's axes" in found.choices
    fit = di.fit(study.model, study.train)
    assert fit.error < 0.05


def test_torques_that_are_later_still_are_delayed_not_held(arm: Path) -> None:
    one = recording(2)
    late = np.concatenate([one.q[:1], one.q[:1], one.q[:-2]])
    study, decisions = read_back(arm, as_logged(one, pos_1=late[:, 0], pos_2=late[:, 1]))
    assert study.train.recordings[0].torque == "measured"
    assert any("samples later" in decision.reason for decision in decisions)


def test_speeds_tell_the_unit_of_the_clock_and_a_counter(arm: Path) -> None:
    one = recording(3)
    v = np.gradient(one.q, one.t, axis=0)
    counter = np.arange(one.samples, dtype=float)
    speeds = {"vel_1": v[:, 0], "vel_2": v[:, 1]}
    study, decisions = read_back(arm, as_logged(one, time=counter, **speeds))
    assert_same(study, one)
    assert any("samples at 100 Hz" in decision.words for decision in decisions)


def test_a_broken_cell_is_told_for_what_it_is(arm: Path) -> None:
    data = written(arm.parent / "run.csv", as_logged(recording(1)))
    lines = data.read_text().splitlines()
    lines[5] = lines[5].rpartition(",")[0] + ",oops"
    data.write_text("\n".join(lines))
    with pytest.raises(RecordingError, match="'oops' is not a number") as caught:
        draft_study(arm, [data])
    assert "line 6" in str(caught.value)


def test_a_file_that_is_named_twice_is_read_once(arm: Path) -> None:
    data = written(arm.parent / "run.csv", as_logged(recording(1)))
    assert len(draft_study(arm, [data, str(data)]).recordings) == 1


def test_folders_say_what_is_held_out_where_files_do_not(arm: Path) -> None:
    """As bags lie that are each a folder of their own, and recordings of train/ and test/."""
    files = []
    for seed, folder in enumerate(("test_a", "train_a", "train_b"), start=1):
        (arm.parent / folder / "run").mkdir(parents=True)
        files.append(written(arm.parent / folder / "run" / "run.csv", as_logged(recording(seed))))
    draft = draft_study(arm, files)
    (use,) = (one for one in draft.decisions if one.subject == "use")
    assert use.reason == "as the names of the folders say"
    study = di.load(draft.write(arm.parent / "study.toml"))
    assert len(study.train.recordings) == 2
    np.testing.assert_allclose(study.test.recordings[0].q, recording(1).q, atol=1e-9)


@pytest.mark.parametrize("cell", ["nan", ""])
@pytest.mark.parametrize("broken", ["pos_1", "trq_2", "time"])
def test_no_other_signal_is_taken_where_a_cell_is_broken(arm: Path, broken: str, cell: str) -> None:
    """References and commands are there, too, and were taken for what was measured."""
    one = recording(1)
    others = {"target_pos_1": one.q[:, 0], "target_pos_2": one.q[:, 1]}
    others |= {"cmd_trq_1": one.tau[:, 0], "cmd_trq_2": one.tau[:, 1]}
    whole = written(arm.parent / "a.csv", as_logged(one, **others))
    lines = whole.read_text().splitlines()
    cells = lines[700].split(",")
    cells[lines[0].split(",").index(broken)] = cell
    holed = arm.parent / "b.csv"
    holed.write_text("\n".join([*lines[:700], ",".join(cells), *lines[701:]]))
    for files in ([holed], [whole, holed]):
        with pytest.raises(RecordingError, match=rf"line 701, column {broken}"):
            draft_study(arm, files)


def test_where_only_the_clock_can_be_read_the_hole_is_told(arm: Path) -> None:
    columns = as_logged(recording(1))
    for name in columns.keys() - {"time"}:
        columns[name] = columns[name].copy()
        columns[name][400:420] = np.nan
    data = written(arm.parent / "run.csv", {"t": columns.pop("time"), **columns})
    with pytest.raises(RecordingError, match=r"line 402, column pos_1: 'nan' is not a finite"):
        draft_study(arm, [data])


def test_a_hole_in_a_file_without_a_header_moves_no_columns(arm: Path) -> None:
    columns = as_logged(recording(1), temp=np.full(1601, 30.0))
    rows = np.column_stack([columns["temp"], *list(columns.values())[:-1]])
    rows[700, 0] = np.nan
    np.savetxt(data := arm.parent / "run.txt", rows)
    with pytest.raises(RecordingError, match="line 701, column column1: 'nan' is not a finite"):
        draft_study(arm, [data])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_tables_of_numpy_are_told_by_their_numbers(arm: Path, kind: type) -> None:
    one = recording(1)
    rest = np.column_stack([np.cos(one.t), one.t])  # of no joint: left out, without a name
    rows = np.column_stack([one.t, rest[:, 0], one.q, one.tau])
    np.save(data := arm.parent / "run.npy", rows.astype(kind))
    draft = draft_study(arm, [data])
    found = di.load(draft.write(arm.parent / "study.toml")).train.recordings[0]
    np.testing.assert_allclose(found.q, one.q, atol=1e-6)
    np.testing.assert_allclose(found.tau, one.tau, rtol=1e-5, atol=1e-5)


def test_tables_that_lie_on_their_side_are_said_to(arm: Path) -> None:
    one = recording(1)
    np.savez(data := arm.parent / "run.npz", t=one.t, q=one.q.T, tau=one.tau.T)
    lies = r"it holds t; .*: q \(2 rows of \d+: one row a sample is needed\), tau"
    with pytest.raises(RecordingError, match=lies):
        draft_study(arm, [data])


def test_a_gap_that_no_study_could_hold_is_told_by_the_draft(arm: Path) -> None:
    columns = as_logged(recording(1))
    holed = {name: np.delete(x, range(500, 560)) for name, x in columns.items()}
    data = written(arm.parent / "run.csv", holed)
    with pytest.raises(
        RecordingError, match=r"row 500.*without samples follow.*split the recording"
    ):
        draft_study(arm, [data])
