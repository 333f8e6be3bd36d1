"""What is too large, never ends or is no file at all is refused before it takes time or memory."""

import os
import tracemalloc

import numpy as np
import pytest
from scipy.io import savemat

from dynident import files
from dynident.errors import DynidentError, FileError, RecordingError
from dynident.recording import SUFFIXES, open_table, read
from dynident.recording.formats import limits
from dynident.recording.formats.arrays import mat_file
from dynident.recording.formats.text import csv_file
from dynident.robot import Robot
from dynident.settings import SettingsTable, read_toml

MB = 1 << 20


def refused(match, call, *arguments):
    """One line, and little memory."""
    tracemalloc.start()
    with pytest.raises(DynidentError, match=match) as caught:
        call(*arguments)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 200 * MB
    assert "\n" not in str(caught.value) and "\0" not in str(caught.value)
    return caught.value


READERS = {
    "robot": Robot.from_file,
    "settings": lambda path: read_toml(path, SettingsTable),
    "hash": files.sha256,
}


@pytest.mark.parametrize("reader", READERS)
def test_only_regular_files_are_read(tmp_path, reader):
    os.mkfifo(tmp_path / "pipe.urdf")
    (tmp_path / "zero.urdf").symlink_to("/dev/zero")
    (tmp_path / "folder.urdf").mkdir()
    for name, message in (
        ("pipe.urdf", "is not a regular file"),
        ("zero.urdf", "is not a regular file"),
        ("folder.urdf", "is a folder"),
        ("none.urdf", "no such file"),
        ("a\0b.urdf", "its name holds a NUL character"),
        ("x" * 300 + ".urdf", "cannot be read"),
    ):
        assert isinstance(refused(message, READERS[reader], tmp_path / name), FileError)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_only_regular_recordings_are_read(tmp_path, suffix):
    os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / f"zero{suffix}").symlink_to("/dev/zero")
    (tmp_path / f"folder{suffix}").mkdir()
    for name in ("pipe", "zero"):
        refused("is not a regular file", read, tmp_path / f"{name}{suffix}")
    refused("is a folder", read, tmp_path / f"folder{suffix}")
    refused("NUL", read, tmp_path / f"a\0{suffix}")
    large = tmp_path / f"large{suffix}"
    with large.open("wb") as stream:
        stream.truncate(100_000 * MB)  # a hole: it takes no place on the disk
    told = refused("holds 97.66 GB, and 64 GB is the limit", read, large)
    assert told.remedy and "cut it" in told.remedy


def test_a_document_has_a_limit(tmp_path):
    with (tmp_path / "large.urdf").open("wb") as stream:
        stream.truncate(100 * MB)
    refused("holds 100 MB, and 64 MB is the limit", Robot.from_file, tmp_path / "large.urdf")


def test_an_archive_is_not_unpacked_to_see_that_it_is_too_large(tmp_path, monkeypatch):
    path, samples = tmp_path / "bomb.npz", 5 * MB
    np.savez_compressed(path, **{name: np.zeros(samples) for name in ("t", "q.a", "tau.a")})  # pyright: ignore
    assert path.stat().st_size < MB
    monkeypatch.setattr(limits, "ARRAYS", limits.SizeLimit(2 << 30, 100 * MB))
    monkeypatch.setattr(np.lib.format, "read_array", lambda *_, **__: pytest.fail("unpacked"))
    told = refused("unpacks to 120 MB, and 100 MB is the limit", read, path)
    assert told.remedy == limits.CUT


def test_what_a_matlab_file_says_of_its_size_is_not_trusted(tmp_path, monkeypatch):
    path, x = tmp_path / "bomb.mat", np.zeros(2 * MB)
    savemat(path, {"t": x, "q_a": x, "tau_a": x}, do_compression=True)
    data = path.read_bytes()
    assert len(data) < MB
    monkeypatch.setattr(mat_file, "ARRAYS", limits.SizeLimit(1 << 30, 10 * MB))
    refused("unpacks to 48 MB, and 10 MB is the limit", read, path)
    assert 10 * MB < mat_file._unpacked_mat(data) <= 26 * MB  # it stops where it is too much


def test_many_columns_are_refused_at_once(tmp_path):
    names = [f"q.{k}" for k in range(100_000)]
    path = tmp_path / "wide.csv"
    path.write_text(",".join(names) + "\n" + ",".join(["0"] * 100_000) + "\n")
    refused("holds 100000 columns, and 4096 is the limit", read, path)
    np.savez(tmp_path / "wide.npz", **{name: np.zeros(1) for name in names[:5000]})  # pyright: ignore
    refused("holds 5000 arrays, and 4096 is the limit", open_table, tmp_path / "wide.npz")


def test_as_many_columns_as_are_allowed_are_read(tmp_path):
    joints = [f"j{k}" for k in range(limits.MOST_COLUMNS // 2 - 1)]
    header = ["t", *(f"q.{j}" for j in joints), *(f"tau.{j}" for j in joints)]
    rows = [",".join([str(k / 100), *["0.5"] * (len(header) - 1)]) for k in range(3)]
    (tmp_path / "wide.csv").write_text("\n".join([",".join(header), *rows]))
    assert read(tmp_path / "wide.csv").n == len(joints)


def test_no_memory_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_text("t,q.a,tau.a\n0,1,2\n1,1,2\n")

    def none_left(*_, **__):
        raise MemoryError

    monkeypatch.setattr(csv_file, "_fast", none_left)
    with pytest.raises(RecordingError, match=r"a.csv: does not fit into memory. cut it into"):
        read(tmp_path / "a.csv")
