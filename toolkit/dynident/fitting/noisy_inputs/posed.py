"""The regression that a model and data pose: their rows, compressed piece by piece."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dynident.fitting.least_squares import LeastSquares, LinearSolution, solve_factors
from dynident.fitting.noisy_inputs.compressed import Compressed, compress
from dynident.fitting.sampling import rows, sample
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, factorise
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
    compressed : their rows, in units of each joint's residual.
    """

    model: Model
    basis: BaseParameters
    values: np.ndarray | None
    factors: TriangularFactors
    first: LinearSolution
    kept: list[int]
    compressed: Compressed


def pose(model: Model, dataset: Dataset) -> PosedRegression:
    """Return the regression of a model and data; raises as least squares does."""
    relaxed = LeastSquares().fit(model, dataset)
    model, kept = relaxed.model, list(relaxed.basis.independent)
    values = relaxed.values if model.needs_values else None
    pieces = pieces_of(model, dataset, values)
    factors = _whole(pieces)
    first = solve_factors(model, factors)
    compressed = compress(pieces, 1.0 / first.torque_std)
    compressed = replace(compressed, X=compressed.X[:, kept])
    return PosedRegression(
        model=model,
        basis=relaxed.basis,
        values=values,
        factors=factors,
        first=first,
        kept=kept,
        compressed=compressed,
    )


def pieces_of(model: Model, dataset: Dataset, values: np.ndarray | None) -> list[TriangularFactors]:
    """TriangularFactors of consecutive pieces of the data, equally long to a row."""
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
    return [_whole(parts) for parts in pieces if parts]


def _whole(parts: list[TriangularFactors]) -> TriangularFactors:
    """TriangularFactors of all the parts together."""
    R = np.stack(
        [
            np.linalg.qr(np.vstack([part.R[j] for part in parts]), mode="r")
            for j in range(len(parts[0].counts))
        ]
    )
    return TriangularFactors(R, np.sum([part.counts for part in parts], axis=0))
