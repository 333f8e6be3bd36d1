"""Second moments by their products: sums over rows, which then are never needed again.

The diagnosis and the regressions are linear algebra on these, block of time by block of time or of
all rows at once. They come about the mean or about zero, and with or without the noise:

- About the *mean*, because products about zero lose digits to a large offset. Only the regressions
  with a constant need that.
- With the part that is *free of noise*, because squares of noisy columns are biased: least squares
  on them shrinks parameters and gives false effects. Products of different replicates are not
  biased: the columns of one period are instruments for the others (`moments.replicates`).

Where a factor of the rows is worth its cost, see `moments.factors`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add

import numpy as np

from dynident.errors import FitError

_CONSTANT = 1e-12
"""Spread over magnitude below which a column is a constant and the rest is rounding."""
_LEAST_SQUARES = 1e-290
"""Sum of squares below which products of columns lose digits, or are zero."""


@dataclass(frozen=True, eq=False)
class SecondMoments:
    """Sums of products of columns over rows; those of other rows add up.

    The columns are those of a regression, with the output last (the torque, as a rule). The
    products may also be those of one set of columns with another one.

    Attributes
    ----------
    total : (..., a, b) plain products; where there is a leading dimension, of each block of rows.
    counts : (...) rows; where there is a leading dimension, of each block.
    mean : (..., a) of the columns, about which the products are; None where they are about zero.
    noise_free : (..., a, b) products without noise in the mean; None where nothing distinguishes
        noise from signal.

    Examples
    --------
    Each recording where its file is, and their sum over processes or a Dask cluster:

    >>> import operator
    >>> from functools import reduce
    >>> def of_file(path):
    ...     X, y = rows_of(path)
    ...     return di.regression.SecondMoments.of(X, y)
    >>> futures = client.map(of_file, paths)  # client: of dask.distributed
    >>> total = client.submit(reduce, operator.add, futures).result()
    >>> di.regression.BayesianFactorRegression().fit_statistics(total)
    """

    total: np.ndarray
    counts: np.ndarray | int
    mean: np.ndarray | None = None
    noise_free: np.ndarray | None = None

    # --- making ---------------------------------------------------------------------------------

    @classmethod
    def of(cls, X: np.ndarray, y: np.ndarray) -> SecondMoments:
        """Return the moments about the mean of one block of rows, (N, d) and (N,).

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
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):  # reported below
            np.subtract(X, first[:-1], out=rows[:, :-1])
            np.subtract(y, first[-1], out=rows[:, -1])
            mean = rows.mean(axis=0)
            rows -= mean
            products = rows.T @ rows
        squares = np.diag(products)
        lost = [m for m in np.flatnonzero(squares < _LEAST_SQUARES) if np.any(rows[:, m])]
        bad = sorted([*np.flatnonzero(~np.isfinite(squares)), *lost])
        if bad:
            where = "the output" if bad[0] == X.shape[1] else f"input {bad[0]}"
            what = "holds NaN, infinity, or numbers whose squares overflow"
            if bad[0] in lost:
                what = "varies by so little that the squares underflow"
            raise FitError(what, where, "clean or scale it first")
        return cls(products, len(X), first + mean)

    @classmethod
    def over(cls, blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> SecondMoments:
        """Return the moments of all blocks' rows together; none of them is kept.

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

    def __add__(self, other: SecondMoments) -> SecondMoments:
        """Return the moments of the rows of both, block by block.

        About the mean: Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for
        computing sample variances" (1979).

        Raises
        ------
        FitError
            If they are of different columns.
        """
        if self.total.shape != other.total.shape:
            what = f"{other.inputs} inputs after {self.inputs}"
            raise FitError(what, remedy="the blocks of one regression have the same inputs")
        counts, total = self.counts + other.counts, self.total + other.total
        free = None
        if self.noise_free is not None or other.noise_free is not None:
            free = self.signal + other.signal
        if self.mean is None or other.mean is None:
            return SecondMoments(total, counts, None, free)
        apart = other.mean - self.mean
        share = self.counts * other.counts / counts
        total = total + share * np.outer(apart, apart)
        return SecondMoments(total, counts, self.mean + other.counts / counts * apart, free)

    @classmethod
    def stacked(cls, parts: Sequence[SecondMoments]) -> SecondMoments:
        """Return the blocks of all parts, about zero, side by side."""
        free = None
        if any(part.noise_free is not None for part in parts):
            free = np.concatenate([part.signal for part in parts])
        total = np.concatenate([part.total for part in parts])
        return cls(total, np.concatenate([np.atleast_1d(p.counts) for p in parts]), None, free)

    @property
    def count(self) -> int:
        """Rows of all blocks, N."""
        counts = self.counts  # asked for a hundred thousand times in a diagnosis
        return int(counts.sum() if isinstance(counts, np.ndarray) else counts)

    # --- blocks of rows -------------------------------------------------------------------------

    @property
    def signal(self) -> np.ndarray:
        """Products free of noise in the mean, where it is known; plain ones elsewhere."""
        return self.total if self.noise_free is None else self.noise_free

    def pooled(self) -> SecondMoments:
        """Return the moments of the rows of all blocks together."""
        return self._pooled

    @cached_property
    def _pooled(self) -> SecondMoments:
        return self._with(lambda products: products.sum(axis=0), self.count)

    def without_each(self) -> Iterator[SecondMoments]:
        """Yield the moments of the rows of all blocks but one, for each of them."""
        whole, free = self.pooled(), self.noise_free
        for block, count in enumerate(np.atleast_1d(self.counts).tolist()):
            total = whole.total - self.total[block]
            left = None if free is None else whole.signal - free[block]
            yield SecondMoments(total, whole.count - int(count), None, left)

    def with_signal(self, signal: np.ndarray) -> SecondMoments:
        """Take other products (..., a, b) for those free of noise."""
        return replace(self, noise_free=signal)

    def weighted(self, weights: np.ndarray) -> SecondMoments:
        """Return the moments with each block's products times its weight, (B,)."""
        return self._with(lambda products: products * weights[:, None, None])

    def columns(self, chosen: slice | np.ndarray) -> SecondMoments:
        """Return the products of all columns with some of the other set."""
        return self._with(lambda products: products[..., chosen], mean=self.mean)

    def at(self, place: int) -> SecondMoments:
        """Return one of several sets of products (B, ..., a, b) of the same rows."""
        return self._with(lambda products: products[:, place])

    def where(self, kept: np.ndarray) -> SecondMoments:
        """Return products, 0 where a mask of their shape, or of its last axes, is False."""
        return self._with(lambda products: np.where(kept, products, 0.0))

    def as_set(self) -> SecondMoments:
        """Return the products (..., a, b) as the only one of several sets, (..., 1, a, b)."""
        return self._with(lambda products: products[..., None, :, :])

    def among(self, chosen: slice | np.ndarray) -> SecondMoments:
        """Return the products of some columns with each other."""
        mean = None if self.mean is None else self.mean[..., chosen]
        return self._with(lambda products: products[..., chosen, :][..., chosen], mean=mean)

    def _with(
        self,
        change: Callable[[np.ndarray], np.ndarray],
        counts: int | None = None,
        mean: np.ndarray | None = None,
    ) -> SecondMoments:
        """The moments with both kinds of products changed alike."""
        return SecondMoments(
            change(self.total),
            self.counts if counts is None else counts,
            mean,
            None if self.noise_free is None else change(self.noise_free),
        )

    # --- one regression -------------------------------------------------------------------------

    @property
    def inputs(self) -> int:
        """Number of inputs, d."""
        return self.total.shape[-1] - 1

    @property
    def gram(self) -> np.ndarray:
        """X'X about the mean, or zero, (..., d, d)."""
        return self.total[..., :-1, :-1]

    @property
    def cross(self) -> np.ndarray:
        """X'y about the mean, or zero, (..., d)."""
        return self.total[..., :-1, -1]

    @property
    def power(self) -> float:
        """Sum of squares of the output about its mean, or zero, y'y."""
        return float(self.total[-1, -1])

    @property
    def centre(self) -> np.ndarray:
        """What the products are about, (d + 1,)."""
        return np.zeros(len(self.total)) if self.mean is None else self.mean

    @property
    def scale(self) -> np.ndarray:
        """Root mean square about the mean, (d + 1,); zero where nothing but rounding is left."""
        spread = np.sqrt(np.diag(self.total) / self.count)
        return np.where(spread > _CONSTANT * np.abs(self.centre), spread, 0.0)

    def about_origin(self) -> SecondMoments:
        """Return the moments about zero: those of a regression without a constant."""
        raw = self.count * np.outer(self.centre, self.centre)
        return self._with(lambda products: products + raw)

    def scaled(self, factors: np.ndarray) -> SecondMoments:
        """Return the moments of inputs and output times their factors, (d + 1,)."""
        # One side after the other: the product of two factors may be no number.
        mean = None if self.mean is None else self.mean * factors
        return self._with(lambda products: products * factors * factors[:, None], mean=mean)

    def keeping(self, inputs: np.ndarray) -> SecondMoments:
        """Return the moments of some inputs, by number or mask, and the output."""
        return self.among(np.append(np.arange(self.inputs)[inputs], self.inputs))

    def residual(self, coefficients: np.ndarray) -> float:
        """Sum of squares that coefficients (d,) leave of the output about its mean, or zero."""
        signed = np.ones(len(coefficients) + 1)
        np.negative(coefficients, out=signed[:-1])
        return max(float(signed @ self.total @ signed), 0.0)
