"""Columns that depend on the predicted torque settle, in the fit and in the diagnosis."""

from __future__ import annotations

import numpy as np
import pytest

from dynident import diagnose as find
from dynident import fit
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction" + "drive_gain@shoulder"


def recordings(model: Model, gain: float, torque_std: float = 0.0) -> tuple[Recording, ...]:
    truth = true_values(model, **FRICTION, e__shoulder=gain)
    return tuple(
        synthetic(model, truth, seed, rate_hz=250.0, torque_std=torque_std) for seed in range(3)
    )


@pytest.mark.parametrize("gain", [-0.5, 0.15, 1.5])
@pytest.mark.slow
def test_a_gain_is_found_whatever_its_size(model: Model, gain: float) -> None:
    estimate = fit(model, Dataset(recordings(model, gain)))
    assert estimate.value("e@shoulder") == pytest.approx(gain, abs=1e-4)
    assert estimate.error < 1e-4


@pytest.mark.parametrize("gain", [-0.4, pytest.param(0.8, marks=pytest.mark.slow)])
def test_a_model_with_a_gain_leaves_nothing_but_noise(model: Model, gain: float) -> None:
    """Taken at parameters that had not converged, the gain's column left a residual behind."""
    runs = recordings(model, gain, 0.05)
    found = find(model, Dataset(runs[:2]), Dataset(runs[2:]))
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    ratios = [j.ratio_after for j in found.joints if j.ratio_after is not None]
    assert np.max(ratios) < 0.6
