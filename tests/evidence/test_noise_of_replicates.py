"""The noise between replicates: its variance, its colour, its growth at low speed."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.evidence.noise_model import (
    SpeedClasses,
    differences,
    measure_noise,
    systematic_square,
)

RNG = np.random.default_rng(11)


def repeated(signal: np.ndarray, replicates: int, std: float, rng) -> np.ndarray:
    return signal + std * rng.normal(size=(replicates, *signal.shape))


@pytest.mark.parametrize("replicates", [2, 3])
def test_differences_have_the_variance_of_the_noise(replicates: int) -> None:
    residual = repeated(np.sin(np.arange(4000.0)), replicates, 0.3, RNG)
    assert np.mean(differences(residual, "repeated") ** 2) == pytest.approx(0.09, rel=0.08)
    assert systematic_square(residual, "repeated") == pytest.approx(0.5, rel=0.08)


def test_whitened_noise_is_white_and_of_unit_variance() -> None:
    """Noise that is coloured and grows at low speed."""
    speed = [np.cos(np.arange(3000) / 50.0 + k) for k in range(4)]
    shaped = []
    for v in speed:
        white = RNG.normal(size=3000)
        coloured = np.convolve(white, [1.0, 0.8, 0.4])[:3000]
        shaped.append(0.2 * coloured * (1.0 + 1.5 * np.exp(-((v / 0.2) ** 2))))
    model = measure_noise(shaped, SpeedClasses.of(speed, DEFAULTS.noise), DEFAULTS.noise)
    for noise, v in zip(shaped, speed, strict=True):
        e = model.whiten(noise[:, None], v)[20:, 0]
        assert np.mean(e**2) == pytest.approx(1.0, rel=0.15)
        assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 0.08
        slow = np.abs(v[20:]) < 0.1
        assert np.mean(e[slow] ** 2) == pytest.approx(1.0, rel=0.35)


def test_what_is_missing_counts_as_white_noise_on_top() -> None:
    noise = [RNG.normal(size=2000)]
    classes = SpeedClasses.of([np.ones(2000)], DEFAULTS.noise)
    plain, missing = (
        measure_noise(noise, classes, DEFAULTS.noise, misfit) for misfit in (0.0, 3.0)
    )
    probe = RNG.normal(size=(500, 1))
    ratio = np.std(plain.whiten(probe, np.ones(500))) / np.std(missing.whiten(probe, np.ones(500)))
    assert ratio == pytest.approx(np.sqrt(10.0), rel=0.05)
