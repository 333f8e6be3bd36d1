"""Columns cleared of what the model has, and what they explain of what it misses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import EXACT, eigenvectors


@dataclass(frozen=True, eq=False, kw_only=True)
class Cleared:
    """V sets of k columns less the model's share, and the regression of what the model misses.

    Of k directions those that do not count are zero, wherever they stand.

    Attributes
    ----------
    identifiable : (V,) whether anything of a set is left beside the model.
    axes : (V, k, k) directions of each set that carry signal, orthonormal in what is left with its
        noise.
    reliability : (V, k) share of signal in each; one where a direction does not count.
    moment : (V, k) of these directions with what the model misses.
    back : (V, p, k) the model's share in the columns.
    left_total : (V, k, k) what is left of them, with its noise.
    """

    identifiable: np.ndarray
    axes: np.ndarray
    reliability: np.ndarray
    moment: np.ndarray
    back: np.ndarray
    left_total: np.ndarray

    @property
    def ranks(self) -> np.ndarray:
        """Number of directions of each set that carry signal, (V,)."""
        return np.count_nonzero(self.axes.any(axis=1), axis=1)

    @property
    def drops(self) -> np.ndarray:
        """Of the squared, whitened, noise-free residual, (V,)."""
        return (self.moment**2 / self.reliability).sum(axis=1)

    @property
    def values(self) -> np.ndarray:
        """Coefficients of the columns, (V, k)."""
        return (self.axes @ (self.moment / self.reliability)[:, :, None])[:, :, 0]

    @property
    def covariances(self) -> np.ndarray:
        """Covariance of the values for residuals of variance one, (V, k, k)."""
        scaled = self.axes / self.reliability[:, None, :]
        return scaled @ transposed(scaled)


def cleared(
    fitted: EvidenceFit, with_model: SecondMoments, with_self: SecondMoments, seen: np.ndarray
) -> Cleared:
    """Clear sets of columns of the model's, and regress what the model misses on what is left.

    Parameters
    ----------
    fitted : the model without the columns.
    with_model : of all columns, set by set, with the model's and the torque, (p + 1, V k); finite.
    with_self : of each set's columns with themselves, (V, k, k); finite.
    seen : (V, k) which of them count.

    Returns
    -------
    Of each set by itself.
    """
    p, solution, known = len(fitted.values), fitted.solution, fitted.pooled
    sets, k = seen.shape
    every = solution.project(with_model.signal[:p])
    back, signal, total = (
        np.ascontiguousarray(np.moveaxis(one.reshape(p, sets, k), 1, 0))
        for one in (every, with_model.signal[:p], with_model.total[:p])
    )
    back_t = transposed(back)
    left_signal = with_self.signal - transposed(signal) @ back
    cross = back_t @ total
    left_total = with_self.total - cross - transposed(cross) + back_t @ (known.gram @ back)
    left_moment = (with_model.signal[p] - every.T @ known.signal[:p, p]).reshape(sets, k)
    # Directions of the columns, by what is left of them beside the model.
    counted = with_self.signal * (seen[:, :, None] & seen[:, None, :])
    white = _orthonormal(counted)
    left, turn = eigenvectors(transposed(white) @ left_signal @ white)
    visible = left > fitted.criteria.gates.not_identifiable**2
    directions = white @ (turn * visible[:, None, :])
    # Of these, the ones that carry signal.
    axes = directions @ _orthonormal(transposed(directions) @ left_total @ directions)
    reliability, turn = eigenvectors(transposed(axes) @ left_signal @ axes)
    good = reliability > fitted.criteria.noise.reliable
    axes = axes @ (turn * good[:, None, :])
    return Cleared(
        identifiable=visible[:, -1],  # the largest stands last
        axes=axes,
        reliability=np.where(good, reliability, 1.0),
        moment=(transposed(axes) @ left_moment[:, :, None])[:, :, 0],
        back=back,
        left_total=left_total,
    )


def transposed(sets: np.ndarray) -> np.ndarray:
    """Matrices (V, a, b) as (V, b, a)."""
    return sets.swapaxes(1, 2)


def _orthonormal(products: np.ndarray) -> np.ndarray:
    """Directions in which columns are independent, orthonormal in their products, (V, k, k).

    Columns are divided by their norms, so that units do not decide. Zero in the place of the
    directions that depend on others.
    """
    scale = np.sqrt(np.clip(np.diagonal(products, axis1=1, axis2=2), 0.0, None))
    scale = np.where(scale > 0, scale, 1.0)
    size, axes = eigenvectors(products / (scale[:, :, None] * scale[:, None, :]))
    kept = size > EXACT * np.maximum(size[:, -1:], 1e-300)
    return axes * (kept / np.sqrt(np.where(kept, size, 1.0)))[:, None, :] / scale[:, :, None]
