"""A seven-joint arm whose recordings leave three pairs of effects open, and what settles them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import dynident as di
from dynident.closed_loop import load_experiment
from dynident.diagnosis import Diagnosis
from dynident.recording.dataset import numbered
from problem_scripts import PROBLEMS

PROBLEM = PROBLEMS / "which_of_two"
HIDDEN = {
    "joint_spring@joint6": "torque_ripple@joint6",
    "joint_zero@joint4": "torque_offset@joint5",
    "quadratic_drag@joint1": "stribeck_friction@joint1",
}
"""Each with a rival that the small motions do not tell it from."""


@cache
def diagnosis(*more: str) -> Diagnosis:
    study = di.load(PROBLEM / "study.toml")
    made = [di.read(PROBLEM / name).replace(period=10.0) for name in more]
    (every,) = numbered(replace(study.train, recordings=(*study.train.recordings, *made)))
    return di.diagnose(study.model, every, propose="never")


def test_what_is_hidden_is_what_the_experiment_says() -> None:
    truth = load_experiment(PROBLEM / "experiment.toml")
    assert {one.effect.label for one in truth.effects if one.hidden} == set(HIDDEN)


@pytest.mark.slow
def test_small_motions_leave_three_pairs_open() -> None:
    named = {
        step.effect.label: {one.label for one in step.indistinguishable}
        for step in diagnosis().steps
    }
    for effect, rival in HIDDEN.items():
        assert any({effect, rival} <= {label, *others} for label, others in named.items())


@pytest.mark.slow
def test_the_designed_recording_settles_each() -> None:
    after = diagnosis("designed.npz")
    assert {step.effect.label for step in after.steps} == set(HIDDEN)
    assert not any(step.indistinguishable for step in after.steps)
    assert after.verdict == "explained"
    truth = {one.effect.label: one for one in load_experiment(PROBLEM / "experiment.toml").effects}
    for label in HIDDEN:
        found = after.after.effect_values(label)[0]
        assert found == pytest.approx(truth[label].values[0], rel=0.03)


def test_no_recording_has_the_noise_of_another() -> None:
    names = [f"small{k}.npz" for k in (1, 2)] + ["designed.npz"]
    # Fourth differences hold the noise of the encoders and next to nothing of a motion.
    noise = [np.diff(di.read(PROBLEM / name).q[:3200, 0], 4) for name in names]
    alike = np.corrcoef(noise) - np.eye(len(names))
    assert np.abs(alike).max() < 0.2
