"""What a study file says is what the model and the recordings are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynident.errors import DynidentError, DynidentWarning, FileError, StudyError
from dynident.evidence import compare_models
from dynident.fitting import fit
from dynident.model import Model
from dynident.recording import Recording, suited_filter, write
from dynident.study import Study, load
from study_files import CONTROLLER, RATE_HZ, STUDY, edited, recording, reordered, write_study
from synthetic import ARM, arm, synthetic, true_values

CONTRACT = """
robot = "arm.urdf"
joints = ["shoulder", "elbow"]              # order of columns; default: every actuated joint
effects = ["rotor_inertia", "viscous_friction", "coulomb_friction", "stribeck_friction@elbow"]
torque = "held_command"                     # or "measured"
[[recordings]]
file = "run1.csv"
use = "train"                               # or "test"
period = 8.0                                # s, optional: the excitation repeats with this period
start = 0.0                                 # s, optional: when it began in the session (warm-up)
window = [0.0, 16.0]                        # s, optional: filtered as a whole, then cut
[filter]
position_cutoff_hz = 40.0                   # zero-phase low-pass of q before differentiation
cutoff_hz = 18.0                            # the same zero-phase low-pass on every column
rate_hz = 50.0                              # decimated to this
[noise]                                     # optional, per raw sample
position_std = [1e-5, 1e-5]
torque_std = [0.1, 0.05]
[controller]                                # optional; needed to simulate the loop
kind = "pd"                                 # u = kp (q_ref - q) + kd (v_ref - v)
kp = [3000.0, 1500.0]
kd = [120.0, 50.0]
velocity_reference = true                   # false: v_ref = 0
rate_hz = 1000.0
"""
"""The example of the contract, word for word but for its comments."""


@pytest.fixture(autouse=True)
def no_data_folder(monkeypatch):
    monkeypatch.delenv("DYNIDENT_DATA", raising=False)


@pytest.fixture
def study(tmp_path):
    """Write a study and load it."""

    def make(text: str = STUDY) -> Study:
        return load(write_study(tmp_path, text))

    return make


def estimate(study: Study) -> dict[str, float]:
    found = fit(study.model, study.train)
    return dict(zip(found.names, found.values, strict=True))


def assert_same(left: dict[str, float], right: dict[str, float], rtol: float = 1e-6) -> None:
    assert set(left) == set(right)
    for name, value in left.items():
        assert right[name] == pytest.approx(value, rel=rtol, abs=1e-9), name


# --- the contract -------------------------------------------------------------------------------


def test_the_example_of_the_contract(tmp_path):
    write_study(tmp_path)
    write(recording(0), tmp_path / "run1.csv")
    (tmp_path / "study.toml").write_text(CONTRACT)
    study = load(tmp_path / "study.toml")
    assert study.robot.names == ("shoulder", "elbow")
    assert [effect.label for effect in study.model.effects] == [
        *("rotor_inertia@shoulder", "rotor_inertia@elbow"),
        *("viscous_friction@shoulder", "viscous_friction@elbow"),
        *("coulomb_friction@shoulder", "coulomb_friction@elbow", "stribeck_friction@elbow"),
    ]
    (run,) = study.train.recordings
    assert (run.torque, run.use, run.period, run.start) == ("held_command", "train", 8.0, 0.0)
    assert run.window == (0.0, 16.0) and run.name == "run1.csv"
    assert not len(study.test)
    settings, noise, controller = study.train.filter, study.train.noise, study.controller
    assert settings is not None and noise is not None and controller is not None
    assert (settings.position_cutoff_hz, settings.cutoff_hz, settings.rate_hz) == (40.0, 18.0, 50.0)
    assert noise.position_std.tolist() == [1e-5, 1e-5] and noise.torque_std.tolist() == [0.1, 0.05]
    assert (controller.kind, controller.rate_hz) == ("pd", 1000.0)
    assert controller.kp == (3000.0, 1500.0) and controller.velocity_reference
    compared = compare_models({"study": study.model}, study.train, study.test)
    assert compared.results[0].error < 0.1 and compared.results[0].floor is not None


CONTROLLERS = {
    "cascade": 'kind = "cascade"\nkp = [20.0, 20.0]\nkv = 5.0\n',
    "pid": 'kind = "pid"\nkp = 100.0\nki = 10.0\nkd = [5.0, 1.0]\n',
    "computed_torque": 'kind = "computed_torque"\nkp = 100.0\nkd = 20.0\n',
    "pd": 'kind = "pd"\nkp = 100.0\nkd = 20.0\nvelocity_reference = false\n',
}
SETTINGS = (
    "delay_s = 0.002\nlimit = [80.0, 40.0]\nderivative_cutoff_hz = 60.0\nfeedforward = true\n"
)


@pytest.mark.parametrize("settings", ["", "rate_hz = 500.0\n" + SETTINGS])
@pytest.mark.parametrize("kind", CONTROLLERS)
def test_every_controller_of_the_contract(study, kind, settings):
    controller = study(f"{STUDY}[controller]\n{CONTROLLERS[kind]}{settings}").controller
    assert controller is not None and controller.kind == kind and controller.n == 2
    if settings:
        assert controller.limit == (80.0, 40.0) and controller.rate_hz == 500.0
        assert controller.delay_s == 0.002 and controller.derivative_cutoff_hz == 60.0
        assert controller.feedforward
    else:
        assert controller.rate_hz is None and controller.limit is None
        assert controller.delay_s == 0.0 and not controller.feedforward


def test_only_robot_and_recordings_are_needed(study):
    made = study('robot = "arm.urdf"\n[[recordings]]\nfile = "train.csv"\n')
    assert made.robot.names == ("shoulder", "elbow") and made.model.effects == ()
    (run,) = made.train.recordings
    assert (run.use, run.torque, run.period, run.window) == ("train", "measured", None, None)
    assert made.train.filter == suited_filter(made.train.recordings)
    assert made.train.noise is None and made.controller is None
    assert not len(made.test)


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("position_cutoff_hz = 30.0", (30.0, 13.5, 37.5)),
        ("rate_hz = 20.0", (40.0, 7.2, 20.0)),
        ("cutoff_hz = 18.0", (36.0, 18.0, None)),
        ('position_cutoff_hz = 30.0\ncutoff_hz = "none"', (30.0, None, None)),
        ('position_cutoff_hz = "none"', (None, None, None)),
        ('position_cutoff_hz = 30.0\nends = "keep"', (30.0, None, None)),
        ('position_cutoff_hz = 30.0\nrate_hz = 20.0\ndecimation = "chebyshev"', (30.0, None, 20.0)),
    ],
)
def test_a_filter_asks_of_the_torque_what_the_positions_can_tell(study, table, expected):
    """What is left out suits what is stated; a recipe that is stated whole is followed as it is."""
    made = study(f"{STUDY}[filter]\n{table}\n").train.filter
    assert made is not None
    assert (made.position_cutoff_hz, made.cutoff_hz, made.rate_hz) == pytest.approx(expected)


def test_edges_alone_leave_the_filter_as_it_is_by_default(study):
    made = study(f"{STUDY}[filter]\nedge_s = [0.1, 0.1]\n").train
    usual = suited_filter(made.recordings)
    assert made.filter == replace(usual, edge_s=(0.1, 0.1))


def test_paths_are_relative_to_the_file(tmp_path, monkeypatch):
    path = write_study(tmp_path / "here")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert load(path).robot.names == load(Path("../here/study.toml")).robot.names


# --- robot and effects --------------------------------------------------------------------------


def test_an_effect_without_joint_stands_for_every_joint(study):
    everywhere = study(edited(('["viscous_friction"]', '["viscous_friction", "joint_coupling"]')))
    assert [effect.label for effect in everywhere.model.effects] == [
        *("viscous_friction@shoulder", "viscous_friction@elbow"),
        *("joint_coupling@shoulder:elbow", "joint_coupling@elbow:shoulder"),
    ]
    one = study(edited(('["viscous_friction"]', '["viscous_friction@elbow", "payload"]')))
    assert [effect.label for effect in one.model.effects] == ["viscous_friction@elbow", "payload"]


def test_names_of_joints_may_hold_colons(tmp_path):
    path = write_study(tmp_path)
    labels = '"viscous_friction@arm::elbow", "joint_coupling@arm::elbow:shoulder"'
    path.write_text(edited(('"viscous_friction"', labels), ('"elbow"', '"arm::elbow"')))
    for name in ("arm.urdf", "train.csv", "test.csv"):
        file = tmp_path / name
        file.write_text(file.read_text().replace("elbow", "arm::elbow"))
    viscous, coupling = load(path).model.effects
    assert (viscous.joint, viscous.source) == ("arm::elbow", None)
    assert (coupling.joint, coupling.source) == ("arm::elbow", "shoulder")


def test_the_order_of_joints_is_only_an_order(study, tmp_path):
    """Columns of the file, joints of the study, joints of the robot: three orders, one answer."""
    straight = study()
    turned = study(edited(('["shoulder", "elbow"]', '["elbow", "shoulder"]')))
    assert turned.robot.names == turned.train.recordings[0].joints == ("elbow", "shoulder")
    reordered(recording(0), ("elbow", "shoulder"), tmp_path / "train.csv")
    both = load(tmp_path / "study.toml")
    q, v, a = straight.robot.random_motion(0, 100)

    def torque(one: Study) -> np.ndarray:
        """Of a motion given in the order of `straight`, and back in that order."""
        order = [straight.robot.names.index(name) for name in one.robot.names]
        found = fit(one.model, one.train)
        moved = [x[:, order] for x in (q, v, a)]
        block = one.model.block(np.arange(100.0), *moved)
        return one.model.torque(block, found.values)[:, np.argsort(order)]

    # Which combinations serve as base parameters depends on the order; what they predict does not.
    for other in (turned, both):
        np.testing.assert_allclose(torque(other), torque(straight), rtol=1e-6, atol=1e-6)


def test_a_choice_of_joints_locks_the_others(study):
    made = study(edited(('["shoulder", "elbow"]', '["elbow"]')))
    assert made.robot.names == ("elbow",) and made.train.recordings[0].n == 1
    assert made.robot.locked == ("shoulder",)


def test_friction_width_of_some_joints(study):
    line = "friction_width = { elbow = 0.05 }\n[[recordings]]"
    made = study(STUDY.replace("[[recordings]]", line, 1))
    assert made.model.friction_width == (0.01, 0.05)
    with pytest.raises(StudyError, match="no joint 'elbo'"):
        study(STUDY.replace("[[recordings]]", line.replace("elbow", "elbo"), 1))


def test_gravity_and_friction_width(study):
    made = study("gravity = [0.0, 0.0, -1.62]\nfriction_width = 0.2\n" + STUDY)
    assert made.robot.gravity.tolist() == [0.0, 0.0, -1.62]
    assert made.model.friction_width == 0.2
    assert study().robot.gravity.tolist() == [0.0, 0.0, -9.81]


# --- recordings ---------------------------------------------------------------------------------


def test_a_file_may_appear_several_times(study):
    """Windows are filtered as a whole, then cut: two halves are the whole, row by row."""
    text = STUDY[: STUDY.index("[[")]
    entry = '[[recordings]]\nfile = "train.csv"\nuse = "{}"\nwindow = [{}, {}]\n'
    whole = study(text + '[[recordings]]\nfile = "train.csv"\n')
    halves = study(text + entry.format("train", 0, 8) + entry.format("train", 8, 17))
    assert [run.window for run in halves.train.recordings] == [(0.0, 8.0), (8.0, 17.0)]
    first, second = halves.train.recordings
    assert first.q is second.q, "the file is read once"
    assert_same(estimate(whole), estimate(halves), 1e-9)

    held_out = study(text + entry.format("train", 0, 8) + entry.format("test", 8, 17))
    assert len(held_out.train) == len(held_out.test) == 1
    assert estimate(held_out) != estimate(whole)


def test_settings_of_each_entry(study):
    entry = '[[recordings]]\nfile = "test.csv"\n'
    made = study(STUDY + entry + "start = 120.0\n" + entry + 'use = "test"\npayload = true\n')
    assert [run.start for run in made.train.recordings] == [0.0, 120.0]
    assert [run.period for run in made.train.recordings] == [8.0, None]
    assert [run.payload for run in made.test.recordings] == [None, True]
    assert [run.name for run in made.test.recordings] == ["test.csv", "test.csv"]
    assert all(run.provenance.file.endswith("test.csv") for run in made.test.recordings)


def test_columns_of_other_names_and_units(study, tmp_path):
    """Degrees, milliseconds and a drive's units, through scales."""
    straight = estimate(study())
    made = recording(0)
    gain = 0.037
    lines = ["time_ms,axis 1,axis 2,current 1,current 2,spare"]
    for t, q, tau in zip(made.t, made.q, made.tau, strict=True):
        cells = (1e3 * t, *np.rad2deg(q), tau[0], tau[1] / gain, 7.0)
        lines.append(",".join(f"{x:.12g}" for x in cells))
    (tmp_path / "train.csv").write_text("\n".join(lines) + "\n")
    text = STUDY[: STUDY.rindex("[[recordings]]")] + (
        "[columns]\n"
        't = { name = "time_ms", scale = 1e-3 }\n'
        '"q.shoulder" = { name = "axis 1", scale = 0.017453292519943295 }\n'
        '"q.elbow" = { name = "axis 2", scale = 0.017453292519943295 }\n'
        '"tau.shoulder" = "current 1"\n'
        f'"tau.elbow" = {{ name = "current 2", scale = {gain} }}\n'
    )
    (tmp_path / "study.toml").write_text(text)
    assert_same(straight, estimate(load(tmp_path / "study.toml")), 1e-4)


def test_a_column_without_quotes_is_explained(study):
    with pytest.raises(StudyError, match=r'columns: .*quotes: "q.elbow" = '):
        study(STUDY + '[columns]\nq.elbow = "angle"\n')


def test_degrees_without_a_scale_are_suspected(study, tmp_path):
    path = write_study(tmp_path)
    made = recording(0)
    write(made.replace(q=np.rad2deg(made.q)), tmp_path / "train.csv")
    with pytest.warns(DynidentWarning, match=r"train.csv, column q\.\w+: .*in degrees"):
        load(path)


def held(made: Recording) -> Recording:
    """The same torque as a command held from sample to sample, which the motion follows."""
    # Between two samples a drive that follows the torque puts out its mean over the interval.
    middle = (made.tau[:-1] + made.tau[1:]) / 2
    return made.replace(tau=np.vstack([middle, made.tau[-1:]]))


def test_held_commands_act_until_the_next_sample(tmp_path):
    """Taken as measured, a held command seems to lead by half a sample."""
    path = write_study(tmp_path, edited(('["viscous_friction"]', TRUE_EFFECTS)))
    for seed, name in ((0, "train.csv"), (1, "test.csv")):
        write(held(recording(seed)), tmp_path / name)
    wrong = fit_error(load(path))
    path.write_text(path.read_text().replace('"measured"', '"held_command"'))
    assert {run.torque for run in load(path).train.recordings} == {"held_command"}
    assert fit_error(load(path)) < 0.4 * wrong


TRUE_EFFECTS = '["viscous_friction", "coulomb_friction@elbow"]'


def fit_error(study: Study) -> float:
    return fit(study.model, study.train).error


def test_every_format_of_recording_is_the_same(study, tmp_path):
    """CSV, NPZ, MAT and Parquet of one recording give one estimate."""
    write_study(tmp_path)
    found = []
    for suffix in (".csv", ".npz", ".mat", ".parquet"):
        write(recording(0), tmp_path / f"train{suffix}")
        (tmp_path / "study.toml").write_text(edited(("train.csv", f"train{suffix}")))
        found.append(estimate(load(tmp_path / "study.toml")))
    for other in found[1:]:
        assert_same(found[0], other)


# --- where the data lies ------------------------------------------------------------------------


def test_data_beside_the_study_comes_first(tmp_path, monkeypatch):
    """Then DYNIDENT_DATA, then shared/data beside the project."""
    path = write_study(tmp_path / "project" / "problems" / "arm")
    beside = path.parent / "train.csv"
    named = tmp_path / "data" / "train.csv"
    shared = tmp_path / "shared" / "data" / "train.csv"
    for place in (named, shared):
        place.parent.mkdir(parents=True)
        place.write_bytes(beside.read_bytes())
    monkeypatch.setenv("DYNIDENT_DATA", str(named.parent))

    def found() -> Path:
        return Path(load(path).train.recordings[0].provenance.file)

    assert found() == beside.resolve()
    beside.unlink()
    assert found() == named
    monkeypatch.delenv("DYNIDENT_DATA")
    assert found() == shared.resolve()
    shared.unlink()
    with pytest.raises(FileError, match=r"train.csv: no such data file. .*DYNIDENT_DATA"):
        load(path)


def test_an_empty_variable_is_no_folder(tmp_path, monkeypatch):
    path = write_study(tmp_path / "here")
    (tmp_path / "here" / "train.csv").rename(tmp_path / "train.csv")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DYNIDENT_DATA", "")
    with pytest.raises(FileError, match="no such data file"):
        load(path)


def test_one_number_stands_for_every_joint(study):
    noise = "[noise]\nposition_std = 1e-5\ntorque_std = 1\n"
    made = study(STUDY + noise + edited(("[120.0, 50.0]", "80"), text=CONTROLLER))
    assert made.train.noise is not None and made.controller is not None
    assert made.train.noise.position_std.tolist() == [1e-5, 1e-5]
    assert made.train.noise.torque_std.tolist() == [1.0, 1.0]
    assert made.controller.kd == (80.0, 80.0)


def test_a_recording_shorter_than_its_neighbours_is_named(tmp_path):
    path = write_study(tmp_path)
    write(recording(1).cut(0.0, 5.0), tmp_path / "test.csv")
    study = load(path)
    assert study.test.recordings[0].samples == round(5.0 * RATE_HZ)
    with pytest.raises(DynidentError, match=r"test.csv: .*no two periods of 8 s"):
        compare_models({"study": study.model}, study.train, study.test)


def test_criteria_of_a_study_are_its_own(study) -> None:
    assert study().criteria.changed == ()
    (changed,) = study(STUDY + "[criteria.gates]\nlevel = 0.005\n").criteria.changed
    assert (changed.name, changed.value) == ("gates.level", 0.005)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[criteria.gates]\nlevl = 1", "unknown criterion 'gates.levl'. did you mean 'level'?"),
        ("[criteria.gate]\nlevel = 1", "unknown group 'gate'. did you mean 'gates'?"),
        ("[criteria.gates]\nlevel = -1", "gates.level: -1 is out of its range"),
        ("[criteria]\ngates = 3", "gates: a table is needed here"),
    ],
)
def test_criteria_that_make_no_sense_are_refused(study, table: str, message: str) -> None:
    with pytest.raises(StudyError) as refused:
        study(STUDY + table + "\n")
    assert "study.toml: criteria: " in str(refused.value) and message in str(refused.value)


def test_one_entry_may_name_several_files(tmp_path):
    """They share what the entry says, and are numbered as if each had an entry of its own."""
    path = write_study(tmp_path)
    (tmp_path / "train.csv").rename(tmp_path / "train_10.csv")
    (tmp_path / "train_9.csv").write_bytes((tmp_path / "train_10.csv").read_bytes())
    for file in (
        '"train_*.csv"',
        '["train_9.csv", "train_10.csv"]',
        '["train_9.csv", "t*_10.csv"]',
    ):
        path.write_text(STUDY.replace('"train.csv"', file))
        study = load(path)
        assert [one.name for one in study.train.recordings] == ["train_9.csv", "train_10.csv"]
        assert [one.period for one in study.train.recordings] == [8.0, 8.0]
        numbers = [one.number for one in (*study.train.recordings, *study.test.recordings)]
        assert numbers == [1, 2, 3]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ('file = "none_*.csv"', r"none_\*.csv: no file matches. check the pattern"),
        ("file = []", r"recordings.0: file = \[\] names no file"),
        ('file = "t*.csv"\nrecord = "a"', r"record = 'a' is of one file, and 2 are named"),
        ('file = "train.csv"\nrate_hz = 1e9', r"recordings.0.rate_hz: .*less than or equal"),
        (
            'file = "train.csv"\nrate_hz = 100.0',
            "rate_hz = 100 is given, and the file has a",
        ),
        ('file = "train.csv"\ncolumns = ["t"]', "the first line names the columns, and the"),
    ],
)
def test_entries_that_fit_no_file(tmp_path, entry, message):
    path = write_study(tmp_path)
    path.write_text(STUDY.replace('file = "train.csv"', entry))
    with pytest.raises(DynidentError, match=message) as told:
        load(path)
    assert "\n" not in str(told.value)


def test_a_study_of_files_without_names_and_time(tmp_path):
    """Headers and the time are taken out, and said by the study: nothing else changes."""
    path = write_study(tmp_path)
    before = load(path)
    for name in ("train", "test"):
        header, *rows = (tmp_path / f"{name}.csv").read_text().splitlines()
        names = header.split(",")[1:]
        (tmp_path / f"{name}.csv").write_text("\n".join(row.partition(",")[2] for row in rows))
        said = f'file = "{name}.csv"\ncolumns = {names}\nrate_hz = 100.0'
        path.write_text(path.read_text().replace(f'file = "{name}.csv"', said))
    after = load(path)
    for one, other in zip(before.train.recordings, after.train.recordings, strict=True):
        np.testing.assert_allclose(one.t - one.t[0], other.t, atol=1e-9)
        np.testing.assert_array_equal(one.tau, other.tau)


@pytest.mark.parametrize(("of_test", "expected"), [((500.0, 1e-6), 80.0), ((500.0, 1e-3), 40.0)])
def test_training_and_test_recordings_have_one_filter(tmp_path, of_test, expected):
    both = _behind_encoders(tmp_path, (500.0, 1e-6), of_test)
    assert both.train.filter == both.test.filter == suited_filter(_every(both))
    assert both.train.filter is not None and both.train.filter.position_cutoff_hz == expected


def test_recordings_of_very_different_rates_have_each_their_own(tmp_path):
    both = _behind_encoders(tmp_path, (1000.0, 1e-6), (100.0, 1e-6))
    assert both.train.filter is None and both.test.filter is None
    assert len(compare_models({"one": both.model}, both.train, both.test).results) == 1


def _every(study):
    return (*study.train.recordings, *study.test.recordings)


def _behind_encoders(folder, *of):
    """A study of an arm that trains with recordings of a rate and noise, and tests with others."""
    model = Model(arm()) + "viscous_friction"
    for use, (rate, std) in zip(("train", "test"), of, strict=True):
        made = synthetic(model, true_values(model), 1, rate_hz=rate, position_std=std)
        write(made, folder / f"{use}.csv")
    (folder / "arm.urdf").write_text(ARM)
    entries = "".join(f'[[recordings]]\nfile = "{u}.csv"\nuse = "{u}"\n' for u in ("train", "test"))
    path = folder / "study.toml"
    path.write_text(f'robot = "arm.urdf"\neffects = ["viscous_friction"]\n{entries}')
    return load(path)
