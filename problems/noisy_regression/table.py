"""Noise in a hundred inputs: the study of figure 2, all eight cells, six methods and two more.

    python problems/noisy_regression/table.py
    python problems/noisy_regression/table.py --rows 10000 --trials 10 --jobs 4
    python problems/noisy_regression/table.py --plot figure.png

Errors are normalised mean squared errors on fresh test inputs: noiseless ones, which b_true is for,
and noisy ones, which b_noise is for. Methods that have one set of coefficients are tried on both.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed
from rich.progress import track
from scipy import stats
from sklearn.cross_decomposition import PLSRegression
from sklearn.linear_model import LassoCV
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from dynident.regression.bayesian_factors import BayesianFactorRegression
from dynident.regression.joint_factors import JointFactorRegression
from dynident.regression.ordinary import TruncatedLeastSquares
from dynident.regression.stepwise import StepwiseRegression
from dynident.tables import Table, print_tables
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
PUBLISHED = tomllib.loads((HERE / "published.toml").read_text())
RELEVANT: int = PUBLISHED["relevant"]
TEST_ROWS = 2000
CONSTANT = 0.8
"""Reliability that the Bayesian estimator starts at: what dividing by it alone brings."""
SETS = ("noiseless", "noisy")


@dataclass(frozen=True)
class Cell:
    """One column of one panel of the figure."""

    input_snr: float
    redundant: int
    irrelevant: int

    @property
    def name(self) -> str:
        return f"SNR {self.input_snr:g}, r = {self.redundant}, u = {self.irrelevant}"


CELLS = tuple(
    Cell(snr, *column) for snr in PUBLISHED["input_snr"] for column in PUBLISHED["columns"]
)


@dataclass(frozen=True, eq=False)
class Sample:
    """Inputs (N, 100) and outputs (N,) of a trial; noise is the relevant inputs' own, (100,)."""

    X: np.ndarray
    y: np.ndarray
    tests: dict[str, tuple[np.ndarray, np.ndarray]]
    noise: np.ndarray


def draw(cell: Cell, rows: int, seed: int) -> Sample:
    """Draw a trial."""
    rng = np.random.default_rng([seed, CELLS.index(cell)])
    A = rng.standard_normal((RELEVANT, RELEVANT))
    covariance = A @ A.T
    coefficients = np.arange(1.0, RELEVANT + 1)
    input_std = np.sqrt(np.diag(covariance) / cell.input_snr)
    output_std = np.sqrt(coefficients @ covariance @ coefficients / PUBLISHED["output_snr"])
    combinations = rng.dirichlet(np.ones(RELEVANT), size=cell.redundant)

    def inputs(count: int, *, noisy: bool) -> tuple[np.ndarray, np.ndarray]:
        T = rng.standard_normal((count, RELEVANT)) @ A.T
        y = T @ coefficients
        if noisy:
            T = T + input_std * rng.standard_normal(T.shape)
            y = y + output_std * rng.standard_normal(count)
        # Combinations of what is measured carry its noise.
        return np.hstack([T, T @ combinations.T, rng.standard_normal((count, cell.irrelevant))]), y

    X, y = inputs(rows, noisy=True)
    tests = {name: inputs(TEST_ROWS, noisy=name == "noisy") for name in SETS}
    redundant = combinations**2 @ input_std**2
    noise = np.concatenate([input_std**2, redundant, np.zeros(cell.irrelevant)])
    return Sample(X, y, tests, noise)


Predict = Callable[[np.ndarray, str], np.ndarray]
"""Outputs (N,) predicted of inputs (N, 100) that are "noiseless" or "noisy"."""


def _of_factors(regression: JointFactorRegression) -> Predict:
    def predict(X: np.ndarray, kind: str) -> np.ndarray:
        if kind == "noisy":
            return X @ regression.coef_noisy_ + regression.intercept_noisy_
        return X @ regression.coef_true_ + regression.intercept_true_

    return predict


def _enlarged(regression: StepwiseRegression) -> Predict:
    """Coefficients divided by a constant for noiseless inputs, and as they are for noisy ones."""

    def predict(X: np.ndarray, kind: str) -> np.ndarray:
        factor = 1.0 if kind == "noisy" else 1.0 / CONSTANT
        return factor * (X @ regression.coef_) + regression.intercept_

    return predict


def _of(regression: Any) -> Predict:
    return lambda X, kind: np.ravel(regression.predict(X))


def _pls() -> Any:
    components = {"plsregression__n_components": np.arange(1, 31)}
    return GridSearchCV(
        make_pipeline(StandardScaler(), PLSRegression()),
        components,
        cv=5,
        scoring="neg_mean_squared_error",
    )


def _lasso() -> Any:
    return make_pipeline(StandardScaler(), LassoCV(cv=5, max_iter=100_000))


METHODS: dict[str, Callable[[Sample], Predict]] = {
    "OLS": lambda s: _of(TruncatedLeastSquares().fit(s.X, s.y)),
    "stepwise": lambda s: _of(StepwiseRegression().fit(s.X, s.y)),
    f"stepwise / {CONSTANT}": lambda s: _enlarged(StepwiseRegression().fit(s.X, s.y)),
    "PLS": lambda s: _of(_pls().fit(s.X, s.y)),
    "LASSO": lambda s: _of(_lasso().fit(s.X, s.y)),
    "JFA": lambda s: _of_factors(JointFactorRegression().fit(s.X, s.y)),
    "Bayes": lambda s: _of_factors(BayesianFactorRegression().fit(s.X, s.y)),
    "Bayes, noise known": lambda s: _of_factors(BayesianFactorRegression(s.noise).fit(s.X, s.y)),
}


@single_threaded
def trial(cell: Cell, rows: int, seed: int) -> dict[tuple[str, str], float]:
    """Errors of one trial: by method and test set."""
    sample = draw(cell, rows, seed)
    found = {}
    for name, method in METHODS.items():
        predict = method(sample)
        for kind, (X, y) in sample.tests.items():
            found[name, kind] = float(np.mean((predict(X, kind) - y) ** 2) / np.var(y))
    return found


@dataclass(frozen=True, eq=False)
class Study:
    """Errors of all trials: (trials,) by cell, method and test set."""

    errors: dict[tuple[Cell, str, str], np.ndarray]

    def change(self, cell: Cell, method: str, kind: str, other: str = "OLS") -> tuple[float, float]:
        """Change of the mean error against another method's in the same trials, per cent.

        With its standard error (delta method).
        """
        own, plain = self.errors[cell, method, kind], self.errors[cell, other, kind]
        size = float(np.mean(plain))
        ratio = float(np.mean(own)) / size
        return 100 * (ratio - 1), 100 * float(stats.sem(own - ratio * plain)) / size

    def table(self, kind: str) -> Table:
        rows = []
        for cell in CELLS:
            for name in METHODS:
                errors = self.errors[cell, name, kind]
                change, doubt = self.change(cell, name, kind)
                rows.append(
                    (
                        cell.name if name == "OLS" else "",
                        name,
                        f"{np.mean(errors):.4f} +- {stats.sem(errors):.4f}",
                        "" if name == "OLS" else f"{change:+.0f} +- {doubt:.0f} %",
                        _claim(cell) if (name, kind) == ("Bayes", "noiseless") else "",
                    )
                )
        columns = ("inputs", "method", "nMSE", "against OLS", "claimed of Bayes")
        return Table(f"{kind.capitalize()} test inputs", columns, tuple(rows))

    def rivals(self) -> Table:
        """Bayes against each method that is not told the noise, either: what the paper claims."""
        others = [name for name in METHODS if not name.startswith("Bayes")]
        rows = []
        for cell in CELLS:
            each = [self.change(cell, "Bayes", "noiseless", other) for other in others]
            cells = (f"{change:+.0f} +- {doubt:.0f} %" for change, doubt in each)
            rows.append((cell.name, *cells, _claim(cell)))
        columns = ("inputs", *(f"against {name}" for name in others), "claimed")
        return Table("Bayes, noiseless test inputs", columns, tuple(rows))


def _claim(cell: Cell) -> str:
    least, most = PUBLISHED["claims"][f"paper_snr_{cell.input_snr:g}"]
    return f"{-least} to {-most} % of the others"


def study(rows: int, trials: int, jobs: int, seed: int = 0) -> Study:
    """Run all trials of all cells; a trial's inputs depend on its seed alone."""
    work = [(cell, seed + k) for cell in CELLS for k in range(trials)]
    done = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(trial)(cell, rows, one) for cell, one in work
    )
    every: dict[tuple[Cell, str, str], list[float]] = {}
    shown: Iterator[Any] = iter(track(done, "trials", total=len(work), transient=True))
    for (cell, _), found in zip(work, shown, strict=True):
        for (name, kind), error in found.items():
            every.setdefault((cell, name, kind), []).append(error)
    return Study({key: np.array(values) for key, values in every.items()})


def figure(found: Study) -> Figure:
    """Draw the bars of figure 2, with standard errors: noiseless test inputs."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(11, 7), layout="constrained")
    panels = picture.subplots(2, 1, sharex=True)
    width = 0.8 / len(METHODS)
    for panel, snr in zip(panels, PUBLISHED["input_snr"], strict=True):
        cells = [cell for cell in CELLS if cell.input_snr == snr]
        for k, name in enumerate(METHODS):
            each = [found.errors[cell, name, "noiseless"] for cell in cells]
            place = np.arange(len(cells)) + (k - (len(METHODS) - 1) / 2) * width
            panel.bar(
                place,
                [np.mean(one) for one in each],
                width,
                yerr=[stats.sem(one) for one in each],
                label=name,
                color=f"C{k}",
                capsize=2,
            )
        least, most = PUBLISHED["claims"][f"paper_snr_{snr:g}"]
        for k, cell in enumerate(cells):
            plain = float(np.mean(found.errors[cell, "OLS", "noiseless"]))
            band = [plain * (1 - share / 100) for share in (most, least)]
            label = "claimed of Bayes, against OLS" if k == 0 else None
            panel.fill_between([k - 0.45, k + 0.45], *band, color="0.85", zorder=0, label=label)
        panel.set_ylabel("nMSE, noiseless test inputs")
        panel.set_title(f"input SNR {snr:g}", loc="left")
        panel.set_xticks(
            range(len(cells)), [f"r = {cell.redundant}, u = {cell.irrelevant}" for cell in cells]
        )
    panels[0].legend(ncols=4, fontsize="small")
    return picture


def main() -> None:
    """Print the tables, and draw the bars where asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=PUBLISHED["chosen"]["rows"])
    parser.add_argument("--trials", type=int, default=PUBLISHED["chosen"]["trials"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--plot", type=Path)
    asked = parser.parse_args()
    found = study(asked.rows, asked.trials, asked.jobs, asked.seed)
    print_tables(*(found.table(kind) for kind in SETS), found.rivals())
    if asked.plot:
        figure(found).savefig(asked.plot, dpi=150)


if __name__ == "__main__":
    main()
