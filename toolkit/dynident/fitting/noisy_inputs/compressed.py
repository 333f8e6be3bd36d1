"""Rows of a regression, folded into few that have the same sums of squares and products.

A triangular factor R of [X, y] has R'R = [X, y]'[X, y]: every linear regression sees the same
least-squares problem in it, and a regularised one the same path. One factor for each of some
consecutive pieces of the data, equally long, also gives cross-validation the errors that it would
have on the rows themselves, and estimates the scatter between the pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from dynident.moments.factors import TriangularFactors
from dynident.regression.statistics import Statistics


@dataclass(frozen=True, eq=False)
class Compressed:
    """Few rows for many.

    Attributes
    ----------
    X, y : (k, p) and (k,), with mean zero: a constant finds nothing to do.
    piece : (k,) number of the consecutive piece of data that each row stands for.
    count : rows of the data.
    """

    X: np.ndarray
    y: np.ndarray
    piece: np.ndarray
    count: int

    @property
    def statistics(self) -> Statistics:
        """Statistics of the data about the origin."""
        both = np.column_stack([self.X, self.y])
        scatter = both.T @ both * (self.count / len(both))
        return Statistics(self.count, np.zeros(both.shape[1]), scatter)


def compress(pieces: list[TriangularFactors], weights: np.ndarray) -> Compressed:
    """Return few rows for those behind the factors of consecutive pieces of data.

    Parameters
    ----------
    pieces : of the same joints.
    weights : (n,) of each joint's rows.
    """
    mirrored, labels = [], []
    for k, factors in enumerate(pieces):
        R = factors.pooled(weights) / np.sqrt(2.0)
        # Each row and its mirror image: the mean is zero, the squares are the same.
        mirrored.append(np.vstack([R, -R]))
        labels.append(np.full(2 * len(R), k))
    rows, count = np.vstack(mirrored), sum(factors.rows for factors in pieces)
    # Penalties count per row: as many squares a row as the data have.
    rows *= np.sqrt(len(rows) / count)
    return Compressed(rows[:, :-1], rows[:, -1], np.concatenate(labels), count)


def sandwich(rows: Compressed, coefficients: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Return the covariance of corrected least squares from the scatter between pieces, (p, p).

    Filtered noise is not independent from row to row, nor between the joints of one instant: what
    the pieces contribute to the normal equations is, if they are long against the filter.

    Parameters
    ----------
    rows : in pieces.
    coefficients : (p,) of corrected least squares.
    psi : (p, p) input noise of a row.

    Notes
    -----
    White, "Maximum likelihood estimation of misspecified models" (1982), by clusters of rows.
    """
    X, piece = rows.X, rows.piece
    M = X.T @ X - len(X) * psi
    scores = []
    for k in np.unique(piece):
        own = X[piece == k]
        left = rows.y[piece == k] - own @ coefficients
        scores.append(own.T @ left + len(own) * psi @ coefficients)
    every = np.array(scores)
    inverse = np.linalg.inv(M)
    count = len(every)
    return inverse @ (every.T @ every) @ inverse * count / max(count - 1, 1)


@dataclass(frozen=True)
class OutputNoise:
    """What the input noise leaves of the residual's variance.

    Attributes
    ----------
    variance : per row; may come out negative.
    sigma : its standard deviation, from the scatter between the pieces.
    """

    variance: float
    sigma: float


def output_noise(rows: Compressed, coefficients: np.ndarray, psi: np.ndarray) -> OutputNoise:
    """Return the output's noise: the variance of y - X b, less what input noise makes of it.

    Parameters
    ----------
    rows, coefficients, psi : as of `sandwich`.
    """
    squares = (rows.y - rows.X @ coefficients) ** 2
    each = np.array([np.mean(squares[rows.piece == k]) for k in np.unique(rows.piece)])
    left = each - coefficients @ psi @ coefficients
    return OutputNoise(float(np.mean(left)), float(stats.sem(left)) if len(left) > 1 else np.inf)
