"""NPY files: tables whose columns are named by position, and arrays of records."""

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.recording import FileLayout, open_table, read
from dynident.recording.formats import column_table

ROWS = np.arange(60 * 5, dtype=float).reshape(60, 5)
ROWS[:, 0] = 0.004 * np.arange(60)
LAYOUT = FileLayout(names=("t", "q.a", "-", "tau.a", "q_ref.a"))


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("at_once", [1, 1 << 22])
@pytest.mark.parametrize("kind", [">f8", "<f8"])
def test_a_table_is_named_by_position(tmp_path, monkeypatch, order, at_once, kind):
    monkeypatch.setattr(column_table, "AT_ONCE", at_once)
    np.save(tmp_path / "run.npy", np.asarray(ROWS, dtype=kind, order=order))
    found = read(tmp_path / "run.npy", ["a"], layout=LAYOUT)
    np.testing.assert_array_equal(found.t, ROWS[:, 0])
    np.testing.assert_array_equal(found.q[:, 0], ROWS[:, 1])
    np.testing.assert_array_equal(found.tau[:, 0], ROWS[:, 3])
    assert found.q_ref is not None
    np.testing.assert_array_equal(found.q_ref[:, 0], ROWS[:, 4])
    assert found.provenance.skipped == ("1 column: one without a name",)
    parts = [*open_table(tmp_path / "run.npy", layout=LAYOUT).in_parts(["t"])]
    assert [len(one["t"]) for one in parts] == ([16, 16, 16, 12] if at_once == 1 else [60])


def test_fields_that_hold_all_joints_are_taken_apart(tmp_path):
    rows = np.zeros(60, [("t", "f4"), ("position", "f8", 2), ("effort", "f8", 2)])
    rows["t"], rows["position"], rows["effort"] = ROWS[:, 0], ROWS[:, 1:3], ROWS[:, 3:]
    np.save(tmp_path / "run.npy", rows)
    columns = {"q.a": "position[1]", "tau.a": "effort[0]"}
    found = read(tmp_path / "run.npy", ["a"], columns, layout=FileLayout(rate_hz=None))
    np.testing.assert_array_equal(found.q[:, 0], ROWS[:, 2])
    np.testing.assert_array_equal(found.tau[:, 0], ROWS[:, 3])


def test_fields_of_text_are_left_alone_and_named(tmp_path):
    kinds = [("t", "f8"), ("state", "U7"), ("q.a", "f8"), ("at", "M8[s]"), ("tau.a", "f4")]
    rows = np.zeros(60, kinds)
    rows["t"], rows["q.a"], rows["tau.a"] = ROWS[:, 0], ROWS[:, 1], ROWS[:, 3]
    rows["state"] = "running"
    np.save(tmp_path / "run.npy", rows)
    found = read(tmp_path / "run.npy", ["a"])
    np.testing.assert_array_equal(found.q[:, 0], ROWS[:, 1])
    np.testing.assert_array_equal(found.tau[:, 0], ROWS[:, 3])
    assert found.provenance.skipped == ("no numbers: state, at",)
    np.save(tmp_path / "run.npy", rows[["state", "at"]])
    with pytest.raises(RecordingError, match="the type"):
        read(tmp_path / "run.npy", ["a"])


@pytest.mark.parametrize(
    ("array", "layout", "said"),
    [
        (ROWS, FileLayout(), "have no names. *name them by position"),
        (ROWS, FileLayout(names=("t", "q.a")), "2 columns are named by position, and there are 5"),
        (ROWS[:0], LAYOUT, "holds no samples"),
        (ROWS[:, 0], LAYOUT, r"the shape \(60,\)"),
        (ROWS.astype(complex), LAYOUT, "the type complex128"),
        (np.array([{"a": 1}] * 3, dtype=object), FileLayout(), "the type object"),
        (np.zeros(3, [("t", "f8"), ("q", object)]), FileLayout(), "the type"),
        (np.zeros(3, [("t", "f8")]), LAYOUT, "the array's fields name the columns, and the study"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, array, layout, said):
    np.save(tmp_path / "run.npy", array)
    with pytest.raises(RecordingError, match=said):
        open_table(tmp_path / "run.npy", layout=layout)


def test_a_file_that_is_cut_short_or_something_else_is_refused(tmp_path):
    path = tmp_path / "run.npy"
    np.save(path, ROWS)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    with pytest.raises(RecordingError, match="ends before its array does"):
        open_table(path, layout=LAYOUT)
    # Said to be of more rows than any disk holds.
    path.write_bytes(whole.replace(b"(60, 5), }" + b" " * 12, b"(6000000000000, 5), }" + b" "))
    with pytest.raises(RecordingError, match="ends before its array does"):
        open_table(path, layout=LAYOUT)
    path.write_bytes(b"t,q.a,tau.a\n")
    with pytest.raises(RecordingError, match="cannot be read as an NPY file"):
        open_table(path, layout=LAYOUT)
