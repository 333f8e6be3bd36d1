"""`dynident fit --method NAME` for regressions: names, noise of the inputs, options that fit."""

from __future__ import annotations

import pytest

from dynident.fitting.noisy_inputs.regressors import named
from dynident.regression.names import REGRESSIONS
from loop_studies import LOOP_STUDY, write_loop_study
from study_files import edited

REPEATS = edited(('use = "train"\n', 'use = "train"\nperiod = 2.0\n'), text=LOOP_STUDY)


def test_every_name_is_a_regression_of_ours_or_of_scikit_learn() -> None:
    assert {name for name in REGRESSIONS if named(name) is None} == {"ridge", "lasso", "pls"}


@pytest.mark.parametrize("words", [("ridge",), ("bayes", "--input-noise", "repeats")])
def test_a_regression_by_name(run, tmp_path, words):
    done = run("fit", write_loop_study(tmp_path, REPEATS), "--method", *words, "--json")
    assert done.status == 0
    values = {one["name"]: one["value"] for one in done.json["parameters"]}
    assert values["Fv@shoulder"] == pytest.approx(2.0, rel=0.1)


@pytest.mark.slow
def test_what_the_data_do_not_tell(run, tmp_path):
    path = write_loop_study(tmp_path, LOOP_STUDY)
    done = run("fit", path, "--method", "factors", "--identifiability")
    assert done.status == 0
    assert "Sensitivity of b_true to the start" in done.out
    assert "What the data tell of the reliability" in done.out
    told = run("fit", path, "--method", "factors", "--identifiability", "--json").json
    assert len(told["identifiability"]["starts"]["b_true"]["Fv@shoulder"]) == 3
    assert isinstance(told["identifiability"]["profile"]["flat"], bool)


def test_options_that_do_not_fit(run, tmp_path):
    path = write_loop_study(tmp_path, LOOP_STUDY)
    for words, message in (
        (("--method", "ridge", "--input-noise", "repeats"), "--input-noise goes with"),
        (("--method", "corrected"), "needs --input-noise"),
        (("--method", "ridge", "--identifiability"), "--identifiability goes with"),
        (("--method", "bayes", "--ordinary"), "--ordinary does not go"),
        (("--method", "bayes", "--consistency", "full"), "--consistency goes with least squares"),
        (("--method", "bayes", "--instruments", "loop"), "--instruments goes with --method iv"),
        (("--method", "bayes", "--input-noise", "repeats"), "no recording repeats"),
    ):
        done = run("fit", path, *words)
        assert done.status == 2 and message in done.err, words
        assert "Traceback" not in done.err
