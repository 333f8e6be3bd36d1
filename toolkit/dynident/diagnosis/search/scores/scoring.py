"""What an effect would bring: tests and penalties on the moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import special

from dynident.diagnosis.search.scores.candidate_moments import CandidateMoments
from dynident.diagnosis.search.scores.cleared_columns import Cleared, cleared, transposed
from dynident.diagnosis.search.scores.score import Score
from dynident.effects import Effect
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import eigenvectors


def score(
    fitted: EvidenceFit,
    effect: Effect,
    with_model: SecondMoments,
    with_self: SecondMoments,
    grid: int,
    payload_recordings: tuple[bool, ...] | None = None,
) -> Score:
    """Score an effect from its moments.

    Parameters
    ----------
    fitted : the model without the effect.
    effect : at one shape.
    with_model : of the effect's columns with the model's and the torque, (B, p + 1, k).
    with_self : of the effect's columns with themselves, (B, k, k).
    grid : number of shapes that were tried.
    payload_recordings : for each run, whether it carries the payload; None for another effect.

    Returns
    -------
    Not yet cross-validated; marked where the model already explains all that it could.
    """
    moments = CandidateMoments(with_model, with_self.as_set())
    (found,) = scores(fitted, [effect], moments, grid)
    return replace(found, payload_recordings=payload_recordings)


def scores(
    fitted: EvidenceFit,
    variants: Sequence[Effect],
    moments: CandidateMoments,
    grid: int | np.ndarray,
) -> list[Score]:
    """Score variants of an effect from their moments, all at once.

    Parameters
    ----------
    fitted : the model without the effect.
    variants : the effect at V shapes.
    moments : of their columns.
    grid : number of shapes that were tried, of all or (V,) of each.

    Returns
    -------
    As `score`, of each.
    """
    fitted = fitted.beside(variants[0])
    moments, beside, own, seen = _seen(variants, fitted, moments)
    if not seen.any():
        return [_unidentified(one) for one in variants]
    found = cleared(fitted, beside, own, seen)
    p, k = len(fitted.values), seen.shape[1]
    back, values, drops, ranks = found.back, found.values, found.drops, found.ranks
    combination = np.append(-fitted.values, 1.0)
    with_model_columns = (combination @ fitted.pooled.total)[:p]
    with_noise = (combination @ beside.total).reshape(-1, k) - with_model_columns @ back
    points = [one.point if len(one.point) == k else None for one in variants]
    at = np.array([v if x is None else x for x, v in zip(points, values, strict=True)])
    falls = 2.0 * _dot(at, with_noise) - _dot(at, (found.left_total @ at[:, :, None])[:, :, 0])
    penalised = drops - price(fitted, variants[0], ranks, grid)
    covariances = found.covariances
    sigma = np.sqrt(np.clip(np.diagonal(covariances, axis1=1, axis2=2), 0.0, None))
    p_values = _block_p_values(found.moment, ranks, _block_scores(fitted, moments, found))
    return [
        Score(
            effect=one,
            payload_recordings=None,
            not_identifiable=False,
            rank=int(ranks[v]),
            drop=float(drops[v]),
            share=float(drops[v] / fitted.error_total),
            p_value=float(p_values[v]),
            penalised=float(penalised[v]),
            values=tuple(values[v].tolist()),
            sigma=tuple(sigma[v].tolist()),
            covariance=covariances[v],
            fall=float(falls[v]),
        )
        if ranks[v]
        else _unidentified(one, not found.identifiable[v])
        for v, one in enumerate(variants)
    ]


def _unidentified(effect: Effect, nowhere: bool = True) -> Score:
    """The score of an effect of which nothing can be told: by the model, or for the noise."""
    return Score(effect=effect, payload_recordings=None, not_identifiable=nowhere)


def price(
    fitted: EvidenceFit, effect: Effect, rank: int | np.ndarray, grid: int | np.ndarray
) -> float | np.ndarray:
    """Return what an effect has to explain at least to count for something.

    Parameters
    ----------
    fitted : the model without it.
    effect : with its shapes.
    rank : number of its parameters that the data can tell, of one or of each of many.
    grid : number of shapes that were tried, of one or of each of many.

    Returns
    -------
    Squared, whitened residual.
    """
    return (rank + len(effect.shape)) * np.log(fitted.rows) + 2.0 * np.log(grid)


def _seen(
    variants: Sequence[Effect], fitted: EvidenceFit, moments: CandidateMoments
) -> tuple[CandidateMoments, SecondMoments, SecondMoments, np.ndarray]:
    """Return moments, their sums over all blocks, and which columns count, (V, k).

    Those that could be told from rounding errors at any possible value; none of a variant whose
    moments are not finite, in the place of which there are zeros.
    """
    beside, own = moments.beside.pooled(), moments.own.pooled()
    sets, k = own.total.shape[:2]
    finite = np.ones(sets, dtype=bool)
    for one in (beside.total, beside.signal):
        finite &= np.isfinite(one).reshape(len(one), sets, k).all(axis=(0, 2))
    for one in (own.total, own.signal):
        finite &= np.isfinite(one).all(axis=(1, 2))
    if not finite.all():
        columns, squares = np.repeat(finite, k), finite[:, None, None]
        moments = CandidateMoments(moments.beside.where(columns), moments.own.where(squares))
        beside, own = moments.beside.pooled(), moments.own.pooled()
    scale = np.sqrt(np.clip(np.diagonal(own.signal, axis1=1, axis2=2), 0.0, None))
    bounds = [
        [max(abs(p.lower), abs(p.upper)) for p in one.parameters(fitted.model.robot)]
        for one in variants
    ]
    least = fitted.criteria.gates.unseen * np.sqrt(fitted.rows) / np.array(bounds)
    return moments, beside, own, scale > least


def _block_scores(fitted: EvidenceFit, moments: CandidateMoments, found: Cleared) -> np.ndarray:
    """Each block's moments of cleared directions and the residual with a variant in, (V, B, k)."""
    beside, own = moments.beside.signal, np.moveaxis(moments.own.signal, 0, 1)
    blocks, rows, _ = beside.shape
    p, (sets, k) = len(fitted.values), found.moment.shape
    beside = beside.reshape(blocks, rows, sets, k).transpose(2, 0, 1, 3)
    values, back = found.values, found.back
    combination = np.ones((sets, p + 1))
    combination[:, :p] = -fitted.values + (back @ values[:, :, None])[:, :, 0]
    plain = (combination[:, None, None, :] @ beside)[:, :, 0]
    plain -= (own @ values[:, None, :, None])[..., 0]
    model = (combination @ fitted.moments.signal)[:, :, :p].swapaxes(0, 1)
    model = model - (beside[:, :, :p] @ values[:, None, :, None])[..., 0]
    return (plain - model @ back) @ found.axes


def _block_p_values(moment: np.ndarray, ranks: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Wald tests that effects have no part, with blocks of time as the sampling units, (V,).

    Parameters
    ----------
    moment : (V, k) of residual without an effect and its cleared directions, over all blocks.
    ranks : (V,) how many of the directions count; the others are zero.
    scores : (V, B, k) the same of each block with the effect in; they sum to zero.
    """
    blocks = scores.shape[1]
    size, axes = eigenvectors(transposed(scores) @ scores * blocks / max(blocks - 1, 1))
    seen = size > 1e-12 * size[:, -1:]
    along = (moment[:, None, :] @ axes)[:, 0]
    statistic = np.where(seen, along**2 / np.where(seen, size, 1.0), 0.0).sum(axis=1)
    told = (ranks > 0) & (blocks > ranks + 1)
    k, free = np.where(told, ranks, 1), np.where(told, blocks - ranks, 1)
    ratio = np.maximum(statistic, 0.0) * free / (k * max(blocks - 1, 1))
    return np.where(told, special.fdtrc(k, free, ratio), 1.0)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of rows, (V,)."""
    return np.einsum("vk,vk->v", a, b)
