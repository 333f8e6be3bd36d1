"""`dynident init`, then the commands that follow, of logs as robots write them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="bags need the extra `ros`, which is a part of `test`")

import bag_logs
import dynident as di
from chains import chain_text
from dynident.recording import Recording, write
from ros_bags import KINDS, write_bag
from study_files import write_study
from synthetic import smooth_motion


def test_loads_are_said_on_the_command_line(run, tmp_path: Path) -> None:
    write_study(tmp_path)
    for said, message in (
        ("tra*=heavy", "'heavy' is no mass in kg"),
        ("tra*=-2", "a load of -2 kg"),
        ("crate_*=2.8", "no file is called 'crate_*'"),
    ):
        done = run("init", "arm.urdf", "train.csv", "--out", "new.toml", "--load", said)
        assert done.status == 2
        assert message in done.err
        assert not Path("new.toml").exists()
    done = run("init", "arm.urdf", "train.csv", "--out", "new.toml", "--load", "tra*=2.8", "--json")
    assert done.status == 0, done.err
    assert 'payload = "load"' in Path("new.toml").read_text()
    assert json.loads(done.out)["out"] == "new.toml"


def four_joints(seed: int) -> Recording:
    """Two periods of a four-joint arm with more friction at low speed in one joint."""
    model = di.Model(di.Robot.from_text(chain_text(4, 2)))
    for name in ("viscous_friction", "coulomb_friction", "stribeck_friction@j3"):
        model = model + name
    values = model.given_values()
    values[model.base.rank :] = [*(4 * [0.4]), *(4 * [0.3]), 0.8]
    t, q, v, a = smooth_motion(4, seed, 100.0, 16.0, 8.0, 0.5)
    tau = model.torque(model.block(t, q, v, a), values)
    tau = tau + 0.02 * np.random.default_rng(seed).normal(size=tau.shape)
    return Recording(t, q, tau, model.robot.names, v=v)


@pytest.mark.slow
def test_four_joints_in_bags_are_explained_as_by_hand(run, tmp_path: Path) -> None:
    """`init`, then `explain`, with nothing edited between them."""
    (tmp_path / "arm.urdf").write_text(chain_text(4, 2))
    recordings = [four_joints(1), four_joints(2)]
    drafts = {}
    for kind in KINDS:
        files = []
        for number, one in enumerate(recordings):
            (tmp_path / f"{kind}_{number}").mkdir()
            messages = bag_logs.as_driver_reports(one, number)
            files.append(write_bag(tmp_path / f"{kind}_{number}", kind, messages, text=3))
        study = tmp_path / f"{kind}.toml"
        done = run("init", tmp_path / "arm.urdf", *files, "--out", study)
        assert done.status == 0, done.err
        drafts[kind] = di.load(study)
    # One and the same study, whatever the bags: what is said of one is said of all.
    first, *others = drafts.values()
    for other in others:
        assert_same_study(first, other)
    drafted = run("explain", tmp_path / f"{KINDS[0]}.toml", "--json").json
    for number, one in enumerate(recordings):
        write(one, tmp_path / f"run_{number}.csv")
    (tmp_path / "hand.toml").write_text(
        'robot = "arm.urdf"\n'
        'effects = ["viscous_friction", "coulomb_friction", "torque_offset"]\n'
        '[[recordings]]\nfile = "run_0.csv"\nuse = "train"\nperiod = 8.0\n'
        '[[recordings]]\nfile = "run_1.csv"\nuse = "test"\nperiod = 8.0\n'
    )
    by_hand = run("explain", tmp_path / "hand.toml", "--json").json
    assert by_hand["verdict"] == "explained"
    assert [(one["effect"], one["joint"]) for one in by_hand["steps"]] == [
        ("stribeck_friction", "j3")
    ]
    assert drafted["verdict"] == "explained"
    found = [(one["effect"], one["joint"]) for one in drafted["steps"]]
    assert found == [("stribeck_friction", "j3")]
    # The clock alone differs, by whole nanoseconds.
    assert drafted["test_error"] == pytest.approx(by_hand["test_error"], rel=1e-5)


def assert_same_study(one: di.Study, other: di.Study) -> None:
    """The same model, settings and samples."""
    assert one.model.names == other.model.names
    for mine, theirs in ((one.train, other.train), (one.test, other.test)):
        assert len(mine.recordings) == len(theirs.recordings) == 1
        assert mine.filter == theirs.filter and mine.noise == theirs.noise
        for a, b in zip(mine.recordings, theirs.recordings, strict=True):
            assert a.period == b.period
            for signal in ("t", "q", "v", "tau"):
                np.testing.assert_array_equal(getattr(a, signal), getattr(b, signal))
