"""Every unusable file gives one clear line, and nothing but a DynidentError."""

import pickle

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from dynident.errors import DynidentError, FileError, RecordingError
from dynident.recording import SUFFIXES, Column, read, write

GOOD = "t,q.a,tau.a\n0,1,2\n0.001,1,2\n0.002,1,2\n"
CSV = {
    "empty": (b"", "is empty"),
    "blank": (b"\n\n", "is empty"),
    "no rows": (b"t,q.a,tau.a\n", "a header but no samples"),
    "one row": (b"t,q.a,tau.a\n0,1,2\n", "holds 1 sample. a recording needs at least 2"),
    "no header": (b"0,1,2\n0.001,1,2\n", "line 1: the first line holds numbers"),
    "binary": (bytes(range(256)), "is not UTF-8 text"),
    "NUL": (GOOD.encode() + b"\0\0", "NUL"),
    "UTF-16": (GOOD.encode("utf-16"), "is not UTF-8 text"),
    "repeated column": (b"t,q.a,tau.a,q.a\n0,1,2,1\n", "line 1: the column 'q.a' is there 2 times"),
    "missing column": (
        GOOD.replace("tau.a", "Tau.a").encode(),
        r"no column 'tau.a'. it holds t, q.a, Tau.a; did you mean 'Tau.a'\?",
    ),
    "no torque": (
        b"t,q.a,v.a\n0,1,2\n1,1,2\n",  # the position is no slip of the pen for it
        r"no column 'tau.a'. it holds t, q.a, v.a$",
    ),
    "no time": (b"q.a,tau.a\n1,2\n1,2\n", r"no column 't'. .*; a file without times takes rate_hz"),
    "cut off": (GOOD.encode()[:-3], "line 4: 2 columns where the header has 3. is the file comp"),
    "too wide": (GOOD.replace("1,2\n", "1,2,3\n").encode(), "line 2: 4 columns where the header"),
    "uneven": (b"t,q.a,tau.a\n0,1\n1,2,3,4\n", "line 2: 2 columns"),
    "text": (GOOD.replace("1,2", "one,2").encode(), "line 2, column q.a: 'one' is not a number"),
    "empty cell": (GOOD.replace("002,1", "002,").encode(), "line 4, column q.a: the cell is empty"),
    "nan": (GOOD.replace("002,1", "002,nan").encode(), "line 4, column q.a: 'nan' is not a finite"),
    "too large": (GOOD.replace("002,1", "002,1e999").encode(), "line 4, .*'1e999' is not a finite"),
    "underscore": (GOOD.replace("002,1", "002,1_0").encode(), "line 4, .*'1_0' is not a number"),
    "comma": (b"t;q.a;tau.a\n0.5;1,5;2\n", "line 2, column q.a: '1,5' .* write a decimal point"),
    "quoted comma": (b't,q.a,tau.a\n0,"1,5",2\n', "column q.a: '1,5' .* write a decimal point"),
    "no units": (b"t,q.a,tau.a\ns,rad,furlong\n0,1,2\n", "line 2, column t: 's' is not a number"),
    "no date": (
        b"t,q.a,tau.a\n2026-03-05T10:00:00,1,2\n2026-02-30T10:00:00,1,2\n",
        "line 3, column t: '2026-02-30T10:00:00' is not a date and a time. write 2026-03-05T10:",
    ),
    "blank line": (b"t,q.a,tau.a\n0,1,2\n\n1,1,2\n", "line 3: the line is empty"),
    "time twice": (
        b"t,q.a,tau.a\n0,1,2\n0,1,2\n",
        r"row 2 \(line 3\), column t: the time stamp 0.0 s is there twice",
    ),
    "unsorted": (b"t,q.a,tau.a\n0,1,2\n2,1,2\n1,1,2\n", r"row 3 \(line 4\), column t: time goes b"),
    "open quote": (GOOD.replace("1,2", '"1,2', 1).encode(), "line|after"),
}


def refused(path, message, *arguments, **keywords):
    with pytest.raises(DynidentError, match=message) as caught:
        read(path, *arguments, **keywords)
    text = str(caught.value)
    assert path.name in text
    assert "\n" not in text
    assert len(text) < 600
    return caught.value


@pytest.mark.parametrize("kind", CSV)
def test_csv(tmp_path, kind):
    content, message = CSV[kind]
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    refused(path, message, ["a"])


def test_path(tmp_path):
    assert isinstance(refused(tmp_path / "none.csv", "no such file"), FileError)
    (tmp_path / "folder.npz").mkdir()
    refused(tmp_path / "folder.npz", "is a folder")
    (tmp_path / "run.doc").touch()
    refused(
        tmp_path / "run.doc",
        "'.doc' names no format. formats: .csv, .txt, .dat, .tsv, .npz, .mat, .parquet",
    )
    (tmp_path / "run").touch()
    refused(tmp_path / "run", "has no suffix")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", [b"", b"\x00" * 300, b"t,q\n", b"PK\x03\x04" + b"x" * 90])
def test_content_of_another_kind(tmp_path, suffix, content):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    refused(path, "is|no|cannot", ["a"])


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("share", [0.01, 0.3, 0.9, 0.999])
def test_truncated(arm, tmp_path, suffix, share):
    path = write(arm, tmp_path / f"cut{suffix}")
    content = path.read_bytes()
    content = content[: int(share * len(content))]
    # A text that ends between two numbers is all that tells a CSV file from a shorter one.
    path.write_bytes(content.rpartition(b",")[0] if suffix == ".csv" else content)
    refused(path, "complete|no column|not a number")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(data=st.data(), suffix=st.sampled_from(SUFFIXES))
def test_damaged_bytes_never_escape_as_another_error(arm, tmp_path, data, suffix):
    path = write(arm.cut(0, 0.1), tmp_path / f"bad{suffix}")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    try:
        read(path)
    except DynidentError as error:
        assert "\n" not in str(error)
    except Warning:
        pass


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("a file was unpickled",))


def test_npz(tmp_path):
    path = tmp_path / "bad.npz"
    t = np.arange(3.0)
    np.savez(path, **{"t": t, "q.a": np.array([Bomb()] * 3, dtype=object), "tau.a": t})
    refused(path, "'q.a' holds Python objects, which are never loaded")
    path.write_bytes(pickle.dumps([Bomb()]))
    refused(path, "is not an NPZ file")
    np.savez(path, **{"t": t, "q.a": t[:2], "tau.a": t})
    refused(path, "q.a has 2 samples where t has 3")
    np.savez(path, **{"t": t, "q.a": np.array(["x", "y", "z"]), "tau.a": t})
    refused(path, "'q.a' does not hold real numbers")
    np.savez(path, **{"t": t, "q.a": t + 1j, "tau.a": t})
    refused(path, "'q.a' does not hold real numbers")
    np.savez(path, **{"t": t, "q.a": np.ones((3, 2)), "tau.a": t})
    refused(path, r"'q.a' has the shape \(3, 2\), not \(T,\). map the columns, as q.a\[0\]")
    refused(path, r"has the shape \(3, 2\), and no column 5", ["a"], {"q.a": "q.a[5]"})
    np.savez(path, t=t, q=t)
    refused(path, "no column q.<joint>. it holds t, q")
    np.savez(path, t=np.float64(3), **{"q.a": t, "tau.a": t})  # pyright: ignore
    refused(path, r"'t' has the shape \(\)")


def test_mat(tmp_path):
    path = tmp_path / "bad.mat"
    t = np.arange(3.0)
    savemat(path, {"t": t, "q_a": {"x": t}, "tau_a": t})
    refused(path, r"no column 'q.a'. it holds t, q_a.x, tau_a", ["a"])
    savemat(path, {"t": t, "q_a": np.array([t, "x"], dtype=object), "tau_a": t})
    refused(path, "'q_a' does not hold real numbers", ["a"])
    savemat(path, {"t": t, "q_a": t})
    refused(path, "no column 'tau.a'. it holds t, q_a")
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(500))
    refused(path, r"version 7.3 \(HDF5\). save it in MATLAB with save\(..., '-v7'\)")
    savemat(path, {"t": t, "q_a": t + np.array([0, np.nan, 0]), "tau_a": t})
    refused(path, "row 2, column q.a: nan is not a finite number")


def test_parquet(tmp_path):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "bad.parquet"
    t = np.arange(3.0)
    parquet.write_table(pa.table({"t": t, "q.a": pa.array([1.0, None, 2.0]), "tau.a": t}), path)
    refused(path, "row 2, column q.a: nan is not a finite number")
    parquet.write_table(pa.table({"t": t, "q.a": ["x", "y", "z"], "tau.a": t}), path)
    refused(path, "'q.a' does not hold real numbers")
    parquet.write_table(pa.Table.from_arrays([pa.array(t)] * 3, ["t", "q.a", "q.a"]), path)
    refused(path, "the column 'q.a' is there 2 times")


def test_mapping(arm, tmp_path):
    path = write(arm, tmp_path / "run.csv")
    joints = arm.joints
    refused(
        path, "names 'q.elbo', which is not ours.*did you mean 'q.elbow'", joints, {"q.elbo": "x"}
    )
    refused(path, r"no column 'time' \(for t\). it holds t, q.shoulder", joints, {"t": "time"})
    refused(path, "no column 'q.wrist', 'tau.wrist'. it holds", ["elbow", "wrist"])
    refused(path, "no column 'a.elbow'.*did you mean", joints, {"a.shoulder": "v.shoulder"})
    refused(path, "3 kinds for 2 joints", joints, None, ["revolute"] * 3)
    for scale in (0.0, float("nan")):
        with pytest.raises(RecordingError, match=r"scale = .* of 'x'"):
            Column("x", scale)
    with pytest.raises(RecordingError, match="no name of a column"):
        Column("")
