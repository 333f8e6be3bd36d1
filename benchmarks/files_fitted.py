"""Memory and time of files that are read and fitted, against their number of rows.

Each file is written by one process and fitted by another. Counted is the memory that has no file
behind it: pages that are mapped from files are the system's, which takes them back when it needs
them.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from arms import RATE_HZ, arm, recording
from dynident.fitting import fit
from dynident.model import Model
from dynident.recording import read, write
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import added_own_mib, cpu

FORMATS = (".csv", ".npz", ".parquet", ".h5")
SIZES: dict[Size, tuple[int, ...]] = {
    "tiny": (2_000,),
    "quick": (200_000,),
    "full": (1_000_000, 5_000_000),
}
FEW = 2_000
LIMIT = 900.0  # s of one file


def written(path: Path, samples: int) -> None:
    """Write a recording of seven joints in the format of the suffix."""
    model = Model(arm())
    data = recording(model, model.given_values(), 0, samples)
    if path.suffix != ".h5":
        write(data, path)
        return
    import h5py  # pyright: ignore[reportMissingImports]

    with h5py.File(path, "w") as file:
        file["t"] = data.t
        for i, joint in enumerate(data.joints):
            file[f"q.{joint}"], file[f"tau.{joint}"] = data.q[:, i], data.tau[:, i]


@single_threaded
def measured(path: Path) -> dict[str, float]:
    """CPU time and memory of reading and fitting, in this process."""
    model = Model(arm())
    fit(model, read(path.with_stem("few")))  # all is imported, and functions are made
    found: dict[str, float] = {}

    def run() -> None:
        found["CPU to read, s"], data = cpu(lambda: read(path))
        found["CPU to fit, s"], _ = cpu(lambda: fit(model, data))

    found["peak above the start, MiB"] = added_own_mib(run)
    return found


def lines(size: Size) -> Iterator[Line]:
    for samples in SIZES[size]:
        for suffix in FORMATS:
            line = Line(case=f"{samples} rows", who=suffix.removeprefix("."), at=samples)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"run{suffix}"
                try:
                    alone("write", path.with_stem("few"), FEW)
                    alone("write", path, samples)
                    figures = json.loads(alone("fit", path, samples).splitlines()[-1])
                    yield replace(line, figures=figures)
                except subprocess.TimeoutExpired:
                    yield replace(line, missing=f"stopped after {LIMIT:g} s")
                except subprocess.CalledProcessError as error:
                    last = error.stderr.strip().splitlines() or [f"status {error.returncode}"]
                    yield replace(line, missing=last[-1])


def alone(what: str, path: Path, samples: int) -> str:
    """What a process of its own says."""
    command = [sys.executable, __file__, what, str(path), str(samples)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=LIMIT)
    return done.stdout


BENCHMARK = Benchmark(
    title="Files read and fitted against their number of rows",
    work=f"Seven joints at {RATE_HZ:g} Hz, rigid body, default filter, t and q and tau of each "
    "joint. The peak is of the memory that the process holds for itself; pages mapped from files, "
    "which the system takes back when it needs them, are not in it.",
    compared="peak above the start, MiB",
    lines=lines,
    axis="rows",
)

if __name__ == "__main__":
    if sys.argv[1] == "write":
        written(Path(sys.argv[2]), int(sys.argv[3]))
    else:
        print(json.dumps(measured(Path(sys.argv[2]))))
