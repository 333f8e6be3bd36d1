"""Columns cleared of what the model has, and what they explain of what it misses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import (
    MomentSolution,
    eigenvectors,
    orthonormal_directions,
    solve_products,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Cleared:
    """Columns of which the model's share is taken off, and the regression of what the model misses.

    Attributes
    ----------
    directions : (k, r) combinations of the columns that the model does not have.
    part : regression on them.
    moment : (r,) of theirs with what the model misses.
    back : (p, k) the model's share in the columns.
    left_total : (k, k) what is left of them, with its noise.
    """

    directions: np.ndarray
    part: MomentSolution
    moment: np.ndarray
    back: np.ndarray
    left_total: np.ndarray

    @property
    def drop(self) -> float:
        """Of the squared, whitened, noise-free residual."""
        return float(self.part.values @ self.moment)


def cleared(
    fitted: EvidenceFit, with_model: SecondMoments, with_self: SecondMoments, seen: np.ndarray
) -> Cleared | None:
    """Clear columns of the model's, and regress what the model misses on what is left.

    Parameters
    ----------
    fitted : the model without the columns.
    with_model : of the columns with the model's and the torque, (p + 1, k).
    with_self : of the columns with themselves, (k, k).
    seen : (k,) which of them count.

    Returns
    -------
    None where nothing of them is left beside the model.
    """
    p, solution, known = len(fitted.values), fitted.solution, fitted.pooled
    signal, total = with_model.signal, with_model.total
    back = solution.project(signal[:p])
    left_signal = with_self.signal - signal[:p].T @ back
    cross = back.T @ total[:p]
    left_total = with_self.total - cross - cross.T + back.T @ known.gram @ back
    scale = np.sqrt(np.clip(np.diag(with_self.signal), 0.0, None))
    # Directions of the columns, by what is left of them beside the model.
    white = orthonormal_directions(
        with_self.signal * np.outer(seen, seen), np.where(seen, scale, 1.0)
    )
    left, turn = eigenvectors(white.T @ left_signal @ white)
    visible = left > fitted.criteria.gates.not_identifiable**2
    if not np.any(visible):
        return None
    directions = white @ turn[:, visible]
    moment = directions.T @ (signal[p] - back.T @ known.signal[:p, p])
    part = solve_products(
        directions.T @ left_signal @ directions,
        directions.T @ left_total @ directions,
        moment,
        fitted.criteria.noise.reliable,
    )
    return Cleared(
        directions=directions, part=part, moment=moment, back=back, left_total=left_total
    )
