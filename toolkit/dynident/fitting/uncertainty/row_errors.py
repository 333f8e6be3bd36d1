"""The covariance of least squares whose errors are correlated from row to row.

Rows behind a low-pass share their noise: to count them as independent makes intervals too narrow.
The colour of each joint's residual is measured, as far as its filters leave it open, and carried to
the estimate: C = G [sum over joints j and lags k of r_j(k) sum over t of x_tj x_(t+k)j' w_j^4] G
with G = (X' W^2 X)^-1.

Source: the form is that of H. White, "Asymptotic Theory for Econometricians" (1984), for stationary
errors. That a fit takes freedom from its residual is accounted for exactly (`_seen`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from dynident.fitting.linear_solution import LinearSolution, solve_factors
from dynident.fitting.sampling import Sampled, rows, sample
from dynident.fitting.uncertainty.noise_shapes import noise_shapes
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, factorise
from dynident.moments.lagged import LaggedProducts, RowBlock, lagged_products
from dynident.recording import Dataset
from dynident.tables import number

_LAGS = 12
"""Rows up to which errors count as correlated: the low-pass of the default filter forgets to 2 %
in 8, and 8 to 20 give the same coverage (measured)."""
_GAP = 1.5
"""Steps between rows above which a new stretch begins."""
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
    meat : (p, p) covariance of the scores of the weighted rows, X' W^2 e.
    covariance : (r, r) of the independent parameters.
    rows : equations.
    effective_rows : independent equations that would say as much.
    """

    autocovariance: np.ndarray
    meat: np.ndarray
    covariance: np.ndarray
    rows: int
    effective_rows: float

    @property
    def words(self) -> str:
        """What the standard deviations hold, and what they do not."""
        return (
            "sigma holds the noise with the colour that it has in the rows: the "
            f"{self.rows} equations say as much as {number(self.effective_rows, 3)} independent "
            "ones. What the model lacks is in it only as far as it looks like noise."
        )


def row_errors(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    solution: LinearSolution,
    counting: Sequence[np.ndarray] | None = None,
) -> RowErrors:
    """Measure the errors of a fit in one more pass over its rows.

    Parameters
    ----------
    model : of p parameters.
    dataset : what was fitted.
    values : (p,) the estimate, and where columns that depend on it are taken.
    solution : its weights and independent columns.
    counting : mask (T, n) for each recording of the decimated rows that were fitted, joint by
        joint; None for all.

    Returns
    -------
    Their covariance, and that of the estimate.
    """
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    lags = min(_LAGS, *(len(one.t) // 10 for one in samples))
    kept = list(solution.basis.independent)
    masks = _masks(samples, counting)
    products = lagged_products(_blocks(model, zip(samples, masks, strict=True), values, kept), lags)
    squares = np.sum(
        [np.sum((one.tau * mask) ** 2, axis=0) for one, mask in zip(samples, masks, strict=True)],
        axis=0,
    )
    return errors_of(products, noise_shapes(samples[0], lags), solution, squares)


def row_covariance(
    model: Model,
    dataset: Dataset,
    values: np.ndarray,
    counting: Sequence[np.ndarray] | None = None,
) -> tuple[np.ndarray, RowErrors]:
    """Return the covariance (p, p) of least squares at values (p,), and the errors behind it.

    Parameters
    ----------
    model, dataset : what was fitted to what.
    values : (p,) what came out, by whichever way.
    counting : as of `row_errors`.

    Returns
    -------
    Its rows of dependent parameters are zero.

    Raises
    ------
    FitError
        As `solve_factors`.
    """
    solution = solve_factors(model, _factors(model, dataset, values, counting))
    found = row_errors(model, dataset, values, solution, counting)
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
    found[exact] = 0.0
    found[exact, 0] = left[exact, 0] / np.maximum(counts[exact], 1.0)
    inside = np.einsum("jk,jkab->ab", found, both)
    values, vectors = np.linalg.eigh((inside + inside.T) / 2)
    values = np.maximum(values, _LEAST * found[:, 0].mean())
    half = turn @ (vectors * np.sqrt(values))
    covariance = half @ half.T
    plain = turn @ turn.T * float(left[:, 0].sum() / (total - rank))
    ratio = np.diag(plain) / np.diag(covariance)
    wide = np.linalg.solve(turn.T, vectors * np.sqrt(values)).T @ solution.basis.combination
    return RowErrors(
        autocovariance=found / (weights**2)[:, None],
        meat=wide.T @ wide,
        covariance=covariance,
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


def _masks(samples: list[Sampled], counting: Sequence[np.ndarray] | None) -> list[np.ndarray]:
    """Rows that count, (T, n) of each recording."""
    if counting is None:
        return [np.ones(one.tau.shape, dtype=bool) for one in samples]
    return list(counting)


def _factors(
    model: Model, dataset: Dataset, values: np.ndarray, counting: Sequence[np.ndarray] | None
) -> TriangularFactors:
    """Factors of the rows that count."""
    if counting is None:
        return factorise(rows(model, dataset, values))
    counts = np.concatenate(counting)

    def weighted() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        start = 0
        for columns, torque in rows(model, dataset, values):
            mask = counts[start : start + len(torque)]
            yield columns * mask[:, :, None], torque * mask
            start += len(torque)

    return replace(factorise(weighted()), counts=counts.sum(axis=0))


def _blocks(
    model: Model,
    sampled_with_counts: Iterable[tuple[Sampled, np.ndarray]],
    values: np.ndarray,
    kept: list[int],
) -> Iterator[RowBlock]:
    """Independent columns and residuals, with a mark where a stretch of rows begins."""
    for sampled, counts in sampled_with_counts:
        start, step = 0, _GAP / sampled.rate_hz
        for columns in sampled.columns(model, values):
            stop = start + len(columns)
            residual = sampled.tau[start:stop] - columns @ values
            gaps = np.flatnonzero(np.diff(sampled.t[start:stop]) > step) + 1
            begins = start == 0 or sampled.t[start] - sampled.t[start - 1] > step
            for first, last in zip([0, *gaps], [*gaps, len(columns)], strict=True):
                part = slice(first, last)
                mask = counts[start:stop][part]
                yield bool(begins or first), columns[part][:, :, kept], residual[part], mask
            start = stop
