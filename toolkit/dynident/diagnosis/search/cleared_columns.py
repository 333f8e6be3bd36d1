"""Columns cleared of what the model has, and what they explain of what it misses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import (
    EXACT,
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


def drops_at_most(
    fitted: EvidenceFit, with_model: SecondMoments, with_self: SecondMoments
) -> np.ndarray:
    """Return what each of many sets of columns would drop, all at once.

    As `cleared`, but for directions that the model has nearly, where it may be more, and for those
    that are unreliable, where it may be a little less.

    Parameters
    ----------
    fitted : the model without the columns.
    with_model : of all columns, set by set, with the model's and the torque, (p + 1, V k).
    with_self : of each set's columns with themselves, (V, k, k).

    Returns
    -------
    (V,) of the squared, whitened, noise-free residual; infinite where numbers are not finite.
    """
    p, known = len(fitted.values), fitted.pooled
    sets, k = with_self.total.shape[:2]
    both = with_model.total, with_model.signal
    if not all(np.all(np.isfinite(one)) for one in (*both, with_self.total, with_self.signal)):
        return np.full(sets, np.inf)
    every = fitted.solution.project(with_model.signal[:p])
    back, signal, total = (
        np.moveaxis(one.reshape(p, sets, k), 1, 0)
        for one in (every, with_model.signal[:p], with_model.total[:p])
    )
    back_t = np.swapaxes(back, 1, 2)
    left_signal = with_self.signal - np.swapaxes(signal, 1, 2) @ back
    cross = back_t @ total
    left_total = with_self.total - cross - np.swapaxes(cross, 1, 2) + back_t @ (known.gram @ back)
    moment = (with_model.signal[p] - every.T @ known.signal[:p, p]).reshape(sets, k)
    scale = np.sqrt(np.clip(np.diagonal(left_total, axis1=1, axis2=2), 0.0, None))
    scale = np.where(scale > 0, scale, 1.0)
    size, axes = np.linalg.eigh(left_total / (scale[:, :, None] * scale[:, None, :]))
    kept = size > EXACT * np.maximum(size[:, -1:], 1e-300)
    white = axes * (kept / np.sqrt(np.where(kept, size, 1.0)))[:, None, :] / scale[:, :, None]
    white_t = np.swapaxes(white, 1, 2)
    reliability, turn = np.linalg.eigh(white_t @ left_signal @ white)
    along = np.einsum("vij,vjk,vk->vi", np.swapaxes(turn, 1, 2), white_t, moment)
    good = reliability > fitted.criteria.noise.reliable
    return np.sum(np.where(good, along**2 / np.where(good, reliability, 1.0), 0.0), axis=1)
