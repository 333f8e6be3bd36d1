"""Errors of a fit whose rows no `Model` makes: noise with its colour, or scatter between blocks.

What the model lacks moves as slowly as the motion: in its band there is more left than noise of
even density leaves. Noise that is as slow looks the same. Where stretches of a motion differ by
more than either explains, that scatter is the error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from dynident.fitting.linear_solution import LinearSolution
from dynident.fitting.sampling import Sampled
from dynident.fitting.uncertainty.cluster_sandwich import (
    BlockScores,
    scatter_factors,
    time_blocks,
)
from dynident.fitting.uncertainty.lagged_rows import LAGS
from dynident.fitting.uncertainty.noise_shapes import EVEN, HALVING, noise_shapes
from dynident.fitting.uncertainty.row_errors import RowErrors, errors_of
from dynident.moments.lagged import RowBlock, lagged_products
from dynident.robot import base_parameters

_SLOW = 4.0
"""Times the variance that errors of even density would give, above which what is left is slow."""
_CHANCE = 1e-4  # that it is so large by chance

RowsOf = Callable[[Sampled], Iterator[tuple[np.ndarray, np.ndarray]]]
"""Of a recording: derivatives (T, m, r) of its rows by r unknowns, and what is left (T, m)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedRows:
    """What was solved, in the form that its errors need.

    Attributes
    ----------
    weights : (m,) of the groups of rows: joints, or components of a wrench.
    inverse : (r, r) of the triangular factor of the weighted derivatives.
    squares : (m,) sum of squares of what was measured, below which residuals are rounding.
    """

    weights: np.ndarray
    inverse: np.ndarray
    squares: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class ScatteredErrors:
    """Errors of r unknowns.

    Attributes
    ----------
    covariance : (r, r).
    errors : of the rows.
    lacking : whether something is left that moves as slowly as the motion, or makes blocks of time
        differ by more than noise of its colour does.
    """

    covariance: np.ndarray
    errors: RowErrors
    lacking: bool


def scattered_errors(
    samples: Sequence[Sampled], rows_of: RowsOf, solved: SolvedRows
) -> ScatteredErrors:
    """Measure the errors of the rows in one more pass, and carry them to the unknowns.

    Parameters
    ----------
    samples : the recordings.
    rows_of : their rows at the solution; zero where one was left out.
    solved : what came out.

    Returns
    -------
    The covariance, wider than noise makes it where blocks of time scatter by far more.
    """
    rank, weights = len(solved.inverse), solved.weights
    lags = min(LAGS, *(one.count // 10 for one in samples))
    scores = BlockScores(rank)

    def blocks() -> Iterator[RowBlock]:
        for sampled in samples:
            begins, start, first = True, 0, scores.count
            places = time_blocks(sampled, len(samples))
            for found, left in rows_of(sampled):
                own = np.einsum("tjr,tj->tr", found, left * weights**2)
                scores.add(places[start : start + len(left)], own, first)
                start += len(left)
                # Rows that were left out are zero.
                yield begins, found, left, np.any(found != 0.0, axis=2)
                begins = False

    bread = solved.inverse @ solved.inverse.T
    linear = LinearSolution(
        values=np.zeros(rank),
        covariance=bread,
        basis=base_parameters(np.eye(rank), tuple(map(str, range(rank)))),
        torque_std=1.0 / weights,
        condition_number=float(np.linalg.cond(solved.inverse)),
        weights=weights,
        inverse=solved.inverse,
    )
    products = lagged_products(blocks(), lags)
    errors, even = (
        errors_of(products, noise_shapes(samples[0], lags, edges), linear, solved.squares)
        for edges in (HALVING, EVEN)
    )
    wider = scatter_factors(errors.covariance, bread, scores)
    # What is known with little freedom is large by chance.
    beyond = max(_SLOW, float(chdtri(errors.freedom, _CHANCE)) / errors.freedom)
    slow = np.diag(errors.measured) > beyond * np.diag(even.measured)
    return ScatteredErrors(
        covariance=errors.covariance * np.outer(wider, wider),
        errors=errors,
        lacking=bool(np.any(wider > 1.0) or np.any(slow)),
    )
