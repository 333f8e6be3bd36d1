"""The command that says what has changed between two estimates."""

from __future__ import annotations

import json

import pytest

from dynident import fit
from dynident.model import Model
from dynident.recording import Dataset
from study_files import edited, recording, write_study
from synthetic import arm


@pytest.fixture(scope="module")
def estimates(tmp_path_factory):
    folder = tmp_path_factory.mktemp("estimates")
    for name, seed in (("old", 1), ("new", 2)):
        model = Model(arm()) + "viscous_friction" + "coulomb_friction"
        fit(model, Dataset((recording(seed),))).save(folder / f"{name}.json")
    fit(Model(arm()) + "viscous_friction", Dataset((recording(3),))).save(folder / "other.json")
    return folder


@pytest.mark.slow
def test_the_answer_is_json_and_a_page(run, estimates):
    page = estimates / "changes.html"
    old, new = estimates / "old.json", estimates / "new.json"
    done = run("changes", str(old), str(new), "--to", str(page), "--json")
    assert done.status == 0
    found = json.loads(done.out)
    assert {one["parameter"] for one in found["parameters"]} >= {"Fc@elbow", "Fv@shoulder"}
    assert 0.0 <= found["chi_square"]["p_value"] <= 1.0
    text = page.read_text(encoding="utf-8")
    assert "What has changed at arm" in text and len(text) < 3e6
    for name in ("Fc@elbow", "Fv@shoulder", "then and now".capitalize()):
        assert name in text


@pytest.mark.slow
def test_effects_that_one_of_them_has_alone_are_listed(run, estimates):
    page = estimates / "gone.html"
    files = [str(estimates / name) for name in ("old.json", "other.json")]
    done = run("changes", *files, "--to", str(page), "--json")
    assert done.status == 0
    found = json.loads(done.out)
    assert {one["parameter"] for one in found["only_before"]} == {"Fc@elbow", "Fc@shoulder"}
    assert found["only_after"] == []
    assert not {one["parameter"] for one in found["parameters"]} & {"Fc@elbow", "Fc@shoulder"}
    text = page.read_text(encoding="utf-8")
    assert "Effects that one of them has alone" in text and "The models differ by" in text


def test_recordings_that_an_estimate_was_fitted_to_do_not_judge_it(run, estimates, tmp_path):
    study = write_study(tmp_path)
    old, new = tmp_path / "old.json", tmp_path / "new.json"
    assert run("fit", str(study), "--out", str(old)).status == 0
    exchanged = [(f"{use}.csv", f"{use}_") for use in ("train", "test")]
    text = edited(*exchanged, text=study.read_text())
    other = tmp_path / "other.toml"
    other.write_text(edited(("train_", "test.csv"), ("test_", "train.csv"), text=text))
    assert run("fit", str(other), "--out", str(new)).status == 0
    done = run("changes", str(old), str(new), "--study", str(study))
    assert done.status == 2 and done.out == "" and done.err.count("\n") == 1
    assert "test.csv, a test recording" in done.err and "neither estimate has seen" in done.err
