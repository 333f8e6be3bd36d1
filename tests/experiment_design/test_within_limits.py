"""Limits hold between instants, and for the robot as it is where its description is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from designs_within_limits import Drawn, seen
from dynident.experiment_design.columns.predicted_torque import SIGMAS, PredictedTorque
from dynident.experiment_design.design_question import DesignQuestion, RecordedFits
from dynident.experiment_design.motion_limits import above_instants
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.model import Model


@pytest.mark.parametrize("harmonics", [1, 4, 9])
def test_peaks_between_instants_are_seen(harmonics: int) -> None:
    rng = np.random.default_rng(harmonics)
    for _ in range(20):
        amplitudes, phases = rng.normal(size=harmonics), rng.uniform(0, 7, harmonics)

        def wave(count: int, amplitudes=amplitudes, phases=phases) -> np.ndarray:
            angle = np.outer(np.arange(count) * (2 * np.pi / count), 1 + np.arange(harmonics))
            return np.sin(angle + phases) @ amplitudes

        few, many = wave(60 * harmonics)[:, None], wave(6000 * harmonics)
        highest = (few + above_instants(few)).max()
        assert few.max() < many.max() <= highest + 1e-5 * np.ptp(many)
        assert highest < many.max() + 2e-3 * np.ptp(many)


@pytest.mark.parametrize("seed", [3, 11])
def test_torques_are_predicted_where_small_motions_say_little(seed: int) -> None:
    """Where a fit alone is wrong by more than there is, the description closes what is open."""
    drawn = Drawn.of(seed)
    model, recorded = Model(drawn.described), drawn.recorded
    motions = FourierMotions(limits=drawn.limits, period=5.0, harmonics=4)
    question = DesignQuestion.of(model, RecordedFits(recorded), drawn.task, motions)
    torque, t = question.torque, motions.times(300)
    motion = motions.trajectory(motions.random(5) * 0.3).at(t)
    true = drawn.robot.inverse_dynamics(*motion)

    def wrong(found: np.ndarray) -> float:
        return float(np.sqrt(np.mean((found - true) ** 2)))

    fitted = model.torque(model.block(t, *motion), question.estimate.values)
    ours, described = torque.along(t, *motion), drawn.described.inverse_dynamics(*motion)
    assert wrong(ours) < min(wrong(fitted), wrong(described))
    sigma = np.abs(torque.farthest(t, *motion) - ours) / SIGMAS
    rounding = 1e-4 * np.abs(true).max()  # and what the filter does to the recording
    assert np.all(np.abs(true - ours) <= SIGMAS * sigma + rounding)
    # Nor is that bought by saying that nothing is known.
    assert np.mean(sigma) < 0.2 * np.sqrt(np.mean(true**2))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_random_robots_keep_their_limits(seed: int) -> None:
    """A sample of the benchmark: by Pinocchio and Drake, on a hundred times as many instants."""
    drawn = Drawn.of(seed)
    assert seen(drawn, drawn.designed()).beyond == []


def test_what_is_open_between_the_instants_looked_at_counts() -> None:
    drawn = Drawn.of(3)
    motions = FourierMotions(limits=drawn.limits, period=5.0, harmonics=4)
    question = DesignQuestion.of(
        Model(drawn.described), RecordedFits(drawn.recorded), drawn.task, motions
    )
    torque, t = question.torque, motions.times(1000)
    for seed in range(5):
        motion = motions.trajectory(motions.random(seed) * 0.3).at(t)
        exact = np.linalg.norm(torque.columns.along(t, *motion) @ torque.factor, axis=2)
        counted = np.abs(torque.farthest(t, *motion) - torque.along(t, *motion)) / SIGMAS
        assert np.all(counted >= (1.0 - 1e-3) * exact)
        assert np.mean(counted) < 1.2 * np.mean(exact)


def test_an_effect_that_usual_motions_do_not_show_is_not_taken_for_known() -> None:
    drawn = Drawn.of(3)
    model = Model(drawn.described) + "viscous_friction"
    size = np.ones(model.size)
    size[-1] = 0.0
    nothing = np.zeros((model.size,) * 2)
    found = PredictedTorque.of(model, model.given_values(), nothing, size)
    sigma = np.linalg.norm(found.factor, axis=1)
    assert sigma[-1] >= sigma[-2] > 0
