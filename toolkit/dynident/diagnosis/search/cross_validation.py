"""Every block of time left out in turn, and predicted with an effect and without it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import bdtrc, ndtr

from dynident.criteria import GateCriteria
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import regression_values

_SAME = 1e-9
_FEW = 50  # blocks, of which every sum of ranks is counted


def cross_validate(
    fitted: EvidenceFit, with_model: SecondMoments, with_self: SecondMoments
) -> tuple[np.ndarray, np.ndarray]:
    """Leave out every block in turn, and predict it by the model with and without an effect.

    Parameters
    ----------
    fitted : the model without the effect.
    with_model : of the effect's columns with the model's and the torque, (B, p + 1, k).
    with_self : of the effect's columns with themselves, (B, k, k).

    Returns
    -------
    Held-out squared residuals per block, whitened: (B,) without and (B,) with the effect.
    """
    both = SecondMoments(
        _joined(fitted.moments.total, with_model.total, with_self.total),
        fitted.moments.counts,
        None,
        _joined(fitted.moments.signal, with_model.signal, with_self.signal),
    )
    reliable = fitted.criteria.noise.reliable
    wider = [regression_values(others, reliable) for others in both.without_each()]
    return _losses(fitted.moments, fitted.without_each_block), _losses(both, wider)


def left_out_losses(fitted: EvidenceFit) -> np.ndarray:
    """Return the squared residual of each block by the fit to all others, whitened, (B,)."""
    return _losses(fitted.moments, fitted.without_each_block)


def helps_on_blocks(gains: np.ndarray, gates: GateCriteria) -> bool:
    """Whether held-out residuals fall by more than chance makes them.

    The sum is judged by its standard error, or the blocks by their signs; or, as where few blocks
    hold nearly all of the sum, its standard error says nothing and the signs of the others are
    chance, those that matter by a sign test of at most the level of the standard errors asked for.

    Parameters
    ----------
    gains : (B,) of the blocks' squared residuals, whitened.
    gates : standard errors, share of the blocks, and which of them matter.
    """
    if not gains.sum() > 0:
        return False
    confident = gains.sum() > gates.standard_errors * gains.std(ddof=1) * np.sqrt(len(gains))
    if confident or np.mean(gains > 0) >= gates.blocks_gaining:
        return True
    matter = gains[np.abs(gains) >= gates.block_matters * np.abs(gains).sum()]
    by_chance = bdtrc(np.sum(matter > 0) - 1, len(matter), 0.5)
    return bool(by_chance <= ndtr(-gates.standard_errors))


def signed_rank(losses: np.ndarray, least: np.ndarray) -> float:
    """Return the p value of Wilcoxon's one-sided test that held-out losses are no larger.

    Parameters
    ----------
    losses, least : (B,) of the same blocks, in the same metric, by two models.
    """
    worse = losses - least
    size = np.abs(worse)
    if size.max() <= _SAME * np.abs(least).max():
        return 1.0
    if len(size) > _FEW or not np.all(np.diff(np.sort(np.append(size, 0.0))) > 0):
        from scipy.stats import wilcoxon  # takes long to load

        told: Any = wilcoxon(worse, alternative="greater")
        return float(told.pvalue)
    ranks = np.flatnonzero(worse[np.argsort(size)] > 0) + 1
    return float(_chances(len(size))[ranks.sum() :].sum())


@lru_cache
def _chances(blocks: int) -> np.ndarray:
    """How often ranks, each of which counts or not by chance, sum to 0, 1, 2 ..."""
    found = np.ones(1)
    for rank in range(1, blocks + 1):
        found = (np.pad(found, (0, rank)) + np.pad(found, (rank, 0))) / 2.0
    return found


def _losses(summed: SecondMoments, values: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Squared residual of each block with its values, free of noise in the mean."""
    combinations = [np.append(-one, 1.0) for one in values]
    return np.array([c @ m @ c for c, m in zip(combinations, summed.signal, strict=True)])


def _joined(model: np.ndarray, cross: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Moments of [model columns, effect columns, torque], from their parts."""
    p = model.shape[1] - 1
    top = np.concatenate([model[:, :p, :p], cross[:, :p], model[:, :p, p:]], axis=2)
    turned = cross.transpose(0, 2, 1)
    middle = np.concatenate([turned[:, :, :p], own, turned[:, :, p:]], axis=2)
    bottom = np.concatenate([model[:, p:, :p], cross[:, p:], model[:, p:, p:]], axis=2)
    return np.concatenate([top, middle, bottom], axis=1)
