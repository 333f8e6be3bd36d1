"""The covariance of least squares whose errors are correlated from row to row.

Rows behind a low-pass share their noise: to count them as independent makes intervals too narrow.
The colour of each joint's residual is measured, as far as its filters leave it open, and carried to
the estimate: C = G [sum over joints j and lags k of r_j(k) sum over t of x_tj x_(t+k)j' w_j^4] G
with G = (X' W^2 X)^-1.

Source: the form is that of H. White, "Asymptotic Theory for Econometricians" (1984), for stationary
errors. That a fit takes freedom from its residual is accounted for exactly (`_seen`), and that the
colour is known from few values by wider intervals (`known_spectrum`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from scipy.optimize import nnls

from dynident.clusters import over_recordings
from dynident.fitting.linear_solution import LinearSolution, solve_factors
from dynident.fitting.sampling import rows, sample
from dynident.fitting.uncertainty.known_spectrum import MeasuredSpectrum, widths
from dynident.fitting.uncertainty.lagged_rows import (
    LAGS,
    gather_columns,
    lagged_columns,
    of_all_rows,
)
from dynident.fitting.uncertainty.noise_shapes import noise_shapes
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, factorise
from dynident.moments.lagged import (
    LaggedColumns,
    LaggedProducts,
    RowBlock,
    lagged_products,
    lagged_residuals,
)
from dynident.recording import Dataset, Filter, Recording
from dynident.tables import number

RowsOf = Callable[[int], Iterator[tuple[np.ndarray, np.ndarray]]]
"""Columns (T, n, p) and torque (T, n) of a dataset's recording of a number, in blocks."""

_EXACT = 1e-10
"""Residual relative to the torque below which it is rounding, of no colour."""
_LEAST = 1e-2
"""Share of the mean variance that every direction has at least: lags are cut off."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RowErrors:
    """Errors of the rows of a fit, and what they do to it.

    Attributes
    ----------
    autocovariance : (n, K + 1) of each joint's error, (N m)^2 or N^2.
    meat : (p, p) covariance of the scores of the weighted rows, X' W^2 e, widened as the next one.
    covariance : (r, r) of the independent parameters, so wide that 1.96 standard deviations hold
        95 %, see `known_spectrum`.
    measured : (r, r) the same as it was measured.
    freedom : degrees of freedom of its least known direction.
    rows : equations.
    effective_rows : independent equations that would say as much.
    """

    autocovariance: np.ndarray
    meat: np.ndarray
    covariance: np.ndarray
    measured: np.ndarray
    freedom: float
    rows: int
    effective_rows: float

    @property
    def words(self) -> str:
        """What the standard deviations hold, and what they do not."""
        return (
            "sigma holds the noise with the colour that it has in the rows: the equations say as "
            f"much as {number(self.effective_rows, 3)} independent ones. What the model lacks is "
            "in it only as far as it looks like noise."
        )


def row_errors(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    solution: LinearSolution,
    columns: LaggedColumns | None = None,
) -> RowErrors:
    """Measure the errors of a fit in one more pass over its rows.

    Parameters
    ----------
    model : of p parameters.
    dataset : what was fitted.
    values : (p,) the estimate, and where columns that depend on it are taken.
    solution : its weights and independent columns.
    columns : lagged products of all columns, from `factors_with_columns`, where the rows
        have passed by already; else they are gathered here.

    Returns
    -------
    Their covariance, and that of the estimate.
    """
    if columns is None:
        columns = lagged_columns(dataset)
        gather_columns(model, dataset, values, columns)
    arguments = (model, dataset.filter, values, columns.lags)
    passes = over_recordings(dataset.recordings, _residuals_of, *arguments)
    residual, pairs, squares = (np.sum(one, axis=0) for one in zip(*passes, strict=True))
    shapes = noise_shapes(sample(dataset.recordings[0], dataset.filter), columns.lags)
    kept = list(solution.basis.independent)
    products = columns.columns[:, :, kept][:, :, :, kept]
    if not columns.complete:
        counts = [sample(one, dataset.filter).count for one in dataset.recordings]
        every = [sum(max(0, count - k) for count in counts) for k in range(columns.lags + 1)]
        products = of_all_rows(products, columns.pairs, np.array(every), solution)
        if products is None:  # what is left out shows more than its share
            columns = LaggedColumns(columns.lags)
            gather_columns(model, dataset, values, columns)
            products = columns.columns[:, :, kept][:, :, :, kept]
    found = LaggedProducts(columns=products, residual=residual, pairs=pairs)
    return errors_of(found, shapes, solution, squares)


def _residuals_of(
    recording: Recording, model: Model, settings: Filter | None, values: np.ndarray, lags: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lagged sums of a recording's residuals (n, K + 1), their pairs, and torque squares (n,)."""
    squares = np.zeros(model.robot.n)

    def residuals() -> Iterator[tuple[bool, np.ndarray, np.ndarray]]:
        sampled, start = sample(recording, settings), 0
        for left, torque in sampled.residuals(model, values):
            squares[:] += np.sum(torque**2, axis=0)
            yield start == 0, left, sampled.counting[start : start + len(left)]
            start += len(left)

    return *lagged_residuals(residuals(), lags), squares


def masked_row_errors(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    solution: LinearSolution,
    counting: Sequence[np.ndarray],
    rows_of: RowsOf | None = None,
) -> RowErrors:
    """As `row_errors`, of rows of which not all were fitted.

    Parameters
    ----------
    model, dataset, values, solution : as there.
    counting : mask (T, n) for each recording of the decimated rows that were fitted, joint by
        joint.
    rows_of : the rows of each recording, where they are known; else they are evaluated here.

    Returns
    -------
    Their covariance, and that of the estimate.
    """
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    lags = min(LAGS, *(one.count // 10 for one in samples))
    kept, squares = list(solution.basis.independent), np.zeros(model.robot.n)
    rows_of = rows_of or (lambda k: samples[k].rows(model, values))

    def blocks() -> Iterator[RowBlock]:
        for k, counts in enumerate(counting):
            start = 0
            for columns, torque in rows_of(k):
                mask = counts[start : start + len(torque)]
                squares[:] += np.sum((torque * mask) ** 2, axis=0)
                yield start == 0, columns[:, :, kept], torque - columns @ values, mask
                start += len(torque)

    products = lagged_products(blocks(), lags)
    return errors_of(products, noise_shapes(samples[0], lags), solution, squares)


def row_covariance(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    counting: Sequence[np.ndarray] | None = None,
    rows_of: RowsOf | None = None,
) -> tuple[np.ndarray, RowErrors]:
    """Return the covariance (p, p) of least squares at values (p,), and the errors behind it.

    Parameters
    ----------
    model, dataset : what was fitted to what.
    values : (p,) what came out, by whichever way.
    counting : as of `masked_row_errors`; None for all rows.
    rows_of : as of `masked_row_errors`; only where not all rows count.

    Returns
    -------
    Its rows of dependent parameters are zero.

    Raises
    ------
    FitError
        As `solve_factors`.
    """
    solution = solve_factors(model, _factors(model, dataset, values, counting, rows_of))
    if counting is None:
        found = row_errors(model, dataset, values, solution)
    else:
        found = masked_row_errors(model, dataset, values, solution, counting, rows_of)
    kept = list(solution.basis.independent)
    covariance = np.zeros_like(solution.covariance)
    covariance[np.ix_(kept, kept)] = found.covariance
    return covariance, found


def errors_of(
    products: LaggedProducts,
    shapes: np.ndarray,
    solution: LinearSolution,
    torque_squares: np.ndarray,
) -> RowErrors:
    """Return the errors of a fit from lagged products of its rows.

    Parameters
    ----------
    products : of the independent columns and the residuals.
    shapes : (S, K + 1) autocorrelations that the errors may be made of.
    solution : least squares, that chose them.
    torque_squares : (n,) sum of squares of the torque, below which residuals are rounding.
    """
    # In directions in which the weighted columns are orthonormal: no condition number is squared.
    weights, turn = solution.weights, solution.inverse
    n, rank = len(weights), len(turn)
    inner = products.columns * (weights**2)[:, None, None, None]
    white = turn.T @ inner @ turn
    counts = products.pairs[:, 0]
    count, total = float(counts.mean()), float(counts.sum())
    # Both directions of time.
    both = white + white.transpose(0, 1, 3, 2)
    both[:, 0] = white[:, 0]
    seen = _seen(white, both, products.pairs)
    left = products.residual * (weights**2)[:, None]
    exact = products.residual[:, 0] <= _EXACT**2 * torque_squares
    found = np.empty_like(left)
    basis = np.kron(np.eye(n), shapes.T)  # (n (K + 1), n S)
    amounts = nnls(seen @ basis / count, left.ravel() / count)[0]
    found = (basis @ amounts).reshape(left.shape)
    there = amounts > 0.0
    spectrum = MeasuredSpectrum(
        seen=seen @ basis[:, there] / count,
        shapes=basis[:, there],
        amounts=amounts[there],
        pairs=counts,
        count=count,
    )
    found[exact] = 0.0
    found[exact, 0] = left[exact, 0] / np.maximum(counts[exact], 1.0)
    inside = np.einsum("jk,jkab->ab", found, both)
    values, vectors = np.linalg.eigh((inside + inside.T) / 2)
    values = np.maximum(values, _LEAST * found[:, 0].mean())
    half = turn @ (vectors * np.sqrt(values))
    measured = half @ half.T
    plain = turn @ turn.T * float(left[:, 0].sum() / (total - rank))
    ratio = np.diag(plain) / np.diag(measured)
    each = np.einsum("ai,jkab,bi->ijk", vectors, both, vectors, optimize=True)
    freedom = spectrum.freedom(each.reshape(len(values), -1))
    values = values * widths(freedom) ** 2
    half = turn @ (vectors * np.sqrt(values))
    wide = np.linalg.solve(turn.T, vectors * np.sqrt(values)).T @ solution.basis.combination
    return RowErrors(
        autocovariance=found / (weights**2)[:, None],
        meat=wide.T @ wide,
        covariance=half @ half.T,
        measured=measured,
        freedom=float(freedom.min()),
        rows=int(total),
        effective_rows=float(total * np.exp(np.mean(np.log(ratio)))),
    )


def _seen(white: np.ndarray, both: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """What lagged sums of residuals are in the mean, for a unit of each autocovariance.

    Of errors u with covariance R a fit leaves (I - H) u, H = X G X' W^2, with the covariance
    R - H R - R H' + H R H'.

    Parameters
    ----------
    white, both : (n, K + 1, r, r) lagged products of orthonormal columns, and of both directions.
    pairs : (n, K + 1) of rows.

    Returns
    -------
    (n (K + 1), n (K + 1))
    """
    n, count, r, _ = white.shape
    traces = np.trace(white, axis1=2, axis2=3)
    flat = white.reshape(n * count, r * r)
    found = flat @ both.reshape(n * count, r * r).T
    for j in range(n):
        here = found[j * count : (j + 1) * count, j * count : (j + 1) * count]
        for k in range(count):
            here[k, k] += pairs[j, k]
            for m in range(count):
                for lag in (k + m, abs(k - m)) if m else (k,):
                    if lag < count:
                        here[k, m] -= 2 * traces[j, lag]
    return found


def _factors(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    counting: Sequence[np.ndarray] | None,
    rows_of: RowsOf | None,
) -> TriangularFactors:
    """Factors of the rows that count."""
    if counting is None:
        return factorise(rows(model, dataset, values))
    counts, many = np.concatenate(counting), len(counting)

    def weighted() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        whole = rows(model, dataset, values)
        if rows_of is not None:
            whole = chain.from_iterable(map(rows_of, range(many)))
        start = 0
        for columns, torque in whole:
            mask = counts[start : start + len(torque)]
            yield columns * mask[:, :, None], torque * mask
            start += len(torque)

    return factorise(weighted())
