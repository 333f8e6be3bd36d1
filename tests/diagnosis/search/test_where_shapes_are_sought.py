"""Shapes of springs and gaps are sought at joints where enough is left, and at no others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search.global_search import _felt


@pytest.mark.parametrize(
    ("over_noise", "felt"),
    [
        ((4.0, 1e-3), (True, False)),
        ((0.4, 0.1), (True, True)),  # both have a part of what is left
        ((1e3, 2.0), (True, True)),  # a small part of it, and twice the noise
        ((1e3, 0.5), (True, False)),
        ((1e3, -5.0), (True, False)),  # an estimate of a square, below zero by chance
    ],
)
def test_more_than_noise_or_a_part_of_all(
    over_noise: tuple[float, ...], felt: tuple[bool, ...]
) -> None:
    variances = np.array([0.01, 4.0])
    fitted: Any = SimpleNamespace(
        criteria=DEFAULTS, squares=np.array(over_noise) * variances, variances=variances
    )
    assert tuple(_felt(fitted)) == felt
