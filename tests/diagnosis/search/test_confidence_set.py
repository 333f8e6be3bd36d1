"""The model confidence set keeps what may be the best and drops what is not."""

from __future__ import annotations

import numpy as np
import pytest
from arch.bootstrap import MCS

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search import confidence_set as module
from dynident.diagnosis.search.confidence_set import confidence_set

BLOCKS = 20


def losses(excess: tuple[float, ...], seed: int) -> np.ndarray:
    """Losses that vary together from block to block, as those of models do."""
    rng = np.random.default_rng(seed)
    common = rng.normal(100.0, 30.0, (BLOCKS, 1))
    return common + rng.normal(0.0, 5.0, (BLOCKS, len(excess))) + np.array(excess)


def test_what_is_clearly_worse_is_dropped_and_equals_stay_together() -> None:
    kept = [confidence_set(losses((0.0, 0.0, 40.0), seed), DEFAULTS.search) for seed in range(20)]
    assert not any(2 in one for one in kept)
    assert np.mean([one == (0, 1) for one in kept]) >= 0.8


def test_the_best_is_kept_at_the_level_asked_for() -> None:
    kept = [
        0 in confidence_set(losses((0.0, 2.0, 4.0), seed), DEFAULTS.search) for seed in range(40)
    ]
    assert np.mean(kept) >= 0.9


def test_one_model_or_identical_ones_are_all_kept() -> None:
    one = losses((0.0,), 0)
    assert confidence_set(one, DEFAULTS.search) == (0,)
    assert confidence_set(np.hstack([one, one]), DEFAULTS.search) == (0, 1)


@pytest.mark.parametrize("models", [2, 3, 6])
def test_it_is_that_of_arch_to_the_last_draw(models: int) -> None:
    """Sets of all sizes: differences are from nothing to much of what varies."""
    criteria, sizes = DEFAULTS.search, set()
    for seed in range(6):
        excess = np.random.default_rng(seed).uniform(0.0, 12.0, models)
        some = losses(tuple(excess), seed)
        theirs = MCS(
            some,
            size=criteria.set_level,
            reps=criteria.set_draws,
            block_size=criteria.set_block,
            method="max",
            seed=module._SEED,
        )
        theirs.compute()
        found = confidence_set(some, criteria)
        assert found == tuple(sorted(int(str(i)) for i in theirs.included))
        sizes.add(len(found))
    assert len(sizes) > 1
