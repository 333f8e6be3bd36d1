"""Where nothing repeats, a residual that follows the motion is no noise, and noise follows none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import dynident as di
from dynident.criteria import DEFAULTS
from dynident.diagnosis.result import Diagnosis
from dynident.recording import Dataset, Recording
from dynident.reporting.headline import headline
from study_files import true_model
from synthetic import synthetic, true_values

FRICTION = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__elbow": 1.5}


def unrepeated(seed: int, **recorded: Any) -> Recording:
    """A motion that never repeats, of the arm as its model has it."""
    model = true_model()
    values = true_values(model, **FRICTION)
    return synthetic(model, values, seed, position_std=1e-5, period=None, **recorded)


def once(seed: int, hidden: float) -> Recording:
    """The same with a viscosity at the elbow that depends on its position."""
    made = unrepeated(seed, rate_hz=100.0, torque_std=0.1)
    v = np.gradient(made.q[:, 1], made.t)
    push = np.column_stack([np.zeros_like(v), hidden * v * np.sin(3.0 * made.q[:, 1])])
    return replace(made, tau=made.tau + push)


def diagnosed(hidden: float) -> Diagnosis:
    train = Dataset(tuple(once(seed, hidden) for seed in (0, 1, 2)))
    test = Dataset((once(3, hidden),))
    return di.diagnose(true_model(), train, test)


@pytest.mark.slow
def test_a_law_that_no_catalogue_has_is_found_without_a_noise_floor() -> None:
    found = diagnosed(0.8)
    assert found.noise_source == "unknown"
    assert (found.verdict, found.following_motion) == ("unexplained", ("elbow",))
    assert "What is left at elbow is not all noise" in found.sentence
    assert "elbow follows the motion" in headline(found).sentence
    # What is printed is the regression that the verdict goes by.
    (printed,) = [one for one in found.residual_dependence if one.joint == "elbow"]
    assert "position and velocity" in printed.of_the_motion(DEFAULTS.verdict)
    first = found.proposals[0]
    assert first.effect.joint == "elbow"
    assert first.test_error_after < 0.5 * found.test_error.before


@pytest.mark.slow
def test_a_product_of_two_speeds_is_found_without_a_noise_floor() -> None:
    """No function of one joint's position and velocity predicts it."""

    def coupled(seed: int) -> Recording:
        made = unrepeated(seed, rate_hz=100.0, torque_std=0.1)
        v = np.gradient(made.q, made.t, axis=0)
        push = np.column_stack([0.5 * v[:, 0] * v[:, 1], np.zeros(len(v))])
        return replace(made, tau=made.tau + push)

    train = Dataset(tuple(coupled(seed) for seed in (0, 1, 2)))
    found = di.diagnose(true_model(), train, Dataset((coupled(3),)))
    assert (found.verdict, found.following_motion) == ("unexplained", ("shoulder",))
    (printed,) = [one for one in found.residual_dependence if one.joint == "shoulder"]
    assert set(printed.of_the_motion(DEFAULTS.verdict)) == {"speeds of other joints"}
    assert found.proposals[0].test_error_after < 0.5 * found.test_error.before


@pytest.mark.slow
def test_slow_noise_that_spoils_the_parameters_follows_no_motion() -> None:
    """What errors of the parameters make of a test recording is a function of the motion."""

    def slow(seed: int, duration: float) -> Recording:
        made = unrepeated(seed, rate_hz=100.0, duration=duration)
        stays = np.exp(-0.01 / 0.2)
        white = np.random.default_rng([seed, 7]).normal(size=(len(made.t) + 2000, 2))
        coloured: Any = lfilter([np.sqrt(1 - stays**2)], [1.0, -stays], white, axis=0)[2000:]
        return replace(made, tau=made.tau + 3.0 * coloured)

    for seed in range(100, 180, 10):
        test = Dataset((slow(seed + 1, 16.0), slow(seed + 2, 16.0)))
        found = di.diagnose(true_model(), Dataset((slow(seed, 6.0),)), test, propose="never")
        assert found.following_motion == ()


@pytest.mark.parametrize("hidden", [0.0, pytest.param(0.002, marks=pytest.mark.slow)])
def test_noise_and_what_is_far_below_it_follow_no_motion(hidden: float) -> None:
    found = diagnosed(hidden)
    assert found.noise_source == "unknown"
    assert (found.verdict, found.following_motion) == ("nothing_missing", ())
    assert "whether something else is missing cannot be said" in found.sentence
