"""The problem `hidden_effect`: its files are what its experiment makes, and keep the secret."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynident.closed_loop import load_experiment
from dynident.recording import read
from dynident.study import load

PROBLEM = Path(__file__).parents[2] / "problems" / "hidden_effect"


def test_recordings_are_those_of_the_experiment() -> None:
    """The first half second of two runs, simulated again."""
    experiment = load_experiment(PROBLEM / "experiment.toml")
    short = tuple(replace(run, duration=0.5) for run in experiment.runs[:2])
    for found in replace(experiment, runs=short).run():
        kept = read(PROBLEM / found.name, experiment.robot.names).cut(0.0, 0.499)
        # Motions beside it change the integrator's last digits; what the encoder then rounds to
        # the neighbouring step (1e-5 rad, 0.02 N m through the gains) the loop carries on.
        np.testing.assert_allclose(found.q, kept.q, atol=2e-4)
        assert np.abs(found.tau - kept.tau).mean() < 0.05


def test_the_study_tells_all_but_the_hidden_effect() -> None:
    experiment = load_experiment(PROBLEM / "experiment.toml")
    study = load(PROBLEM / "study.toml")
    hidden = [one.effect for one in experiment.effects if one.hidden]
    assert [one.label for one in hidden] == ["stribeck_friction@elbow"]
    assert set(study.model.effects) == {one.effect for one in experiment.known_effects}
    assert study.controller == experiment.controller
    assert (len(study.train), len(study.test)) == (4, 2)
    for recording in (*study.train.recordings, *study.test.recordings):
        assert recording.duration == pytest.approx(16.0, abs=0.01)
        assert recording.period == 8.0
        assert recording.torque == "held_command"


def test_the_problem_is_small() -> None:
    files = list(PROBLEM.iterdir())
    assert sum(file.stat().st_size for file in files) < 2 * 2**20
    for file in files:
        if file.name not in ("experiment.toml", "README.md"):
            assert "stribeck" not in file.read_text().lower()
