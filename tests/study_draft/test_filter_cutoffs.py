"""The filter of a draft: lower cut-offs where noise of positions would shrink parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.recording import Recording, default_filter, suited_filter
from dynident.study_draft import Decision, draft_study
from study_files import recording
from synthetic import ARM

ONCE = slice(0, 780)
"""Of 8 s at 100 Hz, which repeat only afterwards."""


def drafted(folder: Path, one: Recording, ask=None) -> tuple[di.Study, tuple[Decision, ...]]:
    (folder / "arm.urdf").write_text(ARM)
    rows = np.column_stack([one.t, one.q, one.tau])
    names = "t,q.shoulder,q.elbow,tau.shoulder,tau.elbow"
    np.savetxt(data := folder / "run.csv", rows, delimiter=",", header=names, comments="")
    draft = draft_study(folder / "arm.urdf", [data], ask=ask)
    return di.load(draft.write(folder / "study.toml")), draft.decisions


def noisy(std: float) -> Recording:
    one = recording(1).part(ONCE)
    return one.replace(q=one.q + std * np.random.default_rng(7).normal(size=one.q.shape))


def jittered(seconds: float) -> Recording:
    """As a clock has it that says when a sample was written, not when it was taken."""
    one = recording(1).part(ONCE)
    late = seconds * np.random.default_rng(7).uniform(size=one.samples)
    q = np.column_stack([np.interp(one.t - late, one.t, x) for x in one.q.T])
    return one.replace(q=q)


@pytest.mark.parametrize("bad", [noisy(2e-3), jittered(4e-3)], ids=["encoders", "clock"])
@pytest.mark.slow
def test_noise_of_positions_asks_for_lower_cutoffs_which_bring_parameters_back(
    tmp_path: Path, bad: Recording
) -> None:
    study, decisions = drafted(tmp_path, bad)
    (reason,) = (one.reason for one in decisions if one.subject == "filter")
    assert "may make the former too small" in reason
    usual, found = default_filter(100.0), study.train.filter
    assert found is not None and found.cutoff_hz and usual.cutoff_hz
    assert found.cutoff_hz <= usual.cutoff_hz / 2
    inertial = slice(0, study.model.slices["viscous_friction@shoulder"].start)
    clean = di.Dataset((recording(1).part(ONCE),))
    true = di.fit(study.model, clean).values[inertial]
    lower, wide = (
        np.linalg.norm(di.fit(study.model, one).values[inertial] - true)
        for one in (study.train, replace(study.train, filter=usual))
    )
    assert lower < 0.5 * wide


def test_without_such_noise_the_usual_filter_stays(tmp_path: Path) -> None:
    study, decisions = drafted(tmp_path, recording(1).part(ONCE))
    assert "filter" not in {one.subject for one in decisions}
    assert study.train.filter == suited_filter(study.train.recordings)


def test_what_repeats_tells_its_noise_by_itself(tmp_path: Path) -> None:
    one = recording(1)
    noise = 2e-3 * np.random.default_rng(7).normal(size=one.q.shape)
    study, _ = drafted(tmp_path, one.replace(q=one.q + noise))
    assert study.train.recordings[0].period is not None
    assert study.train.filter == suited_filter(study.train.recordings)


def test_whoever_is_asked_may_keep_the_usual_filter(tmp_path: Path) -> None:
    def usual(one: Decision) -> int:
        return int(one.subject == "filter")

    study, _ = drafted(tmp_path, noisy(2e-3), ask=usual)
    assert study.train.filter == suited_filter(study.train.recordings)
