"""Which effects the data cannot tell from the best one: a model confidence set.

Hansen, Lunde and Nason (2011): models are taken out of a set, the worst first, as long as the
differences between their held-out losses are more than chance. What stays contains the best model
with the confidence asked for.
"""

from __future__ import annotations

import numpy as np

from dynident.criteria import SearchCriteria

_SEED = 20_110


def confidence_set(losses: np.ndarray, criteria: SearchCriteria) -> tuple[int, ...]:
    """Return the columns that may be the best.

    Parameters
    ----------
    losses : (B, k)
        Held-out loss of each model in each block of time.
    criteria : chance that the best one is left out, and the bootstrap.

    Returns
    -------
    Indices of columns, ascending.
    """
    if losses.shape[1] < 2 or losses.shape[0] < 3:
        return tuple(range(losses.shape[1]))
    # Loaded where two effects compete: it takes a second.
    from arch.bootstrap import MCS

    varied = losses - losses.mean(axis=1, keepdims=True)
    if not np.any(varied):
        return tuple(range(losses.shape[1]))
    found = MCS(
        losses,
        size=criteria.set_level,
        reps=criteria.set_draws,
        block_size=criteria.set_block,
        method="max",
        seed=_SEED,
    )
    found.compute()
    return tuple(sorted(int(str(i)) for i in found.included))
