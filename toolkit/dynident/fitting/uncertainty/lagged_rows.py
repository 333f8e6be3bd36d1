"""Products of rows with later ones, gathered while a fit passes over them.

The errors of a fit need them; a pass of their own over a long recording would cost as much as the
fit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.clusters import over_recordings
from dynident.fitting.linear_solution import LinearSolution
from dynident.fitting.sampling import Sampled, sample
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, combine, factorise
from dynident.moments.lagged import LaggedColumns
from dynident.recording import Dataset, Filter, Recording

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


def factors_with_columns(
    model: Model, dataset: Dataset, columns: LaggedColumns
) -> TriangularFactors:
    """Factorise all rows, and gather the lagged products of their columns on the way.

    Parameters
    ----------
    model, dataset : what is fitted.
    columns : that gathers them.

    Returns
    -------
    Factors of the rows of all recordings.
    """
    parts = []
    passes = over_recordings(dataset.recordings, _factors_of, model, dataset.filter, columns.like())
    for factors, gathered in passes:
        parts.append(factors)
        columns.join(gathered)
    return combine(parts)


def gather_columns(
    model: Model, dataset: Dataset, values: np.ndarray | None, columns: LaggedColumns
) -> None:
    """Gather the lagged products of the columns of all rows, in a pass of their own.

    Parameters
    ----------
    model, dataset : what is fitted.
    values : (p,) parameters at which columns that depend on the fitted model are taken.
    columns : that gathers them.
    """
    arguments = (model, dataset.filter, values, columns.like())
    for gathered in over_recordings(dataset.recordings, _columns_of, *arguments):
        columns.join(gathered)


def _factors_of(
    recording: Recording, model: Model, settings: Filter | None, columns: LaggedColumns
) -> tuple[TriangularFactors, LaggedColumns]:
    """Factors of a recording's rows, and the products of their columns."""
    columns = columns.like()
    return factorise(_watched(model, sample(recording, settings), None, columns)), columns


def _columns_of(
    recording: Recording,
    model: Model,
    settings: Filter | None,
    values: np.ndarray | None,
    columns: LaggedColumns,
) -> LaggedColumns:
    """Products of the columns of a recording's rows."""
    columns = columns.like()
    for _ in _watched(model, sample(recording, settings), values, columns):
        pass
    return columns


def _watched(
    model: Model, sampled: Sampled, values: np.ndarray | None, columns: LaggedColumns
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the rows of a recording, whose lagged products are gathered on the way."""
    first = 0
    for block, torque in sampled.rows(model, values):
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
    every : (K + 1,) behind all rows.
    solution : least squares over all rows.

    Returns
    -------
    (n, K + 1, r, r)
    """
    columns = some * (every / np.maximum(pairs, 1.0))[:, None, None]
    turn, weights = solution.inverse, solution.weights**2
    values, vectors = np.linalg.eigh(turn.T @ np.tensordot(weights, columns[:, 0], axes=1) @ turn)
    if values[0] < _SHOWN:
        return None
    even = turn @ (vectors / np.sqrt(values)) @ vectors.T @ np.linalg.inv(turn)
    return even.T @ columns @ even
