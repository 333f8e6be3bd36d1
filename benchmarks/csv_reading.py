"""Reading a CSV recording, beside `pandas.read_csv` on the same file.

The two readers take turns, and the best of each counts.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from dynident.recording import Recording, read, write
from side_by_side.line import Benchmark, Line, Size

RATE_HZ, JOINTS, TURNS = 1000.0, 7, 3


def recording(samples: int, joints: int) -> Recording:
    """Positions of unlike frequencies and noisy torques, rad and N m."""
    rng = np.random.default_rng(0)
    t = np.arange(samples) / RATE_HZ
    q = np.sin(t[:, None] * np.linspace(1.0, 3.0, joints))
    tau = 10 * q + rng.normal(size=q.shape)
    return Recording(t, q, tau, tuple(f"j{i}" for i in range(joints)))


def seconds(call: Callable[[], object]) -> tuple[float, float]:
    """Wall clock and CPU time of the process, in s."""
    wall, cpu = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - wall, time.process_time() - cpu


def lines(size: Size) -> Iterator[Line]:
    for samples in {"tiny": (500,), "quick": (50_000,), "full": (100_000, 1_000_000)}[size]:
        with tempfile.TemporaryDirectory() as folder:
            path = write(recording(samples, JOINTS), Path(folder) / "run.csv")
            calls: dict[str, Callable[[], object]] = {
                "dynident.read": partial(read, path),
                "pandas.read_csv": partial(pd.read_csv, path),
            }
            found = [{name: seconds(call) for name, call in calls.items()} for _ in range(TURNS)]
        for name in calls:
            wall, cpu = np.min([one[name] for one in found], axis=0)
            figures = {"CPU, s": cpu, "wall, s": wall}
            yield Line(
                case=f"{samples} rows of {1 + 2 * JOINTS} columns", who=name, figures=figures
            )


BENCHMARK = Benchmark(
    title="Reading a CSV recording",
    work="A file with t and, for each of seven joints, q and tau in as many digits as a double "
    "needs. Beyond what pandas does, ours checks that every line has as many cells as the header "
    "and every cell a finite number, takes the file's SHA-256, and makes the recording, which has "
    "checks of its own.",
    compared="CPU, s",
    lines=lines,
)
