"""`dynident fit --method iv`: instruments by name, iterations in the output, options that fit."""

from __future__ import annotations

import pytest

from loop_studies import LOOP_STUDY, write_loop_study
from study_files import edited

PERIODS = edited(('use = "train"\n', 'use = "train"\nperiod = 2.0\n'), text=LOOP_STUDY)


@pytest.mark.slow
def test_iterations_and_picture(run, tmp_path):
    path = write_loop_study(tmp_path)
    words = ("--method", "iv", "--start", "description", "--plot", "iv.png")
    done = run("fit", path, *words, "--out", "iv.json")
    assert done.status == 0 and "picture: iv.png" in done.err
    assert "Iterations" in done.out and "Start: " in done.out
    assert (tmp_path / "iv.png").read_bytes().startswith(b"\x89PNG")
    again = run("simulate", path, "--estimate", "iv.json", "--json")
    named = run("simulate", path, "--method", "iv", "--start", "description", "--json")
    assert again.status == 0 and again.json["error"] == pytest.approx(named.json["error"])
    assert again.json["error"]["torque"] < 0.01


@pytest.mark.parametrize(
    "words", [("periods",), ("filtered", "--cutoff", "10")], ids=["periods", "filtered"]
)
def test_instruments_without_a_loop(run, tmp_path, words):
    text = PERIODS[: PERIODS.index("[controller]")]
    path = write_loop_study(tmp_path, text, reference=False)
    done = run("fit", path, "--method", "iv", "--instruments", *words, "--json")
    assert done.status == 0
    values = {one["name"]: one["value"] for one in done.json["parameters"]}
    assert values["Fv@shoulder"] == pytest.approx(2.0, rel=0.02)


def test_options_that_do_not_fit(run, tmp_path):
    path = write_loop_study(tmp_path, LOOP_STUDY[: LOOP_STUDY.index("[controller]")])
    for words, message in (
        (("--instruments", "loop"), "--instruments goes with --method iv"),
        (("--start", "regular"), "--start goes with --method iv"),
        (("--plot", "iv.png"), "--plot goes with --method iv"),
        (("--method", "iv", "--instruments", "filtered"), "--cutoff HZ go together"),
        (("--method", "iv", "--cutoff", "3"), "--cutoff HZ go together"),
        (
            ("--method", "iv", "--instruments", "periods", "--start", "regular"),
            "--start has no part in --instruments periods",
        ),
        (("--method", "iv", "--consistency", "full"), "--consistency goes with least squares"),
        (("--method", "iv"), "has no [controller]"),
        (("--method", "iv", "--instruments", "periods"), "no recording repeats"),
    ):
        done = run("fit", path, *words)
        assert done.status == 2 and message in done.err and done.err.count("\n") == 1, done
        assert done.out == ""


def test_what_the_loop_lacks_is_named_in_the_words_of_the_shell(run, tmp_path):
    path = write_loop_study(tmp_path, edited(("rate_hz = 250.0\n", ""), text=LOOP_STUDY))
    done = run("fit", path, "--method", "iv")
    assert done.status == 2 and "study.toml: controller.rate_hz: " in done.err
    done = run("fit", write_loop_study(tmp_path, reference=False), "--method", "iv")
    assert done.status == 2 and done.err.count("\n") == 1
    assert "q_ref.shoulder" in done.err and "--instruments periods" in done.err
