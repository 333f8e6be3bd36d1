"""Bayesian regression from sums of products, beside scikit-learn's on all the rows.

One pass over the rows, then iterations that cost the same for any number of them. The pass is
compared with the bare product X'X of the same blocks, in turn in one run, an iteration with one
that passes over all rows, as the paper's equations read, and the whole with Bayesian ridge.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from sklearn.linear_model import BayesianRidge

from dynident.moments import SecondMoments
from dynident.regression import BayesianFactorRegression
from dynident.regression.factor_analysis import Gamma, start_of
from dynident.regression.iterations import analyse
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

BLOCK = 8192
ROUNDS = 200
PASSES = 3
INPUTS = 110
RELEVANT = 10
INPUT_VARIANCE = 0.25
"""Of the noise on inputs of unit variance."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Blocks of the same random rows, made anew whenever they are asked for.

    Attributes
    ----------
    noise : variance of what is added to the inputs once the output is made.
    """

    rows: int
    inputs: int = INPUTS
    noise: float = 0.0

    @property
    def true(self) -> np.ndarray:
        return np.where(np.arange(self.inputs) < RELEVANT, np.arange(self.inputs) + 1.0, 0.0)

    def blocks(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        rng = np.random.default_rng(0)
        for start in range(0, self.rows, BLOCK):
            count = min(BLOCK, self.rows - start)
            X = rng.standard_normal((count, self.inputs))
            y = X @ self.true + rng.standard_normal(count)
            if self.noise:
                X += np.sqrt(self.noise) * rng.standard_normal(X.shape)
            yield X, y


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


@single_threaded
def estimates(rows: int) -> Iterator[Line]:
    """Coefficients of noisy inputs, from rows that are in memory."""
    data = Rows(rows, noise=INPUT_VARIANCE)
    X, y = (np.concatenate(parts) for parts in zip(*data.blocks(), strict=True))
    case = f"{rows} rows of {INPUTS} inputs with noise of a quarter of their variance"
    contestants = {
        "dynident, noise given": BayesianFactorRegression(
            input_noise=np.full(INPUTS, INPUT_VARIANCE), queries="noiseless"
        ),
        "scikit-learn, BayesianRidge": BayesianRidge(),
    }
    for who, estimator in contestants.items():
        spent, found = cpu(lambda e=estimator: e.fit(X, y), PASSES)
        off = np.linalg.norm(found.coef_ - data.true) / np.linalg.norm(data.true)
        figures = {"CPU, ms": 1e3 * spent, "error of the coefficients, %": 100 * float(off)}
        yield Line(case=case, who=who, figures=figures)


def lines(size: Size) -> Iterator[Line]:
    for rows in {"tiny": (1000,), "quick": (20_000,), "full": (20_000, 200_000)}[size]:
        yield from estimates(rows)
    data = Rows({"tiny": 1000, "quick": 20_000, "full": 1_000_000}[size])
    runs = [one_pass(data) for _ in range(1 if size == "tiny" else PASSES)]
    case = f"one pass over {data.rows} rows"
    ours, bare = 1e3 * min(run[1] for run in runs), 1e3 * min(run[2] for run in runs)
    yield Line(case=case, who="dynident, sufficient statistics", figures={"CPU, ms": ours})
    yield Line(case=case, who="X'X alone", figures={"CPU, ms": bare})
    case = f"an iteration, {data.rows} rows"
    spent = 1e3 * iterations(runs[0][0])
    yield Line(case=case, who="dynident, on the statistics", figures={"CPU, ms": spent})
    spent = 1e3 * iteration_over_rows(data)
    yield Line(case=case, who="over the rows", figures={"CPU, ms": spent})


BENCHMARK = Benchmark(
    title="Bayesian regression",
    work="Ten of the inputs matter. Bayesian ridge knows no noise of inputs and attenuates; it is "
    "what one would pick. Errors are of the coefficients of the inputs without noise.",
    compared="CPU, ms",
    lines=lines,
)
