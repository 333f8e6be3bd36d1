"""Wilcoxon's signed-rank test as SciPy has it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import wilcoxon

from dynident.diagnosis.search.cross_validation import signed_rank


@pytest.mark.parametrize("blocks", [3, 13, 20, 50, 51])
@pytest.mark.parametrize("worse", [-3.0, -0.3, 0.0, 0.3, 3.0])
def test_the_p_value_of_ranks_is_that_of_scipy(blocks: int, worse: float) -> None:
    least = np.random.default_rng(blocks).uniform(1.0, 2.0, blocks)
    losses = least + worse + np.random.default_rng(0).standard_normal(blocks)
    expected: Any = wilcoxon(losses - least, alternative="greater")
    assert signed_rank(losses, least) == pytest.approx(expected.pvalue, rel=1e-9)


def test_blocks_that_are_alike_share_their_ranks() -> None:
    least = np.full(12, 4.0)
    losses = least + np.array([1.0, 1.0, -1.0, 2.0, 0.0, 0.0, 3.0, -2.0, 1.0, 5.0, 4.0, 1.0])
    expected: Any = wilcoxon(losses - least, alternative="greater")
    assert signed_rank(losses, least) == pytest.approx(expected.pvalue, rel=1e-9)
    assert signed_rank(least, least) == 1.0
