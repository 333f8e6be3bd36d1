"""Time and CPU time of reading a CSV recording, beside `pandas.read_csv` on the same file.

    python benchmarks/csv_reading.py [--samples 1000000] [--joints 7] [--times 3]

The file holds t and, for each joint, q and tau in as many digits as a double needs: 15 columns for
seven joints. The two readers take turns, and the best of each counts. Beyond what pandas does, ours
checks that every line has as many cells as the header and every cell a finite number, takes the
file's SHA-256, and makes the recording, which has checks of its own.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from dynident.recording import Recording, read, write

RATE_HZ = 1000.0


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--joints", type=int, default=7)
    parser.add_argument("--times", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = write(recording(arguments.samples, arguments.joints), Path(folder) / "run.csv")
        print(f"{arguments.samples} rows of {1 + 2 * arguments.joints} columns, ", end="")
        print(f"{path.stat().st_size / 1e6:.0f} MB")
        calls = {"pandas.read_csv": lambda: pd.read_csv(path), "read": lambda: read(path)}
        found = [
            {name: seconds(call) for name, call in calls.items()} for _ in range(arguments.times)
        ]
    best = {name: np.min([one[name] for one in found], axis=0) for name in calls}
    for name, (wall, cpu) in best.items():
        print(f"{name:16} {wall:6.2f} s, CPU {cpu:6.2f} s")
    wall, cpu = best["read"] / best["pandas.read_csv"]
    print(f"ratio            {wall:6.2f}    CPU {cpu:6.2f}")


if __name__ == "__main__":
    main()
