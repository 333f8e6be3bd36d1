"""Hostile files of data, in every format."""

from __future__ import annotations

import codecs
import gzip
import io
import os
import pickle
import warnings
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from hostile.case import ANSWER, Content, HostileCase, folder, hole, link_to
from study_files import csv_text, edited, recording

LINES = csv_text(0).splitlines()


def csv(change) -> str:
    lines = list(LINES)
    change(lines)
    return "\n".join(lines) + "\n"


def cell(row: int, column: int, text: str) -> str:
    def change(lines):
        cells = lines[row].split(",")
        cells[column] = text
        lines[row] = ",".join(cells)

    return csv(change)


def still(columns: slice) -> str:
    """Columns that hold their first value throughout."""

    def change(lines):
        first = lines[1].split(",")
        for row in range(2, len(lines)):
            cells = lines[row].split(",")
            cells[columns] = first[columns]
            lines[row] = ",".join(cells)

    return csv(change)


def each(change: Callable[[int, list[str]], list[str]]) -> str:
    """Every row of numbers changed, given its number from 0 and its cells."""
    rows = (",".join(change(k, line.split(","))) for k, line in enumerate(LINES[1:]))
    return "\n".join([LINES[0], *rows]) + "\n"


EVERYWHERE = {
    "empty": ("", r"train.csv: is empty. is the file complete"),
    "header only": (LINES[0] + "\n", r"train.csv: holds a header but no samples"),
    "no header": ("\n".join(LINES[1:]), r"train.csv, line 1: the first line holds numbers"),
    "NaN": (cell(7, 1, "nan"), r"line 8, column q.shoulder: 'nan' is not a finite number"),
    "text": (cell(7, 2, "n/a"), r"line 8, column q.elbow: 'n/a' is not a number"),
    "no cell": (cell(7, 2, ""), r"line 8, column q.elbow: the cell is empty"),
    "missing column": (
        csv_text(0).replace("tau.elbow", "torque.elbow"),
        r"no column 'tau.elbow'. it holds t, q.shoulder, .*did you mean 'torque.elbow'",
    ),
    "unsorted": (
        csv(lambda lines: lines.insert(3, lines.pop(9))),
        r"train.csv, row \d \(line \d\), column t: time goes back",
    ),
    "time twice": (
        csv(lambda lines: lines.insert(3, lines[3])),
        r"row 4 \(line 5\), column t: the time stamp 0.02 s is there twice",
    ),
    "number beyond measure": (cell(7, 3, "1e200"), r"column tau.shoulder: 1e\+200 is beyond any"),
    "clock of another unit": (
        each(lambda k, cells: [f"{k}e-9", *cells[1:]]),
        r"train.csv: samples at 1e\+09 Hz are too many for .*are the time stamps in s\?",
    ),
    "one sample": ("\n".join(LINES[:2]), r"holds 1 sample. a recording needs at least 2"),
    "too short": ("\n".join(LINES[:10]), r"train.csv: .*(few|nothing is left)"),
    "shorter than the filter": ("\n".join(LINES[:40]), r"train.csv: "),
    "cut off": ("\n".join(LINES)[:-12], r"(columns where the header has|is the file complete)"),
    "never moves": (still(slice(1, 3)), r"train.csv: the robot does not move. record a motion"),
    "zero torque": (
        each(lambda _, cells: [*cells[:3], "0", "0"]),
        r"train.csv: the torque is zero throughout",
    ),
}
"""Content of `train.csv`, which three commands meet."""


class Trap:
    """What must never be unpickled."""

    def __reduce__(self):
        return (os.abort, ())


@cache
def columns() -> dict[str, np.ndarray]:
    """The recording by its columns."""
    made = recording(0)
    found = {"t": made.t}
    for i, joint in enumerate(made.joints):
        found |= {f"q.{joint}": made.q[:, i], f"tau.{joint}": made.tau[:, i]}
    return found


def npz(**changes: Any) -> Callable[[Path], object]:
    """An archive with other columns."""

    def make(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez(stream, **{**columns(), **changes})

    return make


def raw_npz(*members: tuple[str, bytes]) -> bytes:
    """An archive of any members."""
    stream = io.BytesIO()
    with (
        warnings.catch_warnings(action="ignore"),
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, data in members:
            archive.writestr(name, data)
    return stream.getvalue()


def npy(header: str, data: bytes = b"") -> bytes:
    """An array file with any header."""
    text = header.encode("latin-1")
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data


def one_npy(header: str, data: bytes = b"") -> bytes:
    """An archive whose column of time has any header."""
    good = io.BytesIO()
    np.save(good, np.zeros(3))
    rest = [(f"{name}.npy", good.getvalue()) for name in columns() if name != "t"]
    return raw_npz(("t.npy", npy(header, data)), *rest)


def parquet(**changes: Any) -> Callable[[Path], object]:
    """A Parquet file with other columns."""

    def make(path: Path) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        parquet.write_table(pa.table({**columns(), **changes}), path)

    return make


def mat(**changes: Any) -> Callable[[Path], object]:
    """A MATLAB file with other columns; dots in their names are underscores."""

    def make(path: Path) -> None:
        from scipy.io import savemat

        found = {**columns(), **changes}
        savemat(path, {name.replace(".", "_"): x for name, x in found.items()})

    return make


def hdf5(change: Callable[[Any], object]) -> Callable[[Path], object]:
    """An HDF5 file that was changed."""

    def make(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for name, x in columns().items():
                file[name] = x
            change(file)

    return make


def replaced(name: str, put: Callable[[Any, str], object]) -> Callable[[Path], object]:
    """An HDF5 file with something else in the place of a column."""

    def change(file: Any) -> None:
        del file[name]
        put(file, name)

    return hdf5(change)


def bag(kind: str, change: Callable[[bytearray], object] | None = None, **messages: Any):
    """A bag of ROS whose bytes, or whose messages, were changed."""

    def make(path: Path) -> None:
        path.write_bytes(_bag(kind, change, **messages))

    return make


def _bag(kind: str, change: Callable[[bytearray], object] | None, **messages: Any) -> bytes:
    from dataclasses import replace

    from ros_bags import messages_of, write_bag

    made = [replace(one, **messages) for one in messages_of(recording(0).cut(0.0, 4.0))]
    with TemporaryDirectory(prefix="hostile.bag.") as name:
        data = bytearray(write_bag(Path(name), kind, made).read_bytes())
    if change is not None:
        change(data)
    return bytes(data)


def cut(share: float) -> Callable[[bytearray], object]:
    """Return what loses the end of a file."""

    def change(data: bytearray) -> None:
        del data[int(share * len(data)) :]

    return change


def noise(data: bytearray) -> None:
    """Change a byte in every hundred."""
    rng = np.random.default_rng(17)
    for k in rng.integers(20, len(data), len(data) // 100):
        data[k] = rng.integers(256)


def of(make: Callable[[Path], object], change: Callable[[bytearray], object]):
    """Return what makes a file, and changes its bytes."""

    def changed(path: Path) -> None:
        make(path)
        data = bytearray(path.read_bytes())
        change(data)
        path.write_bytes(data)

    return changed


T = len(LINES) - 1
BLANK = bytes(8)
NESTED = "[" * 3000 + "]" * 3000

OTHERS: dict[str, tuple[str, Content, str]] = {
    # What is under the name
    "a pipe": (
        "run.csv",
        os.mkfifo,
        r"run\.csv: is not a regular file, but a device, a pipe or a socket",
    ),
    "/dev/zero as CSV": (
        "run.csv",
        link_to("/dev/zero"),
        r"run\.csv: is not a regular file, but a device, a pipe or a socket",
    ),
    "/dev/zero as bag": (
        "run.bag",
        link_to("/dev/zero"),
        r"run\.bag: is not a regular file, but a device, a pipe or a socket",
    ),
    "a folder as MCAP": ("run.mcap", folder, r"run\.mcap: holds no file \.mcap or \.db3"),
    "an empty folder as bag": (
        "run",
        folder,
        "run: is a folder, and not one that ROS 2 records into: it holds no metad",
    ),
    "a link in a circle": ("run.csv", link_to("run.csv"), r"run\.csv: no such data file"),
    "a hole as Parquet": (
        "run.parquet",
        hole(1 << 40),
        r"run\.parquet: holds 1024 GB, and 64 GB is the limit",
    ),
    "a hole of 300 MB as CSV": ("run.csv", hole(300 << 20), r"run\.csv: is not text"),
    "a hole of 300 MB as HDF5": (
        "run.h5",
        hole(300 << 20),
        r"run\.h5: cannot be read as an HDF5 file",
    ),
    "a hole of 15 GB as bag": (
        "run.bag",
        hole(15 << 30),
        r"run\.bag: cannot be read as a bag of ROS",
    ),
    "gzip by its name": (
        "run.csv.gz",
        gzip.compress(csv_text(0).encode()),
        r"run\.csv\.gz: the suffix '\.gz' names no format",
    ),
    "gzip under another name": (
        "run.csv",
        gzip.compress(csv_text(0).encode()),
        r"run\.csv: is not UTF-8 text",
    ),
    "a pickle": (
        "run.pkl",
        pickle.dumps([Trap()]),
        r"run\.pkl: the suffix '\.pkl' names no format",
    ),
    "a pickle as NPZ": ("run.npz", pickle.dumps([Trap()]), r"run\.npz: is not an NPZ file"),
    "CSV as Parquet": (
        "run.parquet",
        csv_text(0),
        r"run\.parquet: cannot be read as a Parquet file",
    ),
    "CSV as MCAP": ("run.mcap", csv_text(0), r"run\.mcap: cannot be read as a bag of ROS"),
    "NPZ as CSV": ("run.csv", raw_npz(("t.npy", npy("{}"))), r"run\.csv: is not UTF-8 text"),
    "NPZ as MAT": ("run.mat", npz(), r"run\.mat: cannot be read as a MATLAB file"),
    "MAT as HDF5": ("run.h5", mat(), r"run\.h5: cannot be read as an HDF5 file"),
    # Text
    "UTF-16": ("run.csv", csv_text(0).encode("utf-16"), r"run\.csv: is not UTF-8 text"),
    "a byte order mark": ("run.csv", codecs.BOM_UTF8 + csv_text(0).encode(), ANSWER),
    "lines of Windows": ("run.csv", csv_text(0).replace("\n", "\r\n"), ANSWER),
    "lines of old Macs": ("run.csv", csv_text(0).replace("\n", "\r"), ANSWER),
    "a line end within": (
        "run.csv",
        csv_text(0).replace("\n", "\u2028", 5),
        r"run\.csv: no column 'tau\.elbow'",
    ),
    "NUL in the middle": (
        "run.csv",
        csv_text(0).replace("0.05", "0.0\0", 1),
        r"run\.csv: is not text",
    ),
    "a comma for the point": (
        "run.csv",
        csv_text(0).replace(",", ";").replace(".", ",").replace("q,", "q.").replace("tau,", "tau."),
        ANSWER,
    ),
    "commas and points": (
        "run.csv",
        csv_text(0).replace(",", ";").replace("-0.840749889", "-0,840749889"),
        r"run\.csv, line 2, column q\.shoulder: '-0,840749889' is not a number",
    ),
    "comments without end": (
        "run.csv",
        "# log, once\n" * 1_000_000,
        r"run\.csv: begins with \d+ lines of comment, and no samples",
    ),
    "comments in every other line": ("run.csv", csv_text(0).replace("\n", "\n# x\n"), ANSWER),
    "a line of units, and no more": (
        "run.csv",
        LINES[0] + "\ns,rad,rad,Nm,Nm\n",
        r"run\.csv, line 2, column t: 's' is not a number",
    ),
    "a date that there is not": (
        "run.csv",
        each(lambda k, c: [f"2026-02-29T10:{k // 60:02d}:{k % 60:02d}", *c[1:]]),
        r"run\.csv, line 2, column t: '2026-02-29T10:00:00' is not a date and a time",
    ),
    "dates beyond all years": (
        "run.csv",
        each(
            lambda k, c: [
                f"9999-12-31T23:{k // 6000:02d}:{k // 100 % 60:02d}.{k % 100:02d}",
                *c[1:],
            ]
        ),
        ANSWER,
    ),
    "a formula": (
        "run.csv",
        cell(7, 1, "=1+1"),
        r"run\.csv, line 8, column q\.shoulder: '=1\+1' is not a number",
    ),
    "hexadecimal": (
        "run.csv",
        cell(7, 1, "0x1p3"),
        r"run\.csv, line 8, column q\.shoulder: '0x1p3' is not a number",
    ),
    "Arabic digits": (
        "run.csv",
        cell(7, 1, "٤"),
        r"run\.csv, line 8, column q\.shoulder: '٤' is not a number",
    ),
    "-0.0": ("run.csv", cell(1, 1, "-0.0"), ANSWER),
    "1e308": ("run.csv", cell(7, 1, "1e308"), r"run\.csv, row 7"),
    "1e-320": ("run.csv", cell(7, 1, "1e-320"), ANSWER),
    "a number of 10 000 digits": ("run.csv", cell(7, 1, "0." + "1" * 10_000), ANSWER),
    "a cell of 10 MB": (
        "run.csv",
        cell(7, 1, "x" * 10_000_000),
        r"run\.csv, after line 7: cannot be read",
    ),
    "a name of 1 MB": (
        "run.csv",
        csv_text(0).replace("tau.elbow", "x" * 1_000_000, 1),
        r"run\.csv, line 1: the header cannot be read",
    ),
    "a quote that never ends": (
        "run.csv",
        cell(7, 1, '"1'),
        r"run\.csv, line 1602: 2 columns where the header has 5",
    ),
    "columns twice": (
        "run.csv",
        csv_text(0).replace("tau.elbow", "q.elbow", 1),
        r"run\.csv, line 1: the column 'q\.elbow' is there 2 times",
    ),
    "the time twice": (
        "run.csv",
        csv_text(0).replace("tau.elbow", "t", 1),
        r"run\.csv, line 1: the column 't' is there 2 times",
    ),
    "names with blanks": ("run.csv", csv_text(0).replace(",", " , ", 4), ANSWER),
    "names that paint": (
        "run.csv",
        csv_text(0).replace("tau.elbow", "\x1b[2J\u202etau", 1),
        r"run\.csv: no column 'tau\.elbow'",
    ),
    "a header of commas": (
        "run.csv",
        "," * 4000 + "\n" + "1," * 4000 + "1\n",
        r"run\.csv: no column 't', 'q\.shoulder', 'q\.elbow', 'tau\.shoulder', 'tau\.el",
    ),
    "a million empty lines": (
        "run.csv",
        LINES[0] + "\n" * 1_000_000,
        r"run\.csv: holds a header but no samples",
    ),
    "a line of 50 MB": (
        "run.csv",
        LINES[0] + "\n" + "1" * 50_000_000,
        r"run\.csv: holds a line, or empty lines, of more than",
    ),
    "time of 1e300": ("run.csv", each(lambda k, c: [f"{k}e300", *c[1:]]), r"run\.csv, row 2"),
    "time of 1e17": ("run.csv", each(lambda k, c: [str(10**17 + k), *c[1:]]), r"run\.csv, row 2"),
    "nanoseconds of today": (
        "run.csv",
        each(lambda k, c: [str(1_700_000_000_000_000_000 + 10_000_000 * k), *c[1:]]),
        ANSWER,
    ),
    "a clock that stops": (
        "run.csv",
        each(lambda k, c: [c[0] if k < 9 else "0.09", *c[1:]]),
        r"run\.csv, row 11",
    ),
    "a clock with a gap of years": (
        "run.csv",
        each(lambda k, c: [c[0] if k < 900 else f"{1e8 + k / 100}", *c[1:]]),
        r"run\.csv, row 900",
    ),
    "a clock that counts down": (
        "run.csv",
        each(lambda k, c: [f"{-k / 100}", *c[1:]]),
        r"run\.csv, row 2",
    ),
    "torques beyond the square root": (
        "run.csv",
        each(lambda _, c: [*c[:3], *(f"{float(x) * 1e90:g}" for x in c[3:])]),
        r"run\.csv, row 1",
    ),
    "positions of 1e99": ("run.csv", each(lambda _, c: [c[0], "1e99", *c[2:]]), r"run\.csv, row 1"),
    "every number the same": (
        "run.csv",
        each(lambda k, c: [c[0], "1", "1", "1", "1"]),
        r"run\.csv: the robot does not move",
    ),
    "noise alone": (
        "run.csv",
        each(lambda k, c: [c[0], *(str(np.sin(k * k * 1e3 + i)) for i in range(4))]),
        ANSWER,
    ),
    # NPZ
    "NPZ, cut": ("run.npz", of(npz(), cut(0.5)), r"run\.npz: is not an NPZ file"),
    "NPZ, noise": ("run.npz", of(npz(), noise), r"run\.npz: no column 'tau\.shoulder'"),
    "NPZ with objects": (
        "run.npz",
        npz(t=np.array([Trap()] * 3)),
        r"run\.npz: 't' holds Python objects, which are never loaded",
    ),
    "NPZ of text": (
        "run.npz",
        npz(t=np.array(["1"] * T)),
        r"run\.npz: 't' does not hold real numbers",
    ),
    "NPZ of truths": (
        "run.npz",
        npz(t=np.arange(T) > 3),
        r"run\.npz, row 2, column t: the time stamp 0\.0 s is there twice",
    ),
    "NPZ of complex numbers": (
        "run.npz",
        npz(t=np.arange(T) * 1j),
        r"run\.npz: 't' does not hold real numbers",
    ),
    "NPZ of dates": ("run.npz", npz(t=np.datetime64(0, "ms") + 10 * np.arange(T)), ANSWER),
    "NPZ of no dates": (
        "run.npz",
        npz(t=np.full(T, "NaT", dtype="datetime64[s]")),
        r"run\.npz, row 1, column t: .*nan",
    ),
    "NPZ of records": (
        "run.npz",
        npz(t=np.zeros(T, dtype=[("a", "f8")])),
        r"run\.npz: 't' does not hold real numbers",
    ),
    "NPZ of half numbers": ("run.npz", npz(t=np.arange(T).astype(np.float16)), ANSWER),
    "NPZ of huge whole numbers": (
        "run.npz",
        npz(t=(np.uint64(2**64 - 1) - np.arange(T, dtype=np.uint64))),
        r"run\.npz, row 2, column t: the time stamp 1\.8446744073709552e\+19 s is the",
    ),
    "NPZ of another byte order": ("run.npz", npz(t=columns()["t"].astype(">f8")), ANSWER),
    "NPZ of no samples": (
        "run.npz",
        npz(**{name: np.zeros(0) for name in columns()}),
        r"run\.npz: holds 0 samples",
    ),
    "NPZ of a scalar": ("run.npz", npz(t=np.float64(1.0)), r"run\.npz: 't' has the shape"),
    "NPZ of many axes": ("run.npz", npz(t=np.zeros((1,) * 30)), r"run\.npz: 't' has the shape"),
    "NPZ with a header of code": (
        "run.npz",
        one_npy("__import__('os').abort()"),
        r"run\.npz: cannot be read as array 't'",
    ),
    "NPZ with a deep header": (
        "run.npz",
        one_npy(NESTED),
        r"run\.npz: cannot be read as array 't'",
    ),
    "NPZ that says it is huge": (
        "run.npz",
        one_npy("{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999,), }", BLANK),
        r"run\.npz: does not fit into memory",
    ),
    "NPZ of a negative shape": (
        "run.npz",
        one_npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-3,), }", BLANK),
        r"run\.npz: cannot be read as array 't'",
    ),
    "NPZ of an overflowing shape": (
        "run.npz",
        one_npy(
            "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296), }", BLANK
        ),
        r"run\.npz: cannot be read as array 't'",
    ),
    "NPZ of a type of no bytes": (
        "run.npz",
        one_npy("{'descr': '|V0', 'fortran_order': False, 'shape': (999999999,), }"),
        r"run\.npz: 't' does not hold real numbers",
    ),
    "NPZ of a name above": (
        "run.npz",
        raw_npz(("../../etc/passwd.npy", npy("{}"))),
        r"run\.npz: no column 't', 'q\.shoulder', 'q\.elbow', 'tau\.shoulder', 'tau\.el",
    ),
    "NPZ of one name twice": (
        "run.npz",
        raw_npz(*[("t.npy", npy("{}"))] * 2),
        r"run\.npz: no column 'q\.shoulder', 'q\.elbow', 'tau\.shoulder', 'tau\.elbow'",
    ),
    # MAT
    "MAT, cut": ("run.mat", of(mat(), cut(0.5)), r"run\.mat: no column 'q\.elbow', 'tau\.elbow'"),
    "MAT, noise": ("run.mat", of(mat(), noise), r"run\.mat: cannot be read as a MATLAB file"),
    "MAT of structures": (
        "run.mat",
        mat(t={"a": {"b": np.arange(T)}}),
        r"run\.mat: no column 't'. it holds .*t\.a\.b",
    ),
    "MAT of structures in each other": (
        "run.mat",
        mat(t={"a": {"a": {"a": {"a": {"a": {"a": np.arange(T)}}}}}}),
        r"run\.mat: no column 't'. it holds .*t\.a\.a\.a",
    ),
    "MAT of an array of structures": (
        "run.mat",
        mat(t=np.zeros(3, dtype=[("a", "O")])),
        r"run\.mat: 't' does not hold real numbers",
    ),
    "MAT of cells": (
        "run.mat",
        mat(t=np.array([[1], "x"], dtype=object)),
        r"run\.mat: 't' does not hold real numbers",
    ),
    "MAT of text": ("run.mat", mat(t="time"), r"run\.mat: 't' does not hold real numbers"),
    "MAT of version 4": (
        "run.mat",
        b"\0\0\0\0\xff\xff\xff\x7f\xff\xff\xff\x7f" + bytes(90),
        r"run\.mat: cannot be read as a MATLAB file",
    ),
    "MAT 7.3 that is none": (
        "run.mat",
        b"MATLAB 7.3 MAT-file".ljust(600),
        r"run\.mat: cannot be read as a MATLAB file of version 7\.3",
    ),
    # Parquet
    "Parquet, cut": (
        "run.parquet",
        of(parquet(), cut(0.5)),
        r"run\.parquet: cannot be read as a Parquet file",
    ),
    "Parquet, its end alone": (
        "run.parquet",
        b"PAR1" + b"\xff\xff\xff\x7f" + b"PAR1",
        r"run\.parquet: cannot be read as a Parquet file",
    ),
    "Parquet, noise": (
        "run.parquet",
        of(parquet(), noise),
        r"run\.parquet: cannot be read as a Parquet file",
    ),
    "Parquet of text": (
        "run.parquet",
        parquet(t=["x"] * T),
        r"run\.parquet: 't' does not hold real numbers",
    ),
    "Parquet of lists": (
        "run.parquet",
        parquet(t=[[1.0]] * T),
        r"run\.parquet: 't' does not hold real numbers",
    ),
    "Parquet of nothing": (
        "run.parquet",
        parquet(t=[None] * T),
        r"run\.parquet: 't' does not hold real numbers",
    ),
    "Parquet of dates": (
        "run.parquet",
        parquet(t=np.arange(T).astype("datetime64[ns]")),
        r"run\.parquet: samples at 1e\+09 Hz are too many",
    ),
    # HDF5
    "HDF5, cut": (
        "run.h5",
        of(hdf5(lambda file: None), cut(0.5)),
        r"run\.h5: cannot be read as an HDF5 file",
    ),
    "HDF5, noise": (
        "run.h5",
        of(hdf5(lambda file: None), noise),
        r"run\.h5: cannot be read as an HDF5 file",
    ),
    "HDF5 with a link outside": (
        "run.h5",
        replaced("t", lambda file, name: _link_outside(file, name)),
        r"run\.h5: no column 't'",
    ),
    "HDF5 with a circle": (
        "run.h5",
        hdf5(lambda file: file.__setitem__("loop", file["/"])),
        ANSWER,
    ),
    "HDF5 with a link to itself": (
        "run.h5",
        replaced("t", lambda file, name: _soft(file, name)),
        r"run\.h5: no column 't'",
    ),
    "HDF5 of a terabyte of nothing": (
        "run.h5",
        replaced(
            "t",
            lambda file, name: file.create_dataset(name, (1 << 37,), "f8", chunks=(1 << 20,)),
        ),
        r"run\.h5: unpacks to 1024 GB, and 1 GB is the limit",
    ),
    "HDF5 of a filter that nobody has": (
        "run.h5",
        replaced("t", lambda file, name: _filtered(file, name)),
        r"run\.h5, row 2, column t: the time stamp 0\.0 s is there twice",
    ),
    "HDF5 of texts": (
        "run.h5",
        replaced("t", lambda file, name: file.__setitem__(name, "x")),
        r"run\.h5: 't' does not hold real numbers",
    ),
    "HDF5 with raw data elsewhere": (
        "run.h5",
        replaced(
            "t",
            lambda file, name: file.create_dataset(
                name, (T,), "f8", external=[("/etc/passwd", 0, 8 * T)]
            ),
        ),
        r"run\.h5: '/t' lies in another file",
    ),
    # Bags
    "ROS 1 bag, cut": (
        "run.bag",
        bag("bag", cut(0.5)),
        r"run\.bag: cannot be read as a bag of ROS",
    ),
    "ROS 1 bag, noise": ("run.bag", bag("bag", noise), r"run\.bag: cannot be read as a bag of ROS"),
    "ROS 1 bag of a line": (
        "run.bag",
        b"#ROSBAG V2.0\n",
        r"run\.bag: cannot be read as a bag of ROS",
    ),
    "ROS 1 bag of version 1": (
        "run.bag",
        b"#ROSBAG V1.0\n" + bytes(100),
        r"run\.bag: cannot be read as a bag of ROS",
    ),
    "ROS 1 bag that says it is huge": (
        "run.bag",
        b"#ROSBAG V2.0\n" + b"\xff\xff\xff\x7f" + bytes(100),
        r"run\.bag: does not fit into memory",
    ),
    "MCAP, cut": ("run.mcap", bag("mcap", cut(0.5)), r"run\.mcap: cannot be read as a bag of ROS"),
    "MCAP, noise": ("run.mcap", bag("mcap", noise), r"run\.mcap: cannot be read as a bag of ROS"),
    "MCAP of its sign alone": (
        "run.mcap",
        b"\x89MCAP0\r\n",
        r"run\.mcap: cannot be read as a bag of ROS",
    ),
    "MCAP of records without end": (
        "run.mcap",
        b"\x89MCAP0\r\n\x06" + b"\xff" * 8 + bytes(50) + b"\x89MCAP0\r\n",
        r"run\.mcap: cannot be read as a bag of ROS",
    ),
    "SQLite bag, cut": (
        "run.db3",
        bag("db3", cut(0.5)),
        r"run\.db3: cannot be read as a bag of ROS",
    ),
    "SQLite bag, noise": (
        "run.db3",
        bag("db3", noise),
        r"run\.db3: cannot be read as a bag of ROS",
    ),
    "SQLite bag of its sign alone": (
        "run.db3",
        b"SQLite format 3\0",
        r"run\.db3: cannot be read as a bag of ROS",
    ),
    "bag of no stamps": (
        "run.bag",
        bag("bag", stamp=None),
        r"run\.bag, row 2, column t: the time stamp 0\.0 s is there twice",
    ),
    "bag of one instant": (
        "run.bag",
        bag("bag", stamp=1.0),
        r"run\.bag, row 2, column t: the time stamp 0\.0 s is there twice",
    ),
    "bag of two equal names": (
        "run.mcap",
        bag("mcap", names=("elbow", "elbow")),
        r"run\.mcap, topic /joint_states, message 1: the joint 'elbow' is named twi",
    ),
    "bag of more names than numbers": (
        "run.mcap",
        bag("mcap", names=("shoulder", "elbow", "wrist")),
        r"run\.mcap, topic /joint_states, message 1: 3 joints are named, and positi",
    ),
    "bag of no numbers": (
        "run.bag",
        bag("bag", position=(), effort=()),
        r"run\.bag, topic /joint_states: no column 'q\.shoulder', 'q\.elbow', 'tau\.sh",
    ),
    "bag of NaN": (
        "run.bag",
        bag("bag", effort=(float("nan"), 1.0)),
        r"run\.bag, topic /joint_states: no column 'tau\.shoulder'",
    ),
}
"""File, its content, and the one line: as training data of a study."""


def _link_outside(file: Any, name: str) -> None:
    import h5py

    file[name] = h5py.ExternalLink("/etc/passwd", "/t")


def _soft(file: Any, name: str) -> None:
    import h5py

    file[name] = h5py.SoftLink(f"/{name}")


def _filtered(file: Any, name: str) -> None:
    import h5py

    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((T,))
    plist.set_filter(32999, h5py.h5z.FLAG_OPTIONAL)
    space = h5py.h5s.create_simple((T,))
    h5py.h5d.create(file.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space, plist)


def _study(file: str) -> str:
    return edited(('"train.csv"', f'"{file}"'), ("period = 8.0\n\n", "\n"))


CASES = {
    **{
        f"{name}: {command}": HostileCase(
            commands=((command, "study.toml"),), files={"train.csv": text}, message=message
        )
        for name, (text, message) in EVERYWHERE.items()
        for command in ("compare", "fit", "diagnose")
    },
    **{
        name: HostileCase(
            commands=(("compare", "study.toml"),),
            files={file: content, "study.toml": _study(file)},
            message=message,
        )
        for name, (file, content, message) in OTHERS.items()
    },
}
