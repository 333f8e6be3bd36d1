import hashlib
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from dynident.errors import DynidentWarning, FileError, RecordingError
from dynident.recording import SUFFIXES, Column, Recording, open_table, read, write
from dynident.recording.recording import LARGEST

SIGNALS = ("q", "tau", "v", "q_ref")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip_keeps_every_digit(arm, tmp_path, suffix):
    path = write(arm, tmp_path / f"run{suffix}")
    for joints in (None, ("shoulder", "elbow")):
        again = read(path, joints)
        assert again.joints == arm.joints
        np.testing.assert_array_equal(again.t, arm.t)
        for signal in SIGNALS:
            np.testing.assert_array_equal(getattr(again, signal), getattr(arm, signal))
        assert again.a is None
    assert again.name == "run"
    assert again.provenance.file == str(path)
    assert again.provenance.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_joints_come_in_the_order_asked_for(arm, tmp_path, suffix):
    path = write(arm, tmp_path / f"run{suffix}")
    one = read(path, ["elbow"])
    np.testing.assert_array_equal(one.q[:, 0], arm.q[:, 1])
    swapped = read(path, ["elbow", "shoulder"])
    np.testing.assert_array_equal(swapped.tau, arm.tau[:, ::-1])


@given(
    values=st.lists(st.floats(-0.9 * LARGEST, 0.9 * LARGEST), min_size=2, max_size=6),
    name=st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1),
)
@pytest.mark.slow
def test_csv_keeps_any_double_and_any_name(tmp_path_factory, values, name):
    t = np.arange(len(values), dtype=float)
    recording = Recording(t * 1e-3, values, values[::-1], (name,))
    again = read(write(recording, tmp_path_factory.mktemp("csv") / "run.csv"), [name])
    np.testing.assert_array_equal(again.q, recording.q)
    np.testing.assert_array_equal(again.tau, recording.tau)


def test_other_names_units_and_columns(tmp_path):
    t = np.arange(9) * 1e-3
    np.savez(tmp_path / "log.npz", ms=t * 1e3, deg=np.outer(t, [1, 2]), i=np.outer(t, [3, 4]))
    recording = read(
        tmp_path / "log.npz",
        ["a", "b"],
        {
            "t": Column("ms", 1e-3),
            "q.a": Column("deg[0]", np.pi / 180),
            "q.b": Column("deg[1]", np.pi / 180),
            "tau.a": "i[0]",
            "tau.b": Column("i[1]", -2.0),
        },
    )
    np.testing.assert_allclose(recording.t, t)
    np.testing.assert_allclose(recording.q, np.deg2rad(np.outer(t, [1, 2])))
    np.testing.assert_allclose(recording.tau, np.outer(t, [3, -8]))


def test_csv_dialects_and_extra_columns(tmp_path):
    path = tmp_path / "run.csv"
    expected = [[0.0, 1.0], [0.5, 2.0]]
    for text in (
        "t,note,q.a,tau.a\n0,start,1,3\n0.5,,2,4\n",
        "t;note;q.a;tau.a\r\n0;x;1;3\r\n0.5;y;2;4",
        "\ufefft\tq.a\ttau.a\n0\t1\t3\n0.5\t2\t4\n\n",
        't, "q.a", tau.a\n 0, 1, 3\n"0.5",2,4\n',
        "t,q.a,tau.a,\n0,1,3,\n.5,2e0,+4,\n",
    ):
        path.write_bytes(text.encode())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DynidentWarning)
            recording = read(path)
        assert recording.joints == ("a",)
        np.testing.assert_array_equal(np.column_stack([recording.t, recording.q[:, 0]]), expected)
        np.testing.assert_array_equal(recording.tau[:, 0], [3, 4])


def test_mat_names_and_row_vectors(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    t = np.arange(4) * 0.01
    content = {"t": t[None], "q_joint_1": t[:, None], "tau_joint_1": t, "pulses_N": [1.0]}
    scipy_io.savemat(tmp_path / "a.mat", content)
    assert read(tmp_path / "a.mat", ["joint-1"]).samples == 4
    assert read(tmp_path / "a.mat").joints == ("joint_1",)


def test_names_that_matlab_cannot_tell_apart(arm, tmp_path):
    twins = arm.replace(joints=("a-b", "a_b"))
    with pytest.raises(RecordingError, match=r"q.a-b and q.a_b would both be .*'q_a_b'"):
        write(twins, tmp_path / "twins.mat")
    with pytest.raises(RecordingError, match="too long"):
        write(arm.replace(joints=("a" * 70, "b")), tmp_path / "long.mat")
    assert not list(tmp_path.iterdir())


def test_unknown_suffix_and_missing_folder(arm, tmp_path):
    with pytest.raises(RecordingError, match=r"'.xls' names no format. formats: .csv, .npz"):
        write(arm, tmp_path / "run.xls")
    with pytest.raises(FileError, match="cannot be written"):
        write(arm, tmp_path / "none" / "run.csv")


@pytest.mark.parametrize(
    ("change", "kinds", "message"),
    [
        ({"t": 1e3}, None, "are the time stamps in ms"),
        ({"q": 180 / np.pi}, ("revolute", "revolute"), "in degrees"),
        ({"q": 1e3, "v": 1e3}, ("prismatic", "prismatic"), "in mm"),
        ({"v": 180 / np.pi}, None, "57.3 times the derivative of q"),
        ({"v": -1.0}, None, "opposite sign"),
    ],
)
def test_numbers_that_do_not_look_like_si(arm, tmp_path, change, kinds, message):
    scaled = arm.replace(period=None)
    for key, scale in change.items():
        scaled = scaled.replace(**{key: getattr(scaled, key) * scale})
    path = write(scaled, tmp_path / "run.npz")
    with pytest.warns(DynidentWarning, match=message):
        read(path, kinds=kinds)


def test_si_units_pass_without_a_warning(arm, tmp_path):
    path = write(arm, tmp_path / "run.npz")
    for kind in ("revolute", "prismatic"):
        assert read(path, kinds=(kind, kind)).n == 2


def test_fields_of_structures_of_matlab_are_columns(arm, tmp_path):
    """As `save` writes `log.t`, `log.joints.q` and `log.joints.tau`, with a text beside."""
    joints = {"q": arm.q, "tau": arm.tau}
    log = {"t": arm.t, "joints": joints, "who": "a robot"}
    savemat(path := tmp_path / "run.mat", {"log": log, "rate": 100.0})
    table = open_table(path)
    assert set(table.names) == {"log.t", "log.joints.q", "log.joints.tau", "log.who", "rate"}
    columns = {"t": "log.t"}
    for k, joint in enumerate(arm.joints):
        columns |= {f"{x}.{joint}": f"log.joints.{x}[{k}]" for x in ("q", "tau")}
    again = read(path, arm.joints, columns)
    np.testing.assert_array_equal(again.q, arm.q)
    np.testing.assert_array_equal(again.tau, arm.tau)
