"""What the verdict may say: nothing is missing only where nothing is."""

from __future__ import annotations

import numpy as np
import pytest

from dynident import diagnose as find
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def recordings(model: Model, **values: float) -> tuple[Recording, ...]:
    truth = true_values(model, **FRICTION, **values)
    noise = {"position_std": 2e-5, "torque_std": 0.3}
    return tuple(synthetic(model, truth, seed, rate_hz=250.0, **noise) for seed in range(4))


def with_contact(recording: Recording, size: float) -> Recording:
    """A bump of 0.4 s that returns in every period, at the elbow."""
    bump = size * np.exp(-(((np.mod(recording.t, 8.0) - 3.0) / 0.15) ** 2))
    tau = np.array(recording.tau)
    tau[:, 1] += bump
    return recording.replace(tau=tau)


@pytest.mark.parametrize("size", [1.0, 4.0])
def test_a_short_disturbance_that_returns_is_not_called_noise(model: Model, size: float) -> None:
    """However short: it is in every period, and no noise is."""
    runs = tuple(with_contact(one, size) for one in recordings(model))
    found = find(model, Dataset(runs[:3]), Dataset(runs[3:]))
    assert found.verdict == "unexplained"
    assert "beyond the noise" in found.sentence
