"""Time and memory of least squares against the number of samples, beside a dense solve.

Each size runs in a process of its own, so that the peak is of that size alone. It is that of the
process above what it held with the recording in memory: arrays, libraries and all.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from arms import FULL_RATE, RATE_HZ, arm, recording
from dynident.fitting import fit
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import added_mib

WAYS = {"dynident.fit": "auto", "dynident.fit, no compiler": "never"}
"""And what the environment says of compiling."""
FILTERS = {"every row": FULL_RATE, "default filter": None}
DENSE = "regressor stacked, NumPy lstsq"
LIMIT = 300.0  # s of one size
LONGEST_DENSE = 300_000  # samples: 0.8 GB of regressor
SIZES: dict[Size, tuple[int, ...]] = {
    "tiny": (2_000,),
    "quick": (10_000, 100_000),
    "full": (10_000, 100_000, 1_000_000, 10_000_000),
}


def dense(model: Model, one: Recording) -> np.ndarray:
    motion = sample(one, FULL_RATE).motion
    regressor = model.robot.regressor(motion.q, motion.v, motion.a)
    base = regressor[:, :, list(model.base.independent)].reshape(-1, model.size)
    return np.linalg.lstsq(base, motion.tau.ravel(), rcond=None)[0]


@single_threaded
def measured(samples: int, who: str, rows: str) -> dict[str, float]:
    """CPU time and peak memory above the data, in this process."""
    model = Model(arm())
    small = recording(model, model.given_values(), 1, 2_000)
    data = recording(model, model.given_values(), 0, samples)

    def run(one: Recording) -> object:
        if who == DENSE:
            return dense(model, one)
        return fit(model, Dataset((one,), FILTERS[rows]))

    run(small)  # all is imported, and functions are made
    start = time.process_time()
    added = added_mib(lambda: run(data))
    spent = time.process_time() - start
    return {
        "CPU, s": spent,
        "us a sample": 1e6 * spent / samples,
        "peak above the data, MiB": added,
    }


def alone(line: Line, said: list[str], compiling: str) -> Line:
    """Fill in a line by a process of its own, with what `measured` takes."""
    command = [sys.executable, __file__, *said]
    environment = {**os.environ, "DYNIDENT_COMPILE": compiling}
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True, timeout=LIMIT
        )
    except subprocess.TimeoutExpired:
        return replace(line, missing=f"stopped after {LIMIT:g} s")
    except subprocess.CalledProcessError as error:
        # A process that the system ends for want of memory says nothing.
        last = error.stderr.strip().splitlines() or [f"exit status {error.returncode}"]
        return replace(line, missing=last[-1])
    return replace(line, figures=json.loads(done.stdout.splitlines()[-1]))


def lines(size: Size) -> Iterator[Line]:
    for rows in FILTERS:
        for samples in SIZES[size]:
            peers = [DENSE] if rows == "every row" and samples <= LONGEST_DENSE else []
            for who in (*WAYS, *peers):
                case = f"{samples} samples, {rows}"
                name = f"{who}, {rows}" if who != DENSE else who
                line = Line(case=case, who=name, at=samples)
                yield alone(line, [str(samples), who, rows], WAYS.get(who, "auto"))


BENCHMARK = Benchmark(
    title="Least squares against the number of samples",
    work=f"Seven joints at {RATE_HZ:g} Hz, rigid body, one recording that is in memory. The peak "
    "is of the process, above what it held with the data. The stacked regressor of more than "
    f"{LONGEST_DENSE} samples would not fit into the memory of small machines, and is not tried.",
    compared="CPU, s",
    lines=lines,
    axis="samples",
)

if __name__ == "__main__":
    print(json.dumps(measured(int(sys.argv[1]), sys.argv[2], sys.argv[3])))
