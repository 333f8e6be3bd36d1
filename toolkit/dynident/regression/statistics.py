"""Sufficient statistics of a linear regression: one pass over the rows, then no row again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from dynident.errors import FitError

_CONSTANT = 1e-12
"""Spread over magnitude below which an input is a constant and the rest is rounding."""
_LEAST_SQUARES = 1e-290
"""Sum of squares below which products of inputs lose digits, or are zero."""


@dataclass(frozen=True, eq=False)
class Statistics:
    """Count, means and scatter of inputs and output; those of several blocks add up.

    Attributes
    ----------
    count : rows seen, N.
    mean : (d + 1,) of the inputs, and of the output at the end.
    scatter : (d + 1, d + 1) sums of products about the mean, the output last.

    Examples
    --------
    Each recording where its file is, and their sum over processes or a Dask cluster:

    >>> import operator
    >>> from functools import reduce
    >>> def of_file(path):
    ...     X, y = rows_of(path)
    ...     return di.regression.Statistics.of(X, y)
    >>> futures = client.map(of_file, paths)  # client: of dask.distributed
    >>> total = client.submit(reduce, operator.add, futures).result()
    >>> di.regression.BayesianFactorRegression().fit_statistics(total)
    """

    count: int
    mean: np.ndarray
    scatter: np.ndarray

    @classmethod
    def of(cls, X: np.ndarray, y: np.ndarray) -> Statistics:
        """Return the statistics of one block of rows, (N, d) and (N,).

        Raises
        ------
        FitError
            If there is no row, X and y differ in their rows, or a number is not finite, or too
            large or too small to be squared.
        """
        X, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
        if X.ndim != 2 or y.shape != X.shape[:1] or not len(X):
            what = f"inputs of shape {X.shape} beside an output of shape {y.shape}"
            raise FitError(what, remedy="give (N, d) and (N,), N at least 1")
        # About the block's own mean: sums of squares about zero lose digits to a large offset.
        # From the first row: what is constant is then zero, not the rounding of a long sum.
        first = np.append(X[0], y[0])
        rows = np.empty((len(X), len(first)))
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):  # told below, by name
            np.subtract(X, first[:-1], out=rows[:, :-1])
            np.subtract(y, first[-1], out=rows[:, -1])
            mean = rows.mean(axis=0)
            rows -= mean
            scatter = rows.T @ rows
        squares = np.diag(scatter)
        lost = [m for m in np.flatnonzero(squares < _LEAST_SQUARES) if np.any(rows[:, m])]
        bad = sorted([*np.flatnonzero(~np.isfinite(squares)), *lost])
        if bad:
            where = "the output" if bad[0] == X.shape[1] else f"input {bad[0]}"
            what = "holds NaN, infinity, or numbers whose squares overflow"
            if bad[0] in lost:
                what = "varies by so little that the squares underflow"
            raise FitError(what, where, "clean or scale it first")
        return cls(len(X), first + mean, scatter)

    @classmethod
    def over(cls, blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> Statistics:
        """Return the statistics of all blocks together; none of them is kept.

        Raises
        ------
        FitError
            As `of`; or if there is no block.
        """
        each = (cls.of(X, y) for X, y in blocks)
        first = next(each, None)
        if first is None:
            raise FitError("no rows", remedy="give at least one block")
        return reduce(add, each, first)

    def __add__(self, other: Statistics) -> Statistics:
        """Return the statistics of the rows of both.

        Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing sample
        variances" (1979).
        """
        if len(self.mean) != len(other.mean):
            what = f"{len(other.mean) - 1} inputs after {len(self.mean) - 1}"
            raise FitError(what, remedy="the blocks of one regression have the same inputs")
        count = self.count + other.count
        apart = other.mean - self.mean
        share = self.count * other.count / count
        scatter = self.scatter + other.scatter + share * np.outer(apart, apart)
        return Statistics(count, self.mean + other.count / count * apart, scatter)

    @property
    def inputs(self) -> int:
        """Number of inputs, d."""
        return len(self.mean) - 1

    @property
    def gram(self) -> np.ndarray:
        """X'X about the mean, (d, d)."""
        return self.scatter[:-1, :-1]

    @property
    def cross(self) -> np.ndarray:
        """X'y about the mean, (d,)."""
        return self.scatter[:-1, -1]

    @property
    def power(self) -> float:
        """Sum of squares of the output about its mean, y'y."""
        return float(self.scatter[-1, -1])

    @property
    def scale(self) -> np.ndarray:
        """Root mean square about the mean, (d + 1,); zero where nothing but rounding is left."""
        spread = np.sqrt(np.diag(self.scatter) / self.count)
        return np.where(spread > _CONSTANT * np.abs(self.mean), spread, 0.0)

    def about_origin(self) -> Statistics:
        """Return the statistics about zero: those of a regression without a constant."""
        raw = self.scatter + self.count * np.outer(self.mean, self.mean)
        return Statistics(self.count, np.zeros_like(self.mean), raw)

    def scaled(self, factors: np.ndarray) -> Statistics:
        """Return the statistics of inputs and output times their factors, (d + 1,)."""
        # One side after the other: the product of two factors may be no number.
        scatter = self.scatter * factors * factors[:, None]
        return Statistics(self.count, self.mean * factors, scatter)

    def keeping(self, inputs: np.ndarray) -> Statistics:
        """Return the statistics of some inputs, by number or mask, and the output."""
        kept = np.append(np.arange(self.inputs)[inputs], self.inputs)
        return Statistics(self.count, self.mean[kept], self.scatter[np.ix_(kept, kept)])

    def residual(self, coefficients: np.ndarray) -> float:
        """Sum of squares that coefficients (d,) leave of the output about its mean."""
        signed = np.append(-coefficients, 1.0)
        return max(float(signed @ self.scatter @ signed), 0.0)
