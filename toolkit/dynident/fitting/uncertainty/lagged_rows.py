"""Products of rows with later ones, gathered while a fit passes over them.

The errors of a fit need them; a pass of their own over a long recording would cost as much as the
fit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.fitting.linear_solution import LinearSolution
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.moments.lagged import LaggedColumns
from dynident.recording import Dataset

LAGS = 12
"""Rows up to which errors count as correlated: the low-pass of the default filter forgets to 2 %
in 8, and 8 to 20 give the same coverage (measured)."""
_MOST = 16384
"""Rows above which the columns of some are multiplied with later ones, not of all."""
_SAMPLES_A_ROW = 32  # at the full rate, for which one more row is multiplied
_SHOWN = 0.2
"""Share of what all rows say in a direction that some must say in proportion, or all are taken."""


def lagged_columns(dataset: Dataset) -> LaggedColumns:
    """Return what gathers the lagged products of a dataset's columns.

    Of more than 16384 rows it takes some; how many more grows with the samples behind them.

    Parameters
    ----------
    dataset : the recordings, with their filter.
    """
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    rows = sum(one.count for one in samples)
    most = max(_MOST, sum(one.source.samples for one in samples) // _SAMPLES_A_ROW)
    lags = min(LAGS, *(one.count // 10 for one in samples))
    return LaggedColumns(lags, min(1.0, most / rows))


def watched(
    model: Model, dataset: Dataset, values: np.ndarray | None, columns: LaggedColumns
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield rows, as `sampling.rows` does, whose lagged products are gathered on the way.

    Parameters
    ----------
    model, dataset, values : as of `sampling.rows`.
    columns : that gathers them.
    """
    for recording in dataset.recordings:
        first = 0
        for block, torque in sample(recording, dataset.filter).rows(model, values):
            columns.add(first, block)
            first += len(torque)
            yield block, torque
            del block  # whose memory is used for the next one


def of_all_rows(
    some: np.ndarray, pairs: np.ndarray, every: np.ndarray, solution: LinearSolution
) -> np.ndarray | None:
    """Lagged products of columns in some rows, as if in all; None where they do not show enough.

    Columns that are orthonormal over all rows are nearly so over some: here they become so.

    Parameters
    ----------
    some : (n, K + 1, r, r) of some rows.
    pairs : (K + 1,) behind them.
    every : (n, K + 1) pairs of all rows.
    solution : least squares over all rows.

    Returns
    -------
    (n, K + 1, r, r)
    """
    columns = some * (every / np.maximum(pairs, 1.0))[:, :, None, None]
    turn, weights = solution.inverse, solution.weights**2
    values, vectors = np.linalg.eigh(turn.T @ np.tensordot(weights, columns[:, 0], axes=1) @ turn)
    if values[0] < _SHOWN:
        return None
    even = turn @ (vectors / np.sqrt(values)) @ vectors.T @ np.linalg.inv(turn)
    return even.T @ columns @ even
