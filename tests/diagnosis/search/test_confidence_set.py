"""The model confidence set keeps what may be the best and drops what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arch.bootstrap import MCS

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search import confidence_set as module
from dynident.diagnosis.search.confidence_set import as_good_as_first, confidence_set

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


@pytest.mark.slow
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


FEW = replace(DEFAULTS.search, set_draws=200)


def of_uneven_blocks(seed: int, worse: float) -> np.ndarray:
    """Losses of two models on blocks of which one tells far more than all others."""
    rng = np.random.default_rng(seed)
    told = rng.uniform(5.0, 15.0, BLOCKS)  # squared distance of the two in each block
    told[rng.integers(BLOCKS)] = 1000.0
    noise = 2.0 * np.sqrt(told) * rng.normal(size=BLOCKS)
    common = rng.normal(100.0, 30.0, BLOCKS)
    return np.column_stack([common, common + worse * told + noise])


def test_a_block_that_tells_more_than_all_others_leaves_no_doubt_of_them() -> None:
    found = [of_uneven_blocks(seed, 1.0) for seed in range(20)]
    assert np.mean([confidence_set(one, FEW) == (0, 1) for one in found]) > 0.4
    assert np.mean([as_good_as_first(one, FEW) == (0,) for one in found]) > 0.8


def test_one_block_alone_decides_nothing() -> None:
    one = losses((0.0, 0.0), 3)
    one[7, 1] += 1e4
    assert as_good_as_first(one, FEW) == (0, 1)


@pytest.mark.slow
def test_what_is_as_good_stays_however_unevenly_blocks_tell() -> None:
    """Two that are equally good; and the better one that is not first."""
    even = [of_uneven_blocks(seed, 0.0) for seed in range(60)]
    alone = [
        [kept(one, FEW) == (0,) for one in even] for kept in (confidence_set, as_good_as_first)
    ]
    assert np.mean(alone[1]) <= np.mean(alone[0]) + 0.02
    turned = [of_uneven_blocks(seed, 0.5)[:, ::-1] for seed in range(20)]
    assert all(1 in as_good_as_first(one, FEW) for one in turned)


def _of_differences(worse: np.ndarray) -> np.ndarray:
    """Losses (B, 2) of which the second is worse by so much."""
    return np.column_stack([np.full(len(worse), 10.0), 10.0 + worse])


def test_an_effect_that_shows_in_a_few_blocks_is_not_lost_for_being_worse_in_all_others() -> None:
    """By the mean of all recordings it is the better one, of which these blocks show too little."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 30:
        worse = 0.2 + 0.05 * rng.normal(size=40)
        seen = rng.random(40) < 0.08
        worse -= seen * rng.exponential(4.0, size=40)
        if worse.mean() > 0 and worse.min() < -0.5:
            found.append(_of_differences(worse))
    both = [[1 in kept(one, FEW) for one in found] for kept in (confidence_set, as_good_as_first)]
    assert both[0] == both[1] and any(both[0])


def test_blocks_that_go_together_drop_no_equal_that_the_means_keep() -> None:
    rng, lost = np.random.default_rng(1), []
    for _ in range(60):
        worse = np.zeros(70)
        for i in range(1, 70):
            worse[i] = 0.6 * worse[i - 1] + rng.normal()
        one = _of_differences(worse[-20:] * np.sign(worse[-20:].mean()))
        lost.append(1 in confidence_set(one, FEW) and 1 not in as_good_as_first(one, FEW))
    assert np.mean(lost) <= 0.05
