"""Reference motions: periodic, smooth, within the limits of the joints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm

from dynident.closed_loop import Fourier
from dynident.effect_contract.crane import crane
from dynident.errors import SimulationError

CRANE_ROBOT = crane()
LOWER, UPPER, FASTEST = (
    np.array([getattr(joint, name) for joint in CRANE_ROBOT.joints])
    for name in ("lower", "upper", "velocity")
)


@settings(max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**31), harmonics=st.integers(1, 12), period=st.floats(0.2, 50))
def test_random_motions_respect_the_limits_and_repeat(seed, harmonics, period) -> None:
    found = Fourier.random(CRANE_ROBOT, period, seed, harmonics)
    t = np.linspace(0, period, 1237)
    q, v, _ = found.at(t)
    assert np.all((q > LOWER) & (q < UPPER))
    assert np.all(np.abs(v) <= 0.8 * FASTEST)
    for now, later in zip(found.at(t), found.at(t + 7 * period), strict=True):
        np.testing.assert_allclose(later, now, atol=1e-8 * np.abs(now).max())


def test_velocity_and_acceleration_are_derivatives() -> None:
    found = Fourier.random(CRANE_ROBOT, 3.0, 1)
    t, h = np.linspace(0, 3, 50), 1e-5
    ahead, behind, (_, v, a) = found.at(t + h), found.at(t - h), found.at(t)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), v, atol=1e-7)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), a, atol=1e-6)


def test_the_tightest_limit_is_reached() -> None:
    t = np.linspace(0, 8, 4001)
    for limit, column in (("amplitude", 0), ("speed", 1), ("acceleration", 2)):
        settings_: dict[str, Any] = {"amplitude": 0.9, "speed": 2.9, "acceleration": 99.0}
        settings_ |= {limit: 0.05}
        found = Fourier.random(arm(), 8.0, 3, **settings_).at(t)[column]
        np.testing.assert_allclose(np.abs(found).max(0), 0.05, rtol=0.003)


def test_seeds() -> None:
    one, same, other = (Fourier.random(arm(), 8.0, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.sine, same.sine)
    assert not np.allclose(one.sine, other.sine)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed": 100.0}, "speed, joint 'shoulder': is beyond the joint's limit"),
        ({"amplitude": [0.1, 9.0]}, "amplitude, joint 'elbow': leaves the joint's range"),
        ({"amplitude": [0.1, 0.1, 0.1]}, "3 for 2 joints"),
        ({"amplitude": 0.0}, "amplitude"),
        ({"acceleration": -1.0}, "not positive"),
        ({"centre": 4.0}, "outside"),
        ({"harmonics": 0}, "harmonics"),
        ({"period": 0.0}, "period"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], words: str) -> None:
    settings_: dict[str, Any] = {"period": 8.0, "seed": 1} | changes
    with pytest.raises(SimulationError, match=words):
        Fourier.random(arm(), **settings_)
