"""Blocks that were left out: whether an effect helps on them, and SciPy's test of ranks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import wilcoxon

from dynident.criteria import GateCriteria
from dynident.diagnosis.search.cross_validation import helps_on_blocks, signed_rank


@pytest.mark.parametrize("blocks", [3, 13, 20, 50, 51])
@pytest.mark.parametrize("worse", [-3.0, -0.3, 0.0, 0.3, 3.0])
def test_the_p_value_of_ranks_is_that_of_scipy(blocks: int, worse: float) -> None:
    least = np.random.default_rng(blocks).uniform(1.0, 2.0, blocks)
    losses = least + worse + np.random.default_rng(0).standard_normal(blocks)
    expected: Any = wilcoxon(losses - least, alternative="greater")
    assert signed_rank(losses, least) == pytest.approx(expected.pvalue, rel=1e-9)


@pytest.mark.slow
def test_blocks_that_are_alike_share_their_ranks() -> None:
    least = np.full(12, 4.0)
    losses = least + np.array([1.0, 1.0, -1.0, 2.0, 0.0, 0.0, 3.0, -2.0, 1.0, 5.0, 4.0, 1.0])
    expected: Any = wilcoxon(losses - least, alternative="greater")
    assert signed_rank(losses, least) == pytest.approx(expected.pvalue, rel=1e-9)
    assert signed_rank(least, least) == 1.0


def gains(bursts: list[float]) -> np.ndarray:
    """Of twenty blocks: bursts in some, and in the others what chance makes, half of it a loss."""
    quiet = np.tile([0.5, -0.5], 10)
    return np.concatenate([bursts, quiet[len(bursts) :]])


@pytest.mark.parametrize(
    ("bursts", "helps"),
    [
        ([3800.0, 570.0, 490.0, 210.0], True),  # whose sum is 1.4 standard errors
        ([3800.0, 570.0, 490.0, -210.0], False),
        ([3800.0, 570.0, 210.0], False),  # three of three are one in eight by chance
        ([3800.0], False),
    ],
)
def test_gains_of_a_few_blocks_are_judged_by_these(bursts: list[float], helps: bool) -> None:
    assert helps_on_blocks(gains(bursts), GateCriteria()) is helps


@pytest.mark.parametrize("blocks", [20, 50])
def test_of_blocks_alike_chance_passes_no_more_often_for_the_sign_test(blocks: int) -> None:
    """With every block mattering the sign test is of all of them: 0.02 more pass at most."""
    drawn = np.random.default_rng(0).standard_t(3, (4000, blocks))
    without = replace(GateCriteria(), block_matters=1.0)  # no block does
    ours, others = (
        np.mean([helps_on_blocks(each, one) for each in drawn]) for one in (GateCriteria(), without)
    )
    assert others <= ours < others + 0.02
