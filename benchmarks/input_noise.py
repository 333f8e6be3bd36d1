"""One pass over a million rows, then iterations that cost the same for any number of them.

    python benchmarks/input_noise.py [--rows 1000000] [--inputs 110]

The statistics are compared with the bare product X'X of the same blocks, in turn in one run, and an
iteration on statistics with one that passes over all rows, as the paper's equations read. Rows are
made block by block and never kept. CPU times, one thread.
"""

from __future__ import annotations

import argparse
import time
import tracemalloc
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dynident.moments import SecondMoments
from dynident.regression.factor_analysis import Gamma, start_of
from dynident.regression.iterations import analyse
from dynident.threads import single_threaded

BLOCK = 8192
ROUNDS = 200
PASSES = 3


@dataclass(frozen=True, eq=False)
class Rows:
    """Blocks of the same random rows, made anew whenever they are asked for."""

    rows: int
    inputs: int

    def blocks(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        rng = np.random.default_rng(0)
        true = np.where(np.arange(self.inputs) < 10, np.arange(self.inputs) + 1.0, 0.0)
        for start in range(0, self.rows, BLOCK):
            count = min(BLOCK, self.rows - start)
            X = rng.standard_normal((count, self.inputs))
            yield X, X @ true + rng.standard_normal(count)


@single_threaded
def one_pass(data: Rows) -> tuple[SecondMoments, float, float]:
    """The statistics, their CPU time and that of X'X, block by block in turn, s."""
    found: SecondMoments | None = None
    total = np.zeros((data.inputs, data.inputs))
    ours = bare = 0.0
    for X, y in data.blocks():
        start = time.process_time()
        total += X.T @ X
        middle = time.process_time()
        here = SecondMoments.of(X, y)
        found = here if found is None else found + here
        ours += time.process_time() - middle
        bare += middle - start
    assert found is not None
    np.testing.assert_allclose(found.about_origin().gram, total, rtol=1e-6, atol=1e-3 * data.rows)
    return found, ours, bare


@single_threaded
def iterations(statistics: SecondMoments) -> float:
    """CPU time of one iteration on the statistics, s."""
    unit = statistics.scaled(1.0 / statistics.scale)
    unit = SecondMoments(unit.total, unit.count)
    prior, known = Gamma(), np.zeros(unit.inputs, dtype=bool)
    start = start_of(unit, 0.8, prior)
    began = time.process_time()
    found = analyse(unit, start, prior, known, rounds=ROUNDS, tolerance=-np.inf)
    return (time.process_time() - began) / found.rounds


@single_threaded
def iteration_over_rows(data: Rows) -> float:
    """CPU time of the sums of one iteration when every one passes over the rows, s."""
    b, ct = np.full(data.inputs, 0.1), np.full(data.inputs, 0.5)
    spent = 0.0
    for X, y in data.blocks():
        began = time.process_time()
        left = y - X @ b
        z = X * b + left[:, None] * 0.01
        t = X * ct + 0.3 * z
        for one, other in ((z, z), (z, t), (t, t), (X, t)):
            np.einsum("ij,ij->j", one, other)
        spent += time.process_time() - began
    return spent


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--inputs", type=int, default=110)
    asked = parser.parse_args()
    data = Rows(asked.rows, asked.inputs)
    runs = [one_pass(data) for _ in range(PASSES)]
    ratios = [ours / bare for _, ours, bare in runs]
    print(f"{asked.rows} rows, {asked.inputs} inputs, {PASSES} passes")
    print(f"X'X alone              {min(bare for *_, bare in runs):8.3f} s")
    print(f"sufficient statistics  {min(ours for _, ours, _ in runs):8.3f} s")
    print(f"ratio                  {min(ratios):8.2f} to {max(ratios):.2f}")
    print(f"iteration              {1e3 * iterations(runs[0][0]):8.3f} ms")
    print(f"iteration over rows    {1e3 * iteration_over_rows(data):8.0f} ms")
    for rows in (asked.rows // 10, asked.rows):
        tracemalloc.start()
        SecondMoments.over(Rows(rows, asked.inputs).blocks())
        print(f"peak memory, {rows:>8} rows {tracemalloc.get_traced_memory()[1] / 2**20:7.1f} MiB")
        tracemalloc.stop()


if __name__ == "__main__":
    main()
