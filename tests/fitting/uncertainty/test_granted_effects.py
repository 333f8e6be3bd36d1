"""A tilt is known no better than the description that its columns come from, and that is said."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.fitting import Estimate, LeastSquares, fit
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from dynident.tables import number
from synthetic import synthetic, true_values
from torso import WAIST

TORSO = Robot.from_text(WAIST)
TILT = np.array([0.04, 0.03])
GRANTED = "takes for granted that there is no unbalance at waist"


def tilted(seed: int, moment: float = 0.03) -> Dataset:
    """A torso on a tilt, whose description is off by so many kg m beside its axis."""
    true = Model(TORSO) + "base_tilt" + "unbalance@waist"
    values = true_values(true)
    values[true.slices["base_tilt"]] = TILT
    values[true.slices["unbalance@waist"]] = 9.81 * moment * np.array([TILT[1], -TILT[0]])
    return Dataset((synthetic(true, values, seed, rate_hz=250.0, torque_std=0.02),))


def off(found: Estimate) -> np.ndarray:
    """Errors of the tilt, (2,) rad."""
    return found.effect_values("base_tilt") - TILT


@pytest.mark.slow
def test_sigma_says_what_it_takes_for_granted_and_what_it_would_be_else() -> None:
    given = Model(TORSO) + "base_tilt"
    granted, known = [], []
    for seed in range(12):
        data = tilted(seed)
        narrow, wide = fit(given, data), fit(given + "unbalance@waist", data)
        own = narrow.model.slices["base_tilt"]
        granted.append(off(narrow) / narrow.sigma[own])
        known.append(off(wide) / wide.sigma[own])
        assert GRANTED in narrow.words_of_sigma and GRANTED not in wide.words_of_sigma
        ratio = wide.sigma[own] / narrow.sigma[own]
        i = own.start + int(np.argmax(ratio))
        value, sigma = number(float(wide.values[i]), 3), number(float(wide.sigma[i]), 2)
        told = f"{narrow.names[i]} is {value} with a sigma of {sigma} rad"
        assert ratio.max() > 1.5 and told in narrow.words_of_sigma
    assert np.sqrt(np.mean(np.square(granted))) > 3.0
    assert np.sqrt(np.mean(np.square(known))) < 1.5


def test_nothing_is_said_without_a_tilt_and_a_table_s_rows_stay_independent() -> None:
    given = Model(TORSO)
    assert GRANTED not in fit(given, tilted(0)).words_of_sigma
    plain = fit(given + "base_tilt", tilted(0), LeastSquares(errors="independent"))
    assert GRANTED in plain.words_of_sigma and plain.takes_rows_as_independent
