"""Every block of time left out in turn, and predicted with an effect and without it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import regression_values

_SAME = 1e-9


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


def signed_rank(losses: np.ndarray, least: np.ndarray) -> float:
    """Return the p value of Wilcoxon's one-sided test that held-out losses are no larger.

    Parameters
    ----------
    losses, least : (B,) of the same blocks, in the same metric, by two models.
    """
    from scipy.stats import wilcoxon

    worse = losses - least
    if np.abs(worse).max() <= _SAME * np.abs(least).max():
        return 1.0
    told: Any = wilcoxon(worse, alternative="greater")
    return float(told.pvalue)


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
