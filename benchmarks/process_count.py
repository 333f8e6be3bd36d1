"""Independent fits over processes: how much of another processor arrives."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import numpy as np
from joblib import Parallel, delayed

from arms import FULL_RATE, arm, recording
from dynident.fitting import fit
from dynident.model import Model
from dynident.recording import Dataset
from side_by_side.line import Benchmark, Line, Size

FITS = 8
MOST = 8  # processes


def one_fit(seed: int, samples: int) -> np.ndarray:
    model = Model(arm()) + "viscous_friction" + "coulomb_friction"
    data = Dataset((recording(model, model.given_values(), seed, samples),), FULL_RATE)
    return fit(model, data).values


def lines(size: Size) -> Iterator[Line]:
    samples = {"tiny": 1_000, "quick": 10_000, "full": 100_000}[size]
    most = 1 if size == "tiny" else min(MOST, os.cpu_count() or 1)
    counts = [n for n in (1, 2, 4, 8) if n <= most]
    alone = 0.0
    for count in counts:
        with Parallel(n_jobs=count) as pool:
            pool(delayed(one_fit)(seed, 1_000) for seed in range(count))  # all is imported
            start = time.perf_counter()
            pool(delayed(one_fit)(seed, samples) for seed in range(FITS))
            wall = time.perf_counter() - start
        alone = alone or wall
        figures = {"wall, s": wall, "speed-up": alone / wall}
        case = f"{FITS} fits of {samples} samples, processes: {count}"
        yield Line(case=case, who="dynident.fit under joblib", figures=figures, at=float(count))


BENCHMARK = Benchmark(
    title="Fits over processes",
    work="Fits of different robots' recordings, each with one thread of linear algebra, shared out "
    "by joblib. Wall clock.",
    compared="wall, s",
    lines=lines,
    axis="processes",
)
