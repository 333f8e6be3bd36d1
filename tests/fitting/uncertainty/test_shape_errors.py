"""Intervals hold that shapes are estimated; what a shape leaves open gets none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dynident.effects import effects_of
from dynident.fitting import fit
from dynident.fitting.estimate import Estimate
from dynident.fitting.estimate_file import load_estimate
from dynident.fitting.uncertainty.shape_slopes import width_slope
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
LABEL, SIZE, LEVEL = "stribeck_friction@elbow", "Fs@elbow", 4.0
SEEDS = range(16)


def model(speed: float) -> Model:
    """An arm whose elbow's friction falls over a speed, rad/s."""
    plain = Model(arm()) + "viscous_friction" + "coulomb_friction"
    (effect,) = effects_of(LABEL, plain.robot)
    return plain + effect.shaped(speed)


@cache
def estimates(speed: float, level: float) -> tuple[Estimate, ...]:
    """One for each seed of the noise, the speed sought with all else."""
    full = model(speed)
    truth = true_values(full, **FRICTION, Fs__elbow=level)
    made = (synthetic(full, truth, s, rate_hz=250.0, torque_std=0.3) for s in SEEDS)
    return tuple(fit(full, Dataset((one,))) for one in made)


def of_size(one: Estimate) -> tuple[float, float]:
    return one.value(SIZE), float(one.sigma[one.names.index(SIZE)])


@pytest.mark.slow
def test_a_size_is_as_uncertain_as_its_shape_makes_it() -> None:
    """Few samples are so slow: with the speed as known, sigma is a sixth of what values scatter."""
    told = np.array([of_size(one) for one in estimates(0.012, LEVEL) if not one.trading_off])
    assert len(told) >= 8
    assert np.median(told[:, 1]) > 0.5 * np.std(told[:, 0], ddof=1)
    within = np.abs(told[:, 0] - LEVEL) < 1.96 * told[:, 1]
    assert np.mean(within) >= 0.75


@pytest.mark.slow
def test_a_size_that_its_shape_leaves_open_is_no_number(tmp_path: Path) -> None:
    open_ = [one for one in estimates(0.012, LEVEL) if one.trading_off]
    assert open_
    for one in open_:
        assert one.trading_off == (SIZE,)
        row = next(row for row in one.parameter_table().rows if row[0] == SIZE)
        assert row[1:4] == ("-", "-", "-") and row[-1].startswith("not determined")
        again = load_estimate(one.save(tmp_path / "estimate.json"))
        assert again.trading_off == one.trading_off and again.values == pytest.approx(one.values)


@pytest.mark.slow
def test_what_the_data_show_well_is_told() -> None:
    assert not any(one.trading_off for one in estimates(0.1, 0.8))


def test_the_slope_of_a_width_is_the_derivative_of_the_torque() -> None:
    full = model(0.1)
    values = true_values(full, **FRICTION, Fs__elbow=0.8)
    motion = synthetic(full, values, 0, rate_hz=50.0)
    zero = np.zeros_like(motion.q)
    v = np.linspace(-0.05, 0.05, len(motion.t))[:, None] * np.ones(2)
    slope = width_slope(full, values, "elbow")
    assert slope is not None

    def torque(factor: float) -> np.ndarray:
        other = full.with_friction_width("elbow", 0.01 * factor)
        block = other.with_regressor(other.block(motion.t, motion.q, v, zero))
        return other.torque(block, values)

    step = 1e-3
    expected = (torque(np.exp(step)) - torque(np.exp(-step))) / (2 * step)
    found = slope.columns(full.block(motion.t, motion.q, v, zero))[:, :, 0]
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    assert np.abs(found[:, 1]).max() > 0.1 and not np.any(found[:, 0])
    assert width_slope(replace(full, effects=()), values, "elbow") is None
