"""A torque that stays at one value while the joint moves is said to be cut off; no other is."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest

from dynident.model import Model
from dynident.recording import Recording, warn_of_limited_torque
from synthetic import arm, synthetic, true_values

MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
NAMES = MODEL.robot.names


def changed(change: Callable[[np.ndarray], np.ndarray], torque_std: float = 0.1) -> list[Recording]:
    """Two recordings with another torque at the elbow."""
    truth = true_values(MODEL)
    runs = [synthetic(MODEL, truth, seed, rate_hz=250.0, torque_std=torque_std) for seed in (0, 1)]
    return [
        one.replace(tau=np.stack([one.tau[:, 0], change(one.tau[:, 1])], axis=1)) for one in runs
    ]


def said(recordings: list[Recording]) -> list[str]:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        warn_of_limited_torque(recordings)
    return [str(one.message) for one in found]


@pytest.mark.parametrize("low", [-np.inf, -2.0])
def test_a_torque_that_is_cut_off_is_named_with_the_value(low: float) -> None:
    (warning,) = said(changed(lambda tau: np.clip(tau, low, 2.0)))
    assert f"tau.{NAMES[1]} is " in warning and "2 in " in warning
    assert "or of the log" in warning


@pytest.mark.parametrize(
    "change",
    [
        lambda tau: tau,
        lambda tau: np.round(tau / 0.2) * 0.2,
        lambda tau: np.round(tau * 10) / 10,
        np.zeros_like,
    ],
)
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_noise_coarse_steps_and_no_torque_are_no_limit(
    change: Callable[[np.ndarray], np.ndarray], noise: float
) -> None:
    assert said(changed(change, noise)) == []


def test_a_joint_that_is_held_has_one_torque_and_no_limit() -> None:
    still = [
        one.replace(q=np.zeros_like(one.q), tau=np.full_like(one.tau, 3.0))
        for one in changed(lambda tau: tau)
    ]
    assert said(still) == []
