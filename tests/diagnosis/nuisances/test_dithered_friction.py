"""Noise that a drive feeds into a joint dithers it, and blunts its dry friction: no finding."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.closed_loop import Experiment, ExperimentRun, Fourier, load_experiment
from dynident.diagnosis.nuisances.other_reversals import DitheredReversal
from synthetic import arm

PROBLEM = Path(__file__).resolve().parents[3] / "problems" / "hidden_effect"
WIDTH = 0.01


@pytest.mark.parametrize(("jitter", "damping"), [(0.5, 1.0), (1.2, 50.0), (3.0, 10.0)])
def test_it_is_the_mean_of_dry_friction_over_the_jitter(jitter: float, damping: float) -> None:
    v = np.array([-0.1, -0.021, -0.004, 0.0, 0.007, 0.016, 0.05, 1.0])
    law = DitheredReversal("elbow").on(arm()).shaped(jitter, damping)
    std = jitter * WIDTH / np.sqrt(1.0 + damping / np.cosh(v / WIDTH) ** 2)
    draws = np.random.default_rng(1).standard_normal((200_000, 1))
    mean = np.tanh((v + std * draws) / WIDTH).mean(axis=0)
    np.testing.assert_allclose(law.direction(v, np.zeros_like(v), WIDTH), mean, atol=5e-3)


def small_motions(seed: int) -> Experiment:
    """The arm of the problem without what is hidden, which moves by a tenth of a radian."""
    whole = load_experiment(PROBLEM / "experiment.toml")
    runs = tuple(
        ExperimentRun(
            trajectory=Fourier.random(whole.robot, 8.0, [seed, k], amplitude=0.1, speed=1.5),
            duration=16.0,
            file=f"small{k + 1}.csv",
        )
        for k in range(3)
    )
    effects = tuple(one for one in whole.effects if not one.hidden)
    return replace(whole, effects=effects, runs=runs, seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [727, 728])
def test_a_healthy_arm_that_reverses_often_lacks_nothing(seed: int) -> None:
    study = di.load(PROBLEM / "study.toml")
    data = replace(study.train, recordings=small_motions(seed).run())
    found = di.diagnose(study.model, data, propose="never")
    assert (found.verdict, found.steps) == ("nothing_missing", ())
