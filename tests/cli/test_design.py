"""`dynident design`: files that can be followed and simulated."""

from __future__ import annotations

import json
import re
from functools import partial

import numpy as np
import pandas as pd
import pytest

import dynident as di
from dynident import experiment_design
from dynident.experiment_design import DesignTask
from dynident.experiment_design.written_design import read_design
from loop_studies import write_loop_study


@pytest.mark.slow
def test_the_design_is_written_and_can_be_simulated(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    wanted = ("--duration", "4", "--repeat", "2", "--harmonics", "3", "--starts", "1")
    done = run("design", study, *wanted, "--out", "next", "--json")
    assert done.status == 0, done.err
    table = pd.read_csv(tmp_path / "next" / "reference.csv")
    assert list(table.columns) == [
        "t",
        *(f"{what}.{joint}" for joint in ("shoulder", "elbow") for what in ("q_ref", "v_ref")),
    ]
    assert table.t.iloc[-1] == 8.0
    told = read_design(tmp_path / "next", ("shoulder", "elbow"))
    assert told.sentence == json.loads(done.out)["sentence"]
    assert told.study == di.load(study).digest and told.repeat == 2
    q, v, _ = told.trajectory.at(table.t.to_numpy())
    np.testing.assert_allclose(q[:, 1], table["q_ref.elbow"], atol=1e-8)
    np.testing.assert_allclose(v[:, 0], table["v_ref.shoulder"], atol=1e-8)
    half = len(table) // 2
    np.testing.assert_allclose(
        table["q_ref.elbow"][:half], table["q_ref.elbow"][half:-1], atol=1e-8
    )
    assert abs(table["v_ref.elbow"].iloc[0]) < 1e-9
    done = run("simulate", tmp_path / "next" / "experiment.toml", "--out", "made")
    assert done.status == 0, done.err
    made = pd.read_csv(tmp_path / "made" / "designed.csv")
    page = (tmp_path / "next" / "motion.html").read_text()
    assert "4 s from rest to rest, to be followed 2 times" in page and len(page) < 4e6
    reference = made["q_ref.shoulder"].to_numpy()
    np.testing.assert_allclose(reference, table["q_ref.shoulder"][: len(reference)], atol=1e-8)


@pytest.mark.slow
def test_what_cannot_be_designed_is_one_line(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    for wrong in (
        ("--tell", "backlash@elbow", "joint_spring@elbow"),
        ("--tell", "viscous_friction", "joint_spring@elbow"),
        ("--show", "joint_sprung@elbow"),
        ("--duration", "-1"),
        ("--duration", "1e9"),
        ("--limits", "nothing.toml"),
        ("--harmonics", "1"),
        ("--harmonics", "4", "--intervals", "8"),
        ("--clearance", "-1"),
        ("--clearance", "0.01"),  # of an arm without shapes
        ("--show", "joint_zero@wrist"),
        ("--joint", "wrist"),
        ("--joint", "elbow", "--show", "joint_zero@elbow"),
    ):
        done = run("design", study, *wrong, "--starts", "1", "--out", "next")
        assert done.status == 2
        assert done.err.count("\n") == 1, done.err
        assert not (tmp_path / "next").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[joints.elbow]\nlower = 1.0\nupper = 1.0\n", "lower below upper"),
        ("[[obstacles]]\ncentre = [0, 0, 0]\nradius = 9\n", "ask for a clearance"),
        (
            '[[boxes]]\njoint = "elbow"\nlower = [50, 50, 50]\nupper = [51, 51, 51]\n',
            "stays in its boxes",
        ),
        ('[[boxes]]\njoint = "elbow"\nlower = [1, 1]\nupper = [2, 2, 2]\n', "lower"),
    ],
)
def test_limits_that_no_motion_keeps_are_one_line(run, tmp_path, text, said) -> None:
    study = write_loop_study(tmp_path)
    (tmp_path / "limits.toml").write_text(text)
    done = run("design", study, "--limits", "limits.toml", "--starts", "1", "--out", "next")
    assert done.status == 2
    assert done.err.count("\n") == 1 and said in done.err, done.err
    assert not (tmp_path / "next").exists()


def test_an_obstacle_around_the_start_is_one_line(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    ball = '<collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
    for path in tmp_path.glob("*.urdf"):
        path.write_text(path.read_text().replace("</link>", ball))
    (tmp_path / "limits.toml").write_text("[[obstacles]]\ncentre = [0, 0, 0]\nsize = [9, 9, 9]\n")
    asked = ("--limits", "limits.toml", "--clearance", "0.01", "--out", "next")
    done = run("design", study, *asked)
    assert done.status == 2 and done.err.count("\n") == 1, done.err
    assert "wherever the robot stands" in done.err
    assert not (tmp_path / "next").exists()


def test_a_joint_without_range_is_one_line(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    for path in tmp_path.glob("*.urdf"):
        text = re.sub(r'lower="[^"]*"', 'lower="0.5"', path.read_text())
        path.write_text(re.sub(r'upper="[^"]*"', 'upper="0.5"', text))
    done = run("design", study, "--starts", "1", "--out", "next")
    assert done.status == 2 and done.err.count("\n") == 1, done.err
    assert not (tmp_path / "next").exists()


@pytest.mark.slow
def test_the_loop_is_closed_without_a_hand_in_between(run, tmp_path, monkeypatch) -> None:
    done = run("demo", "--design", "made", "--json")
    assert done.status == 0, done.err
    said = json.loads(done.out)
    pair = {"quadratic_drag", "stribeck_friction"}
    (step,) = said["before"]["steps"]
    assert {step["effect"], *(one["effect"] for one in step["indistinguishable"])} == pair
    (told,) = said["design"]["separations"]
    assert told["recorded"] < 3.0 < told["designed"]
    (after,) = said["after"]["steps"]
    assert after["effect"] == "quadratic_drag" and not after["indistinguishable"]
    assert said["settled"] == [
        "quadratic_drag@elbow or stribeck_friction@elbow: settled, it is quadratic_drag@elbow."
    ]
    study = tmp_path / "made" / "study.toml"
    assert study.read_text().count("[[recordings]]") == 4
    assert "drag" not in study.read_text()  # what is hidden stays hidden

    # Without the designed recording the two are open: the answer comes with it.
    before, _, after_ = study.read_text().partition('[[recordings]]\nfile = "designed.csv"')
    study.write_text(before + after_[after_.index("[controller]") :])
    # A motion as short as that of `demo`: most of the time goes into longer ones.
    small = partial(DesignTask, duration=8.0, repeat=2, harmonics=5)
    monkeypatch.setattr(experiment_design, "DesignTask", small)
    done = run("explain", study, "--propose", "never", "--design", "next", "--json")
    assert done.status == 0, done.err
    design = json.loads(done.out)["next_recording"]["design"]
    assert design["separations"][0]["designed"] > 3.0
    assert {one.rpartition("/")[2] for one in design["files"]} >= {
        "reference.csv",
        "experiment.toml",
    }
    assert len(pd.read_csv(tmp_path / "next" / "reference.csv")) > 1000


@pytest.mark.slow
def test_where_no_recording_can_settle_anything_the_answer_says_so(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    done = run("explain", study, "--propose", "never", "--design", "next")
    assert done.status == 0, done.err
    said = " ".join(done.out.split())
    assert "Nothing is left open" in said or "No recording is designed" in said
    assert not (tmp_path / "next").exists()
    (tmp_path / "taken").write_text("")
    done = run("explain", study, "--design", "taken")
    assert done.status == 2 and done.err.count("\n") == 1, done.err
