"""Drafts of studies of bags: two drivers on one topic, joints with a prefix."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="bags need the extra `ros`, which is a part of `test`")

import dynident as di
from dynident.study_draft import draft_study
from ros_bags import JointMessage, messages_of, write_bag
from study_files import recording
from synthetic import ARM


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_what_is_drafted_is_read(tmp_path: Path, kind: str) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    bags = []
    for seed in (1, 2):
        one = recording(seed)
        arm = messages_of(one, [f"cell/{joint}" for joint in one.joints])
        gripper = [JointMessage(["finger"], k * 0.1 + 1e-3, [1.0], [], [2.0]) for k in range(50)]
        (tmp_path / f"run_{seed}").mkdir()
        messages = sorted(arm + gripper, key=lambda message: message.stamp or 0.0)
        bags.append(write_bag(tmp_path / f"run_{seed}", kind, messages))
    draft = draft_study(tmp_path / "arm.urdf", bags)
    study = di.load(draft.write(tmp_path / "study.toml"))
    assert study.train.recordings[0].joints == ("shoulder", "elbow")
    np.testing.assert_array_equal(study.train.recordings[0].q, recording(1).q)
    np.testing.assert_array_equal(study.test.recordings[0].tau, recording(2).tau)
    skipped = study.train.recordings[0].provenance.skipped
    assert "50 of 1651 messages: of other joints" in skipped
