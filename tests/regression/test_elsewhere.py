"""Moments that are made in other processes, and add up here."""

from __future__ import annotations

import pickle
from functools import reduce
from operator import add
from typing import Any

import cloudpickle
import numpy as np
import pytest
from joblib import Parallel, delayed

import dynident as di


def test_the_package_goes_by_its_name() -> None:
    """As a notebook's functions do, which are sent with all that they refer to."""
    sent = cloudpickle.dumps(lambda: di)
    assert pickle.loads(sent)() is di


@pytest.mark.slow
def test_statistics_of_other_processes_add_up() -> None:
    def of_piece(seed: int) -> di.regression.SecondMoments:
        rng = np.random.default_rng(seed)
        X = rng.standard_normal((200, 4)) + seed
        return di.regression.SecondMoments.of(
            X, X @ [1.0, 2.0, 0.0, -1.0] + rng.standard_normal(200)
        )

    each: list[Any] = list(Parallel(n_jobs=2)(delayed(of_piece)(seed) for seed in range(4)))
    here: list[Any] = [of_piece(seed) for seed in range(4)]
    total = reduce(add, each)
    np.testing.assert_allclose(total.total, reduce(add, here).total, rtol=1e-12, atol=1e-9)
    assert total.count == 800
    found = di.regression.BayesianFactorRegression().fit_statistics(total)
    np.testing.assert_allclose(found.coef_, [1.0, 2.0, 0.0, -1.0], atol=0.15)
