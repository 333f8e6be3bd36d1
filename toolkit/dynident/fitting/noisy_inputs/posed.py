"""The regression that a model and data pose: the factors of its rows, piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dynident.fitting.least_squares import LeastSquares
from dynident.fitting.linear_solution import LinearSolution, solve_factors
from dynident.fitting.sampling import rows, sample
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, combine, factorise, in_pieces
from dynident.recording import Dataset
from dynident.robot import BaseParameters

PIECES = 20
"""Consecutive pieces of the data, between which estimates scatter."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PosedRegression:
    """The regression that a model and data pose.

    Attributes
    ----------
    model : with the shapes where least squares settles.
    basis : what the data can tell.
    values : where the columns are taken; None where they do not depend on values.
    factors : of all data.
    first : least squares' solution.
    kept : numbers of the parameters that are identified.
    pieces : their rows in consecutive pieces, in units of each joint's residual.
    """

    model: Model
    basis: BaseParameters
    values: np.ndarray | None
    factors: TriangularFactors
    first: LinearSolution
    kept: list[int]
    pieces: TriangularFactors


def pose(model: Model, dataset: Dataset) -> PosedRegression:
    """Return the regression of a model and data; raises as least squares does."""
    relaxed = LeastSquares(errors="independent").fit(model, dataset)
    model, kept = relaxed.model, list(relaxed.basis.independent)
    values = relaxed.values if model.needs_values else None
    parts = pieces_of(model, dataset, values)
    factors = combine(parts)
    first = solve_factors(model, factors)
    return PosedRegression(
        model=model,
        basis=relaxed.basis,
        values=values,
        factors=factors,
        first=first,
        kept=kept,
        pieces=in_pieces(parts, 1.0 / first.torque_std).keeping(kept),
    )


def pieces_of(model: Model, dataset: Dataset, values: np.ndarray | None) -> list[TriangularFactors]:
    """Factors, joint by joint, of consecutive pieces of the data, equally long to a row.

    Parameters
    ----------
    model, dataset : what is fitted to what.
    values : (p,) at which columns that depend on the fit are taken; or None.

    Returns
    -------
    At most `PIECES`, in the order of time; none without rows.
    """
    total = sum(len(sample(one, dataset.filter).t) for one in dataset.recordings)
    borders = np.round(np.arange(1, PIECES + 1) * total / PIECES).astype(int)
    pieces: list[list[TriangularFactors]] = [[] for _ in borders]
    first = 0
    for columns, torque in rows(model, dataset, values):
        last = first + len(torque)
        cuts = np.unique(np.clip(np.append(borders, [first, last]), first, last))
        for start, stop in pairwise(cuts):
            part = slice(start - first, stop - first)
            piece = int(np.searchsorted(borders, start, side="right"))
            pieces[piece].append(factorise([(columns[part], torque[part])]))
        first = last
    return [combine(parts) for parts in pieces if parts]
