"""What torques beside the described ones say of units, and what they do not."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.wiring.assignment import Assignment
from dynident.wiring.described_torque import DescribedScale


def scale(factor: list[float], share: list[float], over_effort: list[float]) -> DescribedScale:
    shares = np.array(share)
    return DescribedScale(
        factor=np.array(factor),
        known=shares > 0,
        share=shares,
        over_effort=np.array(over_effort),
    )


AS_DESCRIBED = ([1.0, 1.1, 0.9], [0.9, 0.8, 0.7], [0.2, 0.3, 0.2])
"""Factor, share and torque over limit of three joints."""


@pytest.mark.parametrize(
    ("share", "accused"), [(0.05, False), (0.8, True)], ids=["coupled", "in N mm"]
)
def test_a_small_described_torque_accuses_no_joint_that_other_physics_moves(
    share: float, accused: bool
) -> None:
    factor, shares, over = (
        [*one, more] for one, more in zip(AS_DESCRIBED, (300.0, share, 0.5), strict=True)
    )
    found = scale(factor, shares, over).hypothesis(Assignment.as_recorded(4), DEFAULTS.wiring)
    assert (found is not None) == accused


@pytest.mark.parametrize(("over", "accused"), [(6.0, False), (60.0, True)])
def test_a_torque_a_few_times_over_its_limit_is_no_other_unit(over: float, accused: bool) -> None:
    factor, shares, efforts = (
        [*one, more] for one, more in zip(AS_DESCRIBED, (0.0, 0.0, over), strict=True)
    )
    found = scale(factor, shares, efforts).hypothesis(Assignment.as_recorded(4), DEFAULTS.wiring)
    assert (found is not None) == accused
