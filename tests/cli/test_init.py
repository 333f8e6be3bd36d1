"""`dynident init` drafts a study that `explain` takes as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from study_files import listing

DEMO = Path(__file__).parents[2] / "problems" / "hidden_effect"
FILES = sorted(DEMO.glob("t*.csv"))


@pytest.mark.slow
def test_the_drafted_demo_is_explained_as_the_one_by_hand(run, tmp_path):
    done = run("init", DEMO / "arm.urdf", *FILES, "--out", "drafted.toml", "--json")
    assert done.status == 0 and done.err == ""
    said = {one["subject"]: one["chosen"] for one in done.json["decisions"]}
    assert said["torque"] == "held_command" and said["period"] == "8 s"
    drafted = run("explain", "drafted.toml", "--json").json
    # As README.md prints it of the study by hand.
    assert [(step["effect"], step["joint"]) for step in drafted["steps"]] == [
        ("stribeck_friction", "elbow")
    ]


def test_it_says_what_it_decided_and_what_to_type_next(run, study, tmp_path):
    study()
    done = run("init", "arm.urdf", "train.csv", "test.csv", "--out", "mine.toml")
    assert done.status == 0 and done.err == ""
    assert "by the joints' names" in done.out and "dynident explain mine.toml" in done.out
    text = (tmp_path / "mine.toml").read_text()
    assert text.startswith("# A study of dynident") and 'robot = "arm.urdf"' in text
    assert run("compare", "mine.toml", "--json").status == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("arm.urdf",), "DATA"),
        (("arm.urdf", "nothing.csv"), "no such data file"),
        (("nothing.urdf", "train.csv"), "no such file"),
        (("arm.urdf", "arm.urdf"), "names no format"),
        (("train.csv", "train.csv"), "not well-formed XML"),
        (("arm.urdf", "train.csv", "--gears", "a,b"), "no number"),
        (("arm.urdf", "train.csv", "--gears", "1,2,3"), "one number for each"),
        (
            ("arm.urdf", "train.csv", "--column", "q.j1=q1", "--column", "q.j1 = q2"),
            "q.j1 is stated twice",
        ),
        (("arm.urdf", "train.csv", "--column", "q.elbow"), "is not as in"),
        (("arm.urdf", "train.csv", "--column", "q.wrist = t"), "is no column of this robot"),
        (("arm.urdf", "train.csv", "--column", "q.elbow = m6/32"), "is no column of the files"),
        (("arm.urdf", "train.csv", "--joints", "sholder"), "sholder"),
        (("arm.urdf", "train.csv", "--out", "study.toml"), "is there already"),
        (("arm.urdf", "train.csv", "--out", "no/such/study.toml"), "no such folder"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(run, study, tmp_path, arguments, words):
    study()
    before = listing(tmp_path)
    out = () if "--out" in arguments else ("--out", "mine.toml")
    done = run("init", *arguments, *out)
    assert done.status == 2 and done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1 and words in done.err
    assert listing(tmp_path) == before
