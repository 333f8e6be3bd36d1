"""`dynident simulate STUDY`: the recorded loop once more; and how a study is told from the rest."""

from __future__ import annotations

import json
import re

import pytest

from loop_studies import LOOP_STUDY as STUDY
from loop_studies import write_loop_study
from study_files import edited, listing

CONTROLLER = STUDY[STUDY.index("[controller]") :]
TEST_ENTRY = STUDY[STUDY.rindex("[[recordings]]") : STUDY.index("[controller]")]
ERRORS = {"position", "velocity", "acceleration", "torque"}


def test_four_errors_and_nothing_written(run, tmp_path):
    path = write_loop_study(tmp_path)
    before = listing(tmp_path)
    done = run("simulate", path, "--json")
    assert done.status == 0 and done.err == ""
    said = done.json
    assert said["recordings_used"] == "test" and said["verdict"] == "follows"
    assert [one["name"] for one in said["recordings"]] == ["test.csv"]
    assert set(said["error"]) == ERRORS
    assert [joint["name"] for joint in said["joints"]] == ["shoulder", "elbow"]
    for joint in said["joints"]:
        assert set(joint["error"]) == ERRORS
        assert all(0 <= x < 5e-3 for x in joint["error"].values())
    assert listing(tmp_path) == before


def test_the_loop_is_judged_by_the_criteria_of_the_study(run, tmp_path):
    """With two periods in the record its noise is measured, unless nothing counts as repeated."""
    said = []
    for criteria in ("", "\n[criteria.loops]\nrepeats = 1e-9\n"):
        text = STUDY.replace('"test.csv"\n', '"test.csv"\nperiod = 2.0\n') + criteria
        done = run("simulate", write_loop_study(tmp_path, text))
        assert done.status == 0
        said.append("nothing repeats" in done.out)
    assert said == [False, True]


@pytest.mark.slow
def test_report_and_picture(run, tmp_path):
    path = write_loop_study(tmp_path)
    done = run("simulate", path, "--report", "loop.html", "--plot", "loop.png")
    assert done.status == 0 and done.err == "report: loop.html\npicture: loop.png\n"
    page = (tmp_path / "loop.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and "Simulated in closed loop" in page
    assert (tmp_path / "loop.png").read_bytes().startswith(b"\x89PNG")


def test_a_saved_estimate_and_a_named_recording(run, tmp_path):
    path = write_loop_study(tmp_path)
    assert run("fit", path, "--out", "fit.json").status == 0
    done = run("simulate", path, "--estimate", "fit.json", "--recording", "train.csv", "--json")
    assert done.status == 0
    assert done.json["recordings_used"] == "named"
    assert [one["name"] for one in done.json["recordings"]] == ["train.csv"]
    heavy = json.loads((tmp_path / "fit.json").read_text())
    for parameter in heavy["parameters"]:
        parameter["value"] *= 1.3
    (tmp_path / "heavy.json").write_text(json.dumps(heavy))
    worse = run("simulate", path, "--estimate", "heavy.json", "--recording", "train.csv", "--json")
    assert worse.json["error"]["torque"] > 10 * done.json["error"]["torque"]


def test_without_test_recordings_the_training_ones_are_simulated(run, tmp_path):
    done = run("simulate", write_loop_study(tmp_path, edited((TEST_ENTRY, ""), text=STUDY)))
    assert done.status == 0 and "these are the training recordings" in done.out
    for word in ("shoulder", "elbow", "position", "acceleration", "PD controller at 250 Hz"):
        assert word in done.out


def test_a_loop_that_cannot_be_simulated_is_status_1(run, tmp_path):
    path = write_loop_study(tmp_path, edited(("[400.0, 120.0]", "[40000.0, 20000.0]"), text=STUDY))
    done = run("simulate", path, "--json")
    assert done.status == 1
    said = done.json
    assert said["verdict"] == "not_simulated" and said["error"] is None
    assert said["recordings"][0]["status"] == "failed" and said["recordings"][0]["reason"]
    done = run("simulate", path, "--plot", "loop.png")
    assert "no picture loop.png: no loop could be simulated" in done.err
    assert not (tmp_path / "loop.png").exists()
    # The other judge is not moved by that.
    done = run("compare", path)
    assert done.status == 0 and "In loop: not simulated." in " ".join(done.out.split())


def test_a_controller_that_did_not_run_is_status_1(run, tmp_path):
    path = write_loop_study(tmp_path, edited(("[400.0, 120.0]", "[150.0, 40.0]"), text=STUDY))
    done = run("simulate", path, "--json")
    assert done.status == 1 and done.json["verdict"] == "other_controller"
    assert "Exit status 1" in run("simulate", "--help").out


REFUSED = {
    "no controller": (edited((CONTROLLER, ""), text=STUDY), r"has no \[controller\]"),
    "no rate": (
        edited(("rate_hz = 250.0\n", ""), text=STUDY),
        r"controller.rate_hz: .*not stated",
    ),
    "both": (
        edited(('use = "test"', 'use = "test"\nduration = 3.0\nwindow = [0.0, 1.0]'), text=STUDY),
        r"is no study \(duration\) and no experiment \(window\)",
    ),
    "not TOML": ("robot = [", "is not TOML"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_study_lacks_is_named(run, tmp_path, case):
    text, message = REFUSED[case]
    done = run("simulate", write_loop_study(tmp_path, text))
    assert done.status == 2 and done.out == ""
    assert re.fullmatch(rf"error: \S*study.toml: {message}.*\n", done.err)


def test_the_missing_column_is_named(run, tmp_path):
    done = run("simulate", write_loop_study(tmp_path, reference=False))
    assert done.status == 2 and "q_ref.<joint>" in done.err and done.err.count("\n") == 1


def test_options_that_do_not_fit(run, tmp_path):
    path = write_loop_study(tmp_path)
    for words, message in (
        (("--out", "here"), "--out is for an experiment"),
        (("--plot", "loop.gif"), "loop.gif: is no kind of picture"),
        (("--report", "study.toml"), "is the study itself"),
        (("--recording", "run9.csv"), "no recording 'run9.csv'. recordings: train.csv, test.csv"),
        (("--estimate", "none.json"), "none.json: no such file"),
    ):
        done = run("simulate", path, *words)
        assert done.status == 2 and message in done.err and done.err.count("\n") == 1
    (tmp_path / "experiment.toml").write_text('robot = "arm.urdf"\nseed = 3\n')
    done = run("simulate", "experiment.toml")
    assert done.status == 2 and "name a folder with --out" in done.err
    done = run("simulate", "experiment.toml", "--out", "x", "--plot", "loop.png")
    assert done.status == 2 and "--plot is for a study" in done.err


@pytest.mark.slow
def test_compare_and_report_have_the_loop(run, tmp_path):
    path = write_loop_study(tmp_path)
    model = run("compare", path, "--json").json["models"][0]
    assert model["closed_loop"]["verdict"] == "follows"
    assert set(model["closed_loop"]["error"]) == ERRORS
    assert run("report", path, "--to", "page.html").status == 0
    assert "Simulated in closed loop" in (tmp_path / "page.html").read_text()
