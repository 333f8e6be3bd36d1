"""Recordings out, to CSV, NPZ, MAT and Parquet files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from dynident import files
from dynident.arguments import checked
from dynident.errors import RecordingError
from dynident.recording.formats.arrays.parquet_file import pyarrow_parquet
from dynident.recording.formats.column_names import plain
from dynident.recording.formats.open_table import unknown_suffix
from dynident.recording.recording import SIGNALS, Recording

_LONGEST_MATLAB_NAME = 63


@checked
def write(recording: Recording, path: str | Path) -> Path:
    """Write the samples of a recording; the file's suffix says its format.

    Every format keeps all digits: reading gives the same numbers. What is not a sample (period,
    use, start ...) is said by the study file, and not written.

    Parameters
    ----------
    recording : to write.
    path : file ending in .csv, .npz, .mat or .parquet.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    FileError
        If it cannot be written.
    RecordingError
        If the suffix names no format, or a joint's name cannot be written in it.
    """
    path = Path(path)
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise unknown_suffix(path, tuple(_WRITERS))
    return files.write_bytes(path, writer(_columns(recording), str(path)))


def _columns(recording: Recording) -> dict[str, np.ndarray]:
    found = {"t": recording.t}
    for signal in SIGNALS:
        x = getattr(recording, signal)
        if x is not None:
            named = ((f"{signal}.{joint}", x[:, i]) for i, joint in enumerate(recording.joints))
            # A column without a number in it was not recorded.
            found |= {name: column for name, column in named if not np.isnan(column).all()}
    return found


def _csv(columns: dict[str, np.ndarray], file: str) -> bytes:
    import pandas as pd

    # Python's shortest text of a double, which reads back as the same double.
    return pd.DataFrame(columns).to_csv(index=False, lineterminator="\n").encode("utf-8")


def _npz(columns: dict[str, np.ndarray], file: str) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **columns)  # pyright: ignore[reportArgumentType]
    return buffer.getvalue()


def _mat(columns: dict[str, np.ndarray], file: str) -> bytes:
    import scipy.io

    names = [plain(name) for name in columns]
    for name in names:
        if names.count(name) > 1:
            twins = [one for one in columns if plain(one) == name]
            what = f"{' and '.join(twins)} would both be the MATLAB variable '{name}'"
            raise RecordingError(what, file, "write another format, or rename a joint")
        if len(name) > _LONGEST_MATLAB_NAME:
            what = f"'{name}' is too long for a MATLAB variable (at most 63 letters)"
            raise RecordingError(what, file, "write another format, or rename the joint")
    buffer = io.BytesIO()
    scipy.io.savemat(
        buffer,
        dict(zip(names, columns.values(), strict=True)),
        long_field_names=True,
        do_compression=True,
        oned_as="column",
    )
    return buffer.getvalue()


def _parquet(columns: dict[str, np.ndarray], file: str) -> bytes:
    parquet = pyarrow_parquet(file)
    import pyarrow

    buffer = io.BytesIO()
    parquet.write_table(pyarrow.table(columns), buffer)
    return buffer.getvalue()


_WRITERS = {".csv": _csv, ".npz": _npz, ".mat": _mat, ".parquet": _parquet}
