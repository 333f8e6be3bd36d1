"""Where nothing repeats, a residual that follows the motion is no noise, and noise follows none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis.result import Diagnosis
from dynident.recording import Dataset, Recording
from dynident.reporting.headline import headline
from study_files import true_model
from synthetic import synthetic, true_values

FRICTION = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__elbow": 1.5}


def once(seed: int, hidden: float) -> Recording:
    """A motion that never repeats, with a viscosity at the elbow that depends on its position."""
    model = true_model()
    made = synthetic(
        model,
        true_values(model, **FRICTION),
        seed,
        rate_hz=200.0,
        position_std=1e-5,
        torque_std=0.1,
        period=None,
    )
    v = np.gradient(made.q[:, 1], made.t)
    push = np.column_stack([np.zeros_like(v), hidden * v * np.sin(3.0 * made.q[:, 1])])
    return replace(made, tau=made.tau + push)


def diagnosed(hidden: float) -> Diagnosis:
    train = Dataset(tuple(once(seed, hidden) for seed in (0, 1, 2)))
    test = Dataset((once(3, hidden),))
    return di.diagnose(true_model(), train, test)


def test_a_law_that_no_catalogue_has_is_found_without_a_noise_floor() -> None:
    found = diagnosed(0.8)
    assert found.noise_source == "unknown"
    assert (found.verdict, found.following_motion) == ("unexplained", ("elbow",))
    assert "What is left at elbow is not all noise" in found.sentence
    assert "elbow follows the motion" in headline(found).sentence
    first = found.proposals[0]
    assert first.effect.joint == "elbow"
    assert first.test_error_after < 0.5 * found.test_error.before


@pytest.mark.parametrize("hidden", [0.0, 0.002])
def test_noise_and_what_is_far_below_it_follow_no_motion(hidden: float) -> None:
    found = diagnosed(hidden)
    assert found.noise_source == "unknown"
    assert (found.verdict, found.following_motion) == ("nothing_missing", ())
    assert "whether something else is missing cannot be said" in found.sentence
