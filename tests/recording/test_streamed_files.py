"""Files that are read some rows at a time: the same recording, and nothing left behind."""

import gc
import os
import sys
import tempfile
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dynident.errors import FileError, RecordingError
from dynident.recording import (
    Column,
    FileLayout,
    Recording,
    open_table,
    read,
    spooled,
    write,
)
from dynident.recording.formats import file_source
from dynident.recording.formats.text import text_pieces

SUFFIXES = (".csv", ".npy", ".npz", ".parquet", ".h5")
SIGNALS = ("t", "q", "tau", "v", "q_ref")
SAMPLES = 1001


@pytest.fixture
def run() -> Recording:
    rng = np.random.default_rng(3)
    t = 0.004 * np.arange(SAMPLES)
    q, tau, v = (rng.normal(size=(SAMPLES, 3)) for _ in range(3))
    return Recording(t, q, tau, ("a", "b", "c"), v=v, q_ref=q + 1e-9, name="run")


@pytest.fixture
def in_small_parts(monkeypatch, tmp_path):
    """Every file counts as large: read as it lies, 7 kB at a time, and put into mapped files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setattr(file_source, "WHOLE", 0)
    monkeypatch.setattr(spooled, "IN_MEMORY", 0)
    read_at_once(monkeypatch, 7000)
    return folder


def read_at_once(monkeypatch, size: int) -> None:
    for name in ("text.text_pieces", "column_table", "arrays.npz_file", "arrays.hdf5_file"):
        monkeypatch.setattr(f"dynident.recording.formats.{name}.AT_ONCE", size)


def file_of(run: Recording, path: Path) -> Path:
    """Write a recording in any format."""
    if path.suffix in (".h5", ".npy"):
        return file_with(columns_of(run), path)
    return write(run, path)


def file_with(columns: dict[str, np.ndarray], path: Path) -> Path:
    """Write columns in any format."""
    if path.suffix == ".csv":
        rows = zip(*(x.tolist() for x in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        path.write_text("\n".join(lines))
    if path.suffix == ".npy":
        kinds = [(name, x.dtype, x.shape[1:]) for name, x in columns.items()]
        rows = np.empty(len(next(iter(columns.values()))), kinds)
        for name, x in columns.items():
            rows[name] = x
        np.save(path, rows)
    if path.suffix == ".npz":
        np.savez(path, **columns)  # pyright: ignore[reportArgumentType]
    if path.suffix == ".parquet":
        pytest.importorskip("pyarrow")
        pd.DataFrame(columns).to_parquet(path, row_group_size=300)
    if path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            for name, x in columns.items():
                file.create_dataset(name, data=x, chunks=(min(777, len(x)),), compression="gzip")
    return path


def columns_of(run: Recording) -> dict[str, np.ndarray]:
    found = {"t": run.t}
    for signal in SIGNALS[1:]:
        x = getattr(run, signal)
        if x is not None:
            found |= {f"{signal}.{joint}": x[:, i] for i, joint in enumerate(run.joints)}
    return found


def same(found: Recording, expected: Recording, scale: float = 1.0) -> None:
    for signal in SIGNALS:
        x = getattr(expected, signal)
        np.testing.assert_array_equal(getattr(found, signal), scale * x if signal == "tau" else x)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_bit_is_read(run, tmp_path, suffix, in_small_parts):
    path = file_of(run, tmp_path / f"run{suffix}")
    parts = [*open_table(path).in_parts(["t", "q.a", "tau.c"])]
    assert len(parts) > 2 and sum(len(one["t"]) for one in parts) == SAMPLES
    found = read(path)
    same(found, run)
    assert isinstance(spooled_owner(found.q), np.memmap) and not found.q.flags.writeable
    assert found.provenance.place.startswith(f"mapped from files in {in_small_parts}")
    # Other joints, names, units and a window are asked for as of any file.
    columns = {"tau.c": Column("tau.c", 35.15), "q.c": "q.c + q.a - q.a*1"}
    some = read(path, ["c", "a"], columns)
    assert some.joints == ("c", "a")
    np.testing.assert_array_equal(some.tau[:, 0], 35.15 * run.tau[:, 2])
    np.testing.assert_array_equal(some.cut(1.0, 2.0).q, run.select(["c", "a"]).cut(1.0, 2.0).q)


def spooled_owner(x: np.ndarray):
    """The mapped array that a view is of."""
    while not isinstance(x, np.memmap) and isinstance(x.base, np.ndarray):
        x = x.base
    return x


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_it_is_what_is_read_into_memory(run, tmp_path, suffix, request):
    path = file_of(run, tmp_path / f"run{suffix}")
    before = read(path)
    assert not before.provenance.place
    request.getfixturevalue("in_small_parts")
    same(read(path), before)
    assert read(path).provenance.sha256 == before.provenance.sha256


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_rate_in_the_place_of_a_clock(run, tmp_path, suffix, in_small_parts):
    columns = {name: x for name, x in columns_of(run).items() if name != "t"}
    path = file_with(columns, tmp_path / f"run{suffix}")
    found = read(path, layout=FileLayout(rate_hz=250.0))
    np.testing.assert_array_equal(found.t, np.arange(SAMPLES) / 250.0)
    np.testing.assert_array_equal(found.tau, run.tau)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("rows", [400, 409, 437, SAMPLES])
def test_tables_in_an_archive(tmp_path, order, rows, in_small_parts):
    """Whatever the order in memory and the number of rows, also of those in the last part."""
    rng = np.random.default_rng(rows)
    table = np.asarray(rng.normal(size=(rows, 5)), order=order)
    t = np.arange(rows) / 100
    np.savez_compressed(tmp_path / "run.npz", t=t[None, :], x=table)
    found = read(tmp_path / "run.npz", ["a"], {"q.a": "x[4]", "tau.a": "x[0] - 2*x[1]"})
    np.testing.assert_array_equal(found.t, t)
    np.testing.assert_array_equal(found.q[:, 0], table[:, 4])
    np.testing.assert_array_equal(found.tau[:, 0], table[:, 0] + -2.0 * table[:, 1])
    many = {"run0": np.column_stack([t, table]), "columns": np.array(list("tabcde"))}
    np.savez(tmp_path / "many.npz", **many)  # pyright: ignore[reportArgumentType]
    one = read(tmp_path / "many.npz", ["a"], {"q.a": "a", "tau.a": "e"}, record="run0")
    np.testing.assert_array_equal(one.tau[:, 0], table[:, 4])


@pytest.mark.parametrize("kind", ["fields", "lying", "matlab"])
def test_tables_in_hdf5(run, tmp_path, kind, in_small_parts):
    h5py = pytest.importorskip("h5py")
    columns = columns_of(run)
    path, mapping = tmp_path / "run.h5", {}
    with h5py.File(path, "w") as file:
        if kind == "fields":
            packed = np.empty(SAMPLES, [(name, "f8") for name in columns])
            for name, x in columns.items():
                packed[name] = x
            file["log"] = packed
            mapping = {name: f"log.{name}" for name in columns}
        for name, x in columns.items() if kind == "lying" else ():
            file[name] = x[None, :]
        if kind == "matlab":
            table = np.column_stack([*columns.values()])
            file["log"] = table.T  # there, the first index runs fastest
            file["log"].attrs["MATLAB_class"] = np.bytes_(b"double")
            mapping = {name: f"log[{k}]" for k, name in enumerate(columns)}
    same(read(path, run.joints, mapping), run)


def test_arrays_of_unlike_lengths_are_told(run, tmp_path, in_small_parts):
    columns = columns_of(run) | {"q.b": run.q[:-3, 1]}
    np.savez(tmp_path / "run.npz", **columns)  # pyright: ignore[reportArgumentType]
    with pytest.raises(RecordingError, match=r"q\.b has 998 samples where t has 1001"):
        read(tmp_path / "run.npz")


ENDS = {
    "unix": (b"\n", b""),
    "windows": (b"\r\n", b"\r\n\r\n"),
    "old": (b"\r", b"\r \r"),
    "blanks": (b" \n", b"\n \n\n"),
}


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("size", [3000, 3001, 3002, 7000])
def test_lines_of_any_kind_are_cut_between_them(run, tmp_path, end, size, request, monkeypatch):
    line, last = ENDS[end]
    path = write(run, tmp_path / "run.csv")
    path.write_bytes(path.read_bytes().rstrip(b"\n").replace(b"\n", line) + last)
    request.getfixturevalue("in_small_parts")
    monkeypatch.setattr(text_pieces, "AT_ONCE", size)
    same(read(path), run)


@pytest.mark.parametrize("row", [1, 400, SAMPLES - 1])
def test_the_line_of_a_bad_cell_is_told(run, tmp_path, row, in_small_parts):
    path = write(run, tmp_path / "run.csv")
    lines = path.read_text().splitlines()
    for bad, message in (
        (lines[row].replace(",", ",x", 1), r"'x[-0-9.e]*' is not a number"),
        ("", "the line is empty"),
        (lines[row].rpartition(",")[0], "12 columns where the header has 13"),
        (f'{lines[row]},"a\n\nb"', "14 columns where the header has 13"),
    ):
        path.write_text("\n".join([*lines[:row], bad, *lines[row + 1 :], lines[-1]]) + "\n")
        with pytest.raises(RecordingError, match=message) as caught:
            read(path)
        later = 2 if "\n" in bad else 0
        assert f"line {row + 1 + later}" in str(caught.value)
    # A clock that goes back is found across parts.
    swapped = [*lines[:400], lines[401], lines[400], *lines[402:]]
    path.write_text("\n".join(swapped) + "\n")
    with pytest.raises(RecordingError, match=r"time goes back.*"):
        read(path)


def test_text_over_several_lines_in_a_column_of_no_use(run, tmp_path, in_small_parts):
    lines = write(run, tmp_path / "run.csv").read_text().splitlines()
    noted = [f'"note\n\n{"of, some words" if k % 3 else ""}",{x}' for k, x in enumerate(lines)]
    noted[0] = f"note,{lines[0]}"
    (tmp_path / "run.csv").write_text("\n".join(noted))
    same(read(tmp_path / "run.csv"), run)


def test_letters_are_counted_from_the_start(run, tmp_path, in_small_parts):
    path = write(run, tmp_path / "run.csv")
    data = bytearray(path.read_bytes())
    data[30_000] = 0xFF
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"is not UTF-8 text \(byte 30000\)"):
        read(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
@pytest.mark.slow
def test_a_truncated_file_is_one_line_and_leaves_nothing(
    run, tmp_path, suffix, share, in_small_parts
):
    path = file_of(run, tmp_path / f"run{suffix}")
    data = path.read_bytes()
    size = int(share * len(data))
    # A text file that ends with a whole number in its last column looks complete.
    size = data.rindex(b"\n", 0, size) + 30 if suffix == ".csv" else size
    path.write_bytes(data[:size])
    with pytest.raises(RecordingError, match="is the file complete"):
        read(path)
    gc.collect()
    assert descriptors_in(in_small_parts) == 0


def test_an_array_that_ends_too_early_is_told(run, tmp_path, in_small_parts):
    path = file_of(run, tmp_path / "run.npz")
    again = tmp_path / "short.npz"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(again, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data[:-1000] if name == "tau.c.npy" else data)
    with pytest.raises(RecordingError, match="the data end before the array does"):
        read(again)


def test_a_file_that_changes_meanwhile_is_refused(run, tmp_path, in_small_parts):
    path = file_of(run, tmp_path / "run.npz")
    table = open_table(path)
    write(run.replace(tau=2 * run.tau), path)
    with pytest.raises(FileError, match="changed while it was read"):
        table.load(["t"])


def test_a_full_disk_is_one_line_and_leaves_nothing(run, tmp_path, in_small_parts, monkeypatch):
    """The system refuses what is beyond a size, as it does where there is no room."""
    resource = pytest.importorskip("resource")
    signal = pytest.importorskip("signal")
    path = file_of(run, tmp_path / "run.csv")
    # Python would cut its own bytecode short, and other tests would read that.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    limit, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (15_000, most))
        with pytest.raises(RecordingError, match=r"cannot be put into .* \(File too large, at"):
            read(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
        signal.signal(signal.SIGXFSZ, handler)
    assert descriptors_in(in_small_parts) == 0
    same(read(path), run)  # there is room again


def descriptors_in(folder) -> int:
    """Names in a folder, and files of it that this process has open or mapped, named or not."""
    links = []
    for one in os.listdir("/proc/self/fd"):
        try:
            links.append(os.readlink(f"/proc/self/fd/{one}"))
        except OSError:
            continue
    with open("/proc/self/maps") as maps:
        links += maps.read().splitlines()
    return len(os.listdir(folder)) + sum(str(folder) in one for one in links)


@pytest.mark.skipif(not os.path.exists("/proc/self/maps"), reason="only Linux tells")
def test_nothing_is_left_once_the_recording_is_gone(run, tmp_path, in_small_parts):
    found = read(file_of(run, tmp_path / "run.npz"))
    assert os.listdir(in_small_parts) == []  # the files have no names
    part = found.part(slice(10, 20))
    assert descriptors_in(in_small_parts) > 0
    del found
    gc.collect()
    np.testing.assert_array_equal(part.q, run.q[10:20])  # held by what is left of it
    del part
    gc.collect()
    assert descriptors_in(in_small_parts) == 0


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.slow
def test_memory_is_that_of_a_part(tmp_path, suffix, monkeypatch):
    """A file of 12 MB takes a few of them, and its samples are on the disk."""
    rng = np.random.default_rng(0)
    q = rng.normal(size=(100_000, 7)).round(3)
    run = Recording(np.arange(len(q)) / 1e3, q, q, tuple("abcdefg"))
    path = file_with(columns_of(run), tmp_path / f"run{suffix}")
    monkeypatch.setattr(spooled, "IN_MEMORY", 1 << 20)
    monkeypatch.setattr(file_source, "WHOLE", 1 << 20)
    read_at_once(monkeypatch, 1 << 18)
    read(path)  # all is imported
    tracemalloc.start()
    found = read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_array_equal(found.q, q)
    assert peak < 6 << 20
