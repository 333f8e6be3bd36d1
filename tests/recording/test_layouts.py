"""Files that do not say everything of themselves: no header line, no time; many files at once."""

import numpy as np
import pytest

from dynident.data_files import find_all, natural_order
from dynident.errors import DynidentError, FileError, RecordingError
from dynident.recording import FileLayout, Recording, open_table, read, write

T = np.arange(6) * 0.01
ROWS = np.column_stack([T, 10 * T, 100 * T, np.ones(6)])
NAMED = FileLayout(names=("t", "q.a", "-", "tau.a"))


def text(rows, separator=","):
    return "\n".join(separator.join(repr(float(x)) for x in row) for row in rows) + "\n"


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "   ", ", "])
@pytest.mark.parametrize("times", [1, 4000])
def test_columns_are_named_by_position(tmp_path, separator, times):
    """Both by the reader of small files and by that of large ones."""
    rows = np.tile(ROWS, (times, 1))
    rows[:, 0] = np.arange(len(rows)) * 0.01
    (tmp_path / "log.csv").write_text(text(rows, separator))
    recording = read(tmp_path / "log.csv", ["a"], layout=NAMED)
    np.testing.assert_array_equal(recording.t, rows[:, 0])
    np.testing.assert_array_equal(recording.q[:, 0], rows[:, 1])
    np.testing.assert_array_equal(recording.tau[:, 0], rows[:, 3])
    assert recording.provenance.skipped == ("1 column: one without a name",)
    assert recording.row(0).endswith("log.csv, row 1 (line 1)")


@pytest.mark.parametrize("header", ["", "t q.a other tau.a"])
def test_tables_that_numpy_writes(tmp_path, header):
    np.savetxt(tmp_path / "log.csv", ROWS, header=header)
    recording = read(tmp_path / "log.csv", ["a"], layout=FileLayout() if header else NAMED)
    np.testing.assert_array_equal(recording.q[:, 0], ROWS[:, 1])
    np.testing.assert_array_equal(recording.tau[:, 0], ROWS[:, 3])


def test_a_rate_takes_the_place_of_the_time(tmp_path):
    np.savez(tmp_path / "log.npz", q=np.column_stack([T, T]), tau=np.ones((6, 2)))
    columns = {"q.a": "q[1]", "tau.a": "tau[0]", "t": "time"}
    recording = read(tmp_path / "log.npz", ["a"], columns, layout=FileLayout(rate_hz=125.0))
    np.testing.assert_array_equal(recording.t, np.arange(6) / 125.0)
    table = open_table(tmp_path / "log.npz", layout=FileLayout(rate_hz=50.0))
    assert table.names == ("t", "q", "tau")
    np.testing.assert_array_equal(table.load(["t"])["t"], np.arange(6) / 50.0)


def test_a_rate_beside_a_time_is_refused(tmp_path, arm):
    path = write(arm, tmp_path / "run.csv")
    with pytest.raises(RecordingError, match="rate_hz = 125 is given, and the file has a column"):
        read(path, layout=FileLayout(rate_hz=125.0))
    path.write_text(path.read_text().replace("t,", "time,", 1))
    with pytest.raises(RecordingError, match="and 'time' is the column of time"):
        read(path, arm.joints, {"t": "time"}, layout=FileLayout(rate_hz=125.0))
    assert read(path, arm.joints, layout=FileLayout(rate_hz=250.0)).rate_hz == pytest.approx(250)


@pytest.mark.parametrize("rate", [0.0, -5.0, 1e9, 1e-300, float("nan"), float("inf"), "fast"])
def test_a_rate_of_no_robot_is_refused(rate):
    with pytest.raises(RecordingError, match=r"rate_hz = .*give samples a second"):
        FileLayout(rate_hz=rate)


def test_names_that_do_not_fit_the_file(tmp_path, arm):
    path = tmp_path / "log.csv"
    path.write_text(text(ROWS))
    with pytest.raises(RecordingError, match=r"line 1: 2 columns are named .* and there are 4"):
        read(path, ["a"], layout=FileLayout(names=("t", "q.a")))
    with pytest.raises(RecordingError, match=r"the column 'q.a' is there 2 times"):
        read(path, ["a"], layout=FileLayout(names=("t", "q.a", "q.a", "tau.a")))
    with pytest.raises(RecordingError, match="is no list of names"):
        FileLayout(names="t, q.a")  # pyright: ignore[reportArgumentType]
    with pytest.raises(RecordingError, match=r"the first line holds numbers.*by position"):
        read(path, ["a"])
    with pytest.raises(RecordingError, match="the first line names the columns, and the study"):
        read(write(arm, tmp_path / "run.csv"), ["a"], layout=NAMED)
    with pytest.raises(RecordingError, match="only text files"):
        read(write(arm, tmp_path / "run.npz"), ["a"], layout=NAMED)
    path.write_text(text(ROWS) + "1,2,3\n")
    with pytest.raises(RecordingError, match=r"line 7: 3 columns where the first line has 4"):
        read(path, ["a"], layout=NAMED)
    path.write_text(text(ROWS) + "1,2,3,x\n")
    with pytest.raises(RecordingError, match=r"line 7, column tau.a: 'x' is not a number"):
        read(path, ["a"], layout=NAMED)


def test_any_file_opens_as_the_table_that_it_is(tmp_path, arm):
    (tmp_path / "log.csv").write_text(text(ROWS))
    numbered = FileLayout(names="numbered")
    table = open_table(tmp_path / "log.csv", layout=numbered)
    assert table.names == ("column1", "column2", "column3", "column4")
    np.testing.assert_array_equal(table.load(["column2"])["column2"], ROWS[:, 1])
    for suffix in (".csv", ".npz", ".mat"):
        table = open_table(write(arm, tmp_path / f"run{suffix}"), layout=numbered)
        assert table.names[:2] == ("t", "q_shoulder" if suffix == ".mat" else "q.shoulder")
        assert len(table.load(["t"])["t"]) == arm.samples


def test_what_is_not_read_is_said(tmp_path, arm):
    path = write(arm, tmp_path / "run.csv")
    path.write_text("\n".join(f"x,{line}" for line in path.read_text().splitlines()))
    assert read(path).provenance.skipped == ("1 column: x",)
    assert read(path, ["elbow"]).provenance.skipped == (
        "5 columns: x, q.shoulder, tau.shoulder, v.shoulder, q_ref.shoulder",
    )


def test_numbers_put_names_in_order():
    names = ["run_10.csv", "run_9.csv", "run_09b.csv", "run.csv", "2.csv", "run_1_3", "run_1_20"]
    ordered = ["2.csv", "run.csv", "run_1_3", "run_1_20", "run_9.csv", "run_09b.csv", "run_10.csv"]
    assert sorted(names, key=natural_order) == ordered
    assert natural_order("9" * 5000)


def test_patterns(tmp_path, monkeypatch):
    (tmp_path / "runs").mkdir()
    for name in ("a2.csv", "a10.csv", "a1.csv", "b.csv", "c[1].csv"):
        (tmp_path / "runs" / name).touch()
    found = find_all("runs/a*.csv", tmp_path)
    assert list(found) == ["runs/a1.csv", "runs/a2.csv", "runs/a10.csv"]
    assert all(path.samefile(tmp_path / name) for name, path in found.items())
    assert list(find_all("runs/c[1].csv", tmp_path)) == ["runs/c[1].csv"]
    assert list(find_all(str(tmp_path / "runs" / "[ab]?.csv"), tmp_path / "runs")) == [
        str(tmp_path / "runs" / name) for name in ("a1.csv", "a2.csv")
    ]
    monkeypatch.setenv("DYNIDENT_DATA", str(tmp_path / "runs"))
    assert list(find_all("a*.csv", tmp_path)) == ["a1.csv", "a2.csv", "a10.csv"]
    for pattern, message in (
        ("z*.csv", "no file matches"),
        ("/*/*/*/*/*.csv", "more than 3 folders"),
        ("a\0*.csv", "NUL"),
        ("a\0.csv", "NUL"),
    ):
        with pytest.raises(FileError, match=message) as told:
            find_all(pattern, tmp_path)
        assert "\0" not in str(told.value)


def test_jittered_time_of_one_column_is_still_checked(tmp_path):
    rows = ROWS.copy()
    rows[3, 0] = 0.0
    (tmp_path / "log.csv").write_text(text(rows))
    with pytest.raises(DynidentError, match=r"row 4 \(line 4\), column t: time goes back"):
        read(tmp_path / "log.csv", ["a"], layout=NAMED)


def test_recordings_made_by_hand_are_as_before():
    assert Recording(T, T, T, ("a",)).provenance.skipped == ()
