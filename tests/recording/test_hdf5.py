"""HDF5 and MATLAB 7.3 files, as MATLAB writes them: by columns, text as numbers."""

import os
import sys

import numpy as np
import pytest

pytest.importorskip("h5py", reason="HDF5 needs the extra `hdf5`, which is a part of `test`")

import h5py  # pyright: ignore[reportMissingImports]

from dynident.errors import DynidentError, RecordingError
from dynident.recording import SIGNALS, open_table, read
from dynident.recording.formats import limits


def write_hdf5(path, arrays):
    with h5py.File(path, "w") as file:
        for name, x in arrays.items():
            file[name] = x
    return path


def write_mat(path, arrays):
    """As MATLAB writes version 7.3: a block before the file, arrays by columns, text as numbers."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, x in arrays.items():
            x = np.asarray(x)
            if x.dtype.kind == "U":
                width = max(map(len, x))
                codes = [[ord(one) for one in text.ljust(width)] for text in x]
                file[name] = np.array(codes, dtype=np.uint16).T
                file[name].attrs["MATLAB_class"] = np.bytes_("char")
            else:
                file[name] = np.atleast_2d(x.T if x.ndim > 1 else x)
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
    data = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + data[512:])
    return path


def columns_of(arm):
    found = {"t": arm.t}
    for signal in SIGNALS:
        x = getattr(arm, signal)
        if x is not None:
            found |= {f"{signal}.{joint}": x[:, i] for i, joint in enumerate(arm.joints)}
    return found


@pytest.mark.parametrize("suffix", [".h5", ".hdf5"])
def test_what_went_in_comes_out(arm, tmp_path, suffix):
    path = write_hdf5(tmp_path / f"run{suffix}", columns_of(arm))
    found = read(path, arm.joints)
    assert found.name == "run" and set(read(path).joints) == {*arm.joints}
    for signal in ("t", "q", "tau", "v", "q_ref"):
        np.testing.assert_array_equal(getattr(found, signal), getattr(arm, signal))


def test_groups_tables_and_records(arm, tmp_path):
    kind = [("t", "<f8"), ("current.a", "<f4")]
    records = np.zeros(arm.samples, dtype=kind)
    records["t"], records["current.a"] = arm.t, arm.tau[:, 1]
    path = write_hdf5(tmp_path / "run.h5", {"log/q": arm.q, "log/drive": records, "note": "x"})
    assert open_table(path).names == ("log/drive.t", "log/drive.current.a", "log/q", "note")
    mapping = {"t": "log/drive.t", "q.a": "log/q[1]", "tau.a": "log/drive.current.a"}
    found = read(path, ["a"], mapping)
    np.testing.assert_array_equal(found.q[:, 0], arm.q[:, 1])
    np.testing.assert_array_equal(found.tau[:, 0], arm.tau[:, 1].astype(np.float32))
    assert found.provenance.skipped == ("1 column: note",)
    with pytest.raises(RecordingError, match="'note' does not hold real numbers"):
        read(path, ["a"], mapping | {"q.a": "note"})


def test_matlab_73(arm, tmp_path):
    named = {name.replace(".", "_"): x for name, x in columns_of(arm).items()}
    found = read(write_mat(tmp_path / "run.mat", named), arm.joints)
    for signal in ("t", "q", "tau", "v", "q_ref"):
        np.testing.assert_array_equal(getattr(found, signal), getattr(arm, signal))
    path = write_mat(tmp_path / "table.mat", {"t": arm.t, "q": arm.q, "tau": arm.tau})
    found = read(path, ["a"], {"q.a": "q[1]", "tau.a": "tau[0]"})
    np.testing.assert_array_equal(found.q[:, 0], arm.q[:, 1])


def test_records_of_matlab_73(arm, tmp_path):
    """The names of their columns as a table of letters, or as a list of texts."""
    names = ["t", "q.a", "tau.long_name"]
    run = np.column_stack([arm.t, arm.q[:, 0], arm.tau[:, 0]])
    for name in ("table", "cells"):
        path = write_mat(tmp_path / f"{name}.mat", {"columns": names, "run0": run, "run1": run})
        if name == "cells":
            with h5py.File(path, "r+") as file:
                del file["columns"]
                for k, text in enumerate(names):
                    codes = np.array([[ord(one)] for one in text], dtype=np.uint16)
                    file[f"#refs#/{k}"] = codes
                held = [[file[f"#refs#/{k}"].ref for k in range(3)]]
                file.create_dataset("columns", data=held, dtype=h5py.ref_dtype)
                file["columns"].attrs["MATLAB_class"] = np.bytes_("cell")
        found = read(path, ["a"], {"tau.a": "tau.long_name"}, record="run1")
        np.testing.assert_array_equal(found.tau, arm.tau[:, :1])
        assert "1 other record" in found.provenance.skipped


def refused(path, message):
    with pytest.raises(DynidentError, match=message) as told:
        read(path, ["a"])
    assert "\n" not in str(told.value) and path.name in str(told.value)


@pytest.mark.slow
def test_unusable_files_are_one_line(tmp_path):
    path, t = tmp_path / "bad.h5", np.arange(3.0)
    write_hdf5(path, {"t": t, "q.a": t, "tau.a": t[:2]})
    refused(path, r"tau.a has 2 samples where t has 3")
    write_hdf5(path, {"t": t, "q.a": t * np.nan, "tau.a": t})
    refused(path, r"row 1, column q.a: nan is not a finite number")
    write_hdf5(path, {"t": t, "q.a": np.float64(1), "tau.a": t})
    refused(path, r"'q.a' has the shape \(\)")
    write_hdf5(path, {f"x{k}": 0.0 for k in range(limits.MOST_COLUMNS + 1)})
    refused(path, "holds 4097 data sets, and 4096 is the limit")
    with h5py.File(path, "w") as file:
        file["t"] = file["tau.a"] = t
        file.create_dataset("q.a", (1 << 40,), "f8", chunks=(1 << 20,), compression="gzip")
    refused(path, "unpacks to 8192 GB, and 1 GB is the limit")
    path.write_bytes(b"")
    refused(path, "is empty")
    os.mkfifo(tmp_path / "pipe.h5")
    refused(tmp_path / "pipe.h5", "is not a regular file")


def test_without_the_package_the_remedy_is_said(tmp_path, monkeypatch):
    t = np.arange(3.0)
    hdf5 = write_hdf5(tmp_path / "run.h5", {"t": t, "q.a": t, "tau.a": t})
    mat = write_mat(tmp_path / "run.mat", {"t": t, "q_a": t, "tau_a": t})
    monkeypatch.setitem(sys.modules, "h5py", None)
    refused(hdf5, r"HDF5 files need h5py. pip install 'dynident\[hdf5\]'")
    refused(mat, r"version 7.3 \(HDF5\). save it in MATLAB with save\(..., '-v7'\), or pip inst")


def test_nothing_is_read_from_other_files(tmp_path):
    t = np.arange(3.0)
    write_hdf5(tmp_path / "other.h5", {"x": t})
    path = tmp_path / "run.h5"
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", shape=(3,))
    with h5py.File(path, "w") as file:
        file["t"] = file["tau.a"] = t
        file.create_virtual_dataset("q.a", layout)
    refused(path, "'/q.a' lies in another file")
    with h5py.File(path, "w") as file:
        file["t"] = file["tau.a"] = t
        file["q.a"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "x")
    refused(path, r"no column 'q.a'. it holds t, tau.a")
    (tmp_path / "raw").write_bytes(t.tobytes())
    with h5py.File(path, "w") as file:
        file["t"] = file["tau.a"] = t
        file.create_dataset("q.a", (3,), "f8", external=[(str(tmp_path / "raw"), 0, 24)])
    refused(path, "'/q.a' lies in another file")


@pytest.mark.parametrize("write", [write_hdf5, write_mat])
def test_damaged_files_are_one_line(arm, tmp_path, write):
    path = tmp_path / ("run.mat" if write is write_mat else "run.h5")
    whole = write(path, columns_of(arm.cut(0, 0.2))).read_bytes()
    random = np.random.default_rng(2)
    for share in (0.01, 0.3, 0.9, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        refused(path, "cannot be read|is not|no column")
    for _ in range(40):
        data = bytearray(whole)
        for place in random.integers(0, 4000, 4):
            data[place] = random.integers(256)
        path.write_bytes(data)
        try:
            read(path, arm.joints)
        except DynidentError as error:
            assert "\n" not in str(error)
        except Warning:
            pass
