"""The model confidence set: which of several models may be the best, by their held-out losses.

Source: P. R. Hansen, A. Lunde and J. M. Nason, "The model confidence set", Econometrica 79 (2011),
by the largest deviation from the mean; with the stationary bootstrap of D. N. Politis and J. P.
Romano, "The stationary bootstrap", Journal of the American Statistical Association 89 (1994). To
the last draw as in the package `arch`, which takes a second to load.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from dynident.criteria import SearchCriteria
from dynident.diagnosis.search.cross_validation import signed_rank

_SEED = 20_110  # of the bootstrap


def confidence_set(losses: np.ndarray, criteria: SearchCriteria) -> tuple[int, ...]:
    """Return the columns that may be the best: the model confidence set.

    Models are taken out of the set, the worst first, as long as the differences between their
    held-out losses are more than chance. What stays contains the best model with the confidence
    asked for.

    Parameters
    ----------
    losses : (B, k)
        Held-out loss of each model in each block of time.
    criteria : chance that the best one is left out, and the bootstrap.

    Returns
    -------
    Indices of columns, ascending.
    """
    count, models = losses.shape
    varied = losses - losses.mean(axis=1, keepdims=True)
    if models < 2 or count < 3 or not np.any(varied):
        return tuple(range(models))
    errors = losses - losses.mean(axis=0)
    drawn = _weights(count, criteria.set_draws, criteria.set_block) @ errors
    kept = np.arange(models)
    while len(kept) > 1:
        chance = drawn[:, kept] - drawn[:, kept].mean(axis=1, keepdims=True)
        spread = np.maximum(np.sqrt(np.mean(chance**2, axis=0)), np.finfo(float).tiny)
        worse = losses[:, kept].mean(axis=0)
        worse = (worse - worse.mean()) / spread
        if np.mean((chance / spread).max(axis=1) > worse.max()) > criteria.set_level:
            break
        kept = kept[worse < worse.max()]
    return tuple(int(one) for one in kept)


def as_good_as_first(losses: np.ndarray, criteria: SearchCriteria) -> tuple[int, ...]:
    """Return those columns of the set which the blocks do not show to be worse than the first.

    A block that tells more than all others together makes a mean uncertain, whichever model it
    speaks for: recordings designed to tell two apart hold such blocks. By ranks such a block counts
    as one (Wilcoxon's test, corrected for the number of rivals). As ranks forget sizes, and take
    blocks for independent, no block may speak for the rival by more than blocks usually speak
    against it: an effect that shows in a few blocks alone is the worse one in all others.

    Parameters
    ----------
    losses : (B, k), the first column that of the winner.
    criteria : of both tests.
    """
    level = criteria.worse_level / max(losses.shape[1] - 1, 1)
    return tuple(
        k
        for k in confidence_set(losses, criteria)
        if k == 0
        or signed_rank(losses[:, k], losses[:, 0]) >= level
        or _speaks_for(losses[:, k] - losses[:, 0])
    )


def _speaks_for(worse: np.ndarray) -> bool:
    """Whether a block speaks for a rival by more than the median one speaks against it.

    Parameters
    ----------
    worse : (B,) what the rival loses more in each block.
    """
    return bool(-worse.min() >= np.median(worse))


@lru_cache(maxsize=4)
def _weights(count: int, draws: int, length: float) -> np.ndarray:
    """Share of each block of time in each draw (D, B), of runs that go round at the end.

    The draws are the same ever again: they are asked for with every ranking.

    Parameters
    ----------
    count : of blocks.
    draws, length : of the bootstrap, and mean of the random length of a run.
    """
    random, places = np.random.default_rng(_SEED), np.arange(count)
    found = np.empty((draws, count))
    for weights in found:
        starts = random.integers(count, size=count)
        begins = random.random(count) <= 1.0 / length
        begin = np.maximum.accumulate(np.where(begins, places, 0))
        rows = (starts[begin] + places - begin) % count
        weights[:] = np.bincount(rows, minlength=count) / count
    found.setflags(write=False)
    return found
