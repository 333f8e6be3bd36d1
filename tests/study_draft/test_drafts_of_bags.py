"""Drafts of studies of bags: two drivers on one topic, joints with a prefix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="bags need the extra `ros`, which is a part of `test`")

import dynident as di
from dynident.errors import RecordingError
from dynident.study_draft import LogFacts, draft_study
from ros_bags import JointMessage, messages_of, write_bag
from study_files import recording
from synthetic import ARM


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
@pytest.mark.slow
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


def test_a_topic_is_named_where_there_are_several(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    one, other = recording(1), recording(2)
    arms = [
        replace(message, topic=f"/{side}/joint_states")
        for side, arm in (("left", one), ("right", other))
        for message in messages_of(arm)
    ]
    bag = write_bag(tmp_path, "mcap", sorted(arms, key=lambda message: message.stamp or 0.0))
    with pytest.raises(RecordingError, match=r"on /left/joint_states, /right/joint_states"):
        draft_study(tmp_path / "arm.urdf", [bag])
    with pytest.raises(RecordingError, match="'/wrong' is not in it"):
        draft_study(tmp_path / "arm.urdf", [bag], facts=LogFacts(topic="/wrong"))
    facts = LogFacts(topic="/right/joint_states")
    draft = draft_study(tmp_path / "arm.urdf", [bag], facts=facts)
    study = di.load(draft.write(tmp_path / "study.toml"))
    np.testing.assert_array_equal(study.train.recordings[0].q, other.q)
