"""A law that a user writes: looked for, added, fitted, saved, simulated, as any effect."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.cli import studies
from dynident.closed_loop import load_experiment, write_experiment
from dynident.effects import LawEffect
from experiment_files import write_search

WAVE = """
[laws.wave]
torque = "c*v*sin(k*q + p)"
shape = { k = [1, 6], p = [-3.2, 3.2] }
"""
EFFECTS = f"""
[[effects]]
effect = "viscous_friction"
values = {{ Fv = 0.4 }}

[[effects]]
effect = "law:wave@elbow"
values = {{ c = 0.3 }}
shape = {{ k = 3.3, p = 1.1 }}
hidden = true
{WAVE}"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with recordings of an arm with the law, and a study that does not know of it."""
    folder = tmp_path_factory.mktemp("laws")
    runs = [("train", 1), ("train", 2), ("test", 3)]
    path = write_search(folder, EFFECTS, runs, period=6.0, harmonics=5)
    write_experiment(load_experiment(path), folder / "data")
    return folder / "data"


def test_what_is_hidden_is_not_told(simulated: Path) -> None:
    assert "law" not in (simulated / "study.toml").read_text()


@pytest.mark.slow
def test_a_law_is_proposed_and_written(
    simulated: Path, tmp_path: Path, run, sought, monkeypatch
) -> None:
    """The hidden c v sin(k q + p), as its expansion; the verdict stays."""
    study, shared = simulated / "proposed.toml", tmp_path / "lab.toml"
    study.write_text((simulated / "study.toml").read_text())
    page = tmp_path / "report.html"
    done = run("explain", study, "--json", "--laws", shared, "--report", page)
    assert done.status == 0, done.err
    answer = done.json
    assert answer["verdict"] == "unexplained"
    (found,) = answer["proposals"]
    assert found["joint"] == "elbow"
    assert found["torque"] == "v*(c1*sin(k*q) + c2*cos(k*q))"
    assert abs(found["values"]["k"] - 3.3) < 0.1
    true = {"c1": 0.3 * np.cos(1.1), "c2": 0.3 * np.sin(1.1)}
    for name, value in true.items():
        assert abs(found["values"][name] - value) < 0.03
    assert 0 < found["sigma"]["k"] < 0.05
    assert "Laws that no catalogue has" in page.read_text()
    assert f"add {study} --proposal 1" in page.read_text()
    assert found["explains"] > 0.85
    assert found["test_error_after"] < found["test_error_before"]

    (diagnosis,) = sought
    with monkeypatch.context() as known:  # which `add` would find again
        known.setattr(studies, "diagnosis_of", lambda *_, **__: diagnosis)
        done = run("add", study, "--proposal", "1", "--json")
    assert done.status == 0, done.err
    assert done.json["added"] == ["law:proposal1@elbow"]
    assert di.load(study).model.laws[0].torque == found["torque"]

    again = simulated / "again.toml"
    again.write_text(f'laws = "{shared}"\n' + (simulated / "study.toml").read_text())
    done = run("explain", again, "--json")
    assert done.json["verdict"] == "explained"
    assert [s["effect"] for s in done.json["steps"]] == ["law:proposal1"]


@pytest.mark.slow
def test_nothing_is_proposed_for_a_complete_model(
    simulated: Path, run, sought, monkeypatch
) -> None:
    study = simulated / "complete.toml"
    text = (simulated / "study.toml").read_text()
    study.write_text(text.replace("effects = [", 'effects = ["law:wave@elbow", ') + WAVE)
    done = run("explain", study, "--propose", "--json")
    assert done.json["verdict"] == "nothing_missing"
    assert done.json["proposals"] == []
    (diagnosis,) = sought
    monkeypatch.setattr(studies, "diagnosis_of", lambda *_, **__: diagnosis)
    done = run("add", study, "--proposal", "1")
    assert done.status == 2
    assert "none was made" in done.err


@pytest.mark.slow
def test_the_law_is_found_added_fitted_saved_and_loaded(simulated: Path, tmp_path: Path, run):
    study = simulated / "with_law.toml"
    study.write_text((simulated / "study.toml").read_text() + WAVE)
    page = tmp_path / "report.html"
    done = run("explain", study, "--json", "--report", page)
    assert done.status == 0, done.err
    answer = done.json
    assert answer["verdict"] == "explained"
    assert [(s["effect"], s["joint"]) for s in answer["steps"]] == [("law:wave", "elbow")]
    assert "c*v*sin(k*q + p)" in page.read_text()

    done = run("add", study, "law:wave@elbow")
    assert done.status == 0, done.err
    assert "law:wave@elbow" in di.load(study).model

    done = run("fit", study, "--out", tmp_path / "fit.json")
    assert done.status == 0, done.err
    found = di.load_estimate(tmp_path / "fit.json")
    assert isinstance(found.model.effects[-1], LawEffect)
    sigma = dict(zip(found.names, found.sigma, strict=True))
    assert abs(found.value("wave.c@elbow") - 0.3) < 4 * sigma["wave.c@elbow"]
    inside = {one.name: one for one in found.shapes}
    for name, true in (("wave.k@elbow", 3.3), ("wave.p@elbow", 1.1)):
        assert 0 < inside[name].sigma < 0.1
        assert abs(inside[name].value - true) < 4 * inside[name].sigma
    assert [one.name for one in found.shapes] == ["wave.k@elbow", "wave.p@elbow"]
    assert "wave.k@elbow" in done.out


def test_sigma_holds_that_the_shapes_are_estimated(simulated: Path) -> None:
    """With the shapes held it would be smaller."""
    study = simulated / "fitted.toml"
    text = (simulated / "study.toml").read_text()
    study.write_text(text.replace("effects = [", 'effects = ["law:wave@elbow", ') + WAVE)
    loaded = di.load(study)
    estimate = di.fit(loaded.model, loaded.train)
    held = di.LeastSquares().fit(estimate.model, loaded.train)
    own = held.names.index("wave.c@elbow")
    np.testing.assert_allclose(estimate.values, held.values)
    assert estimate.sigma[own] > held.sigma[own]


@pytest.mark.parametrize("said", ['laws = "lab.toml"', 'laws = ["lab.toml"]'])
def test_laws_of_a_file_are_in_the_model(simulated: Path, said: str) -> None:
    (simulated / "lab.toml").write_text(WAVE)
    study = simulated / "shared.toml"
    study.write_text(said + "\n" + (simulated / "study.toml").read_text())
    (law,) = di.load(study).model.laws
    assert law.label == "law:wave"


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        ("[laws]\nwave = 3", "a table is needed"),
        ("[laws.wave]\nshape = { k = [1, 2] }", "no torque"),
        ('[laws.wave]\ntorque = "c*v"\nfile = "a.toml"', "a torque and a file"),
        ('[laws.wave]\ntorque = "c*sin(v)"', "rad/s"),
        ('[laws.wave]\ntorque = "c*sin(k*q)"', "laws.wave"),
        ('[laws.wave]\ntork = "c*v"', "tork"),
        ("[laws.wave]\ntorque = 3", "laws.wave"),
        ('[laws."a b"]\ntorque = "c*v"', "no name"),
        ('[laws]\nlab = "nowhere.toml"', "nowhere.toml"),
    ],
)
def test_wrong_laws_are_one_line_and_status_2(simulated: Path, extra: str, says: str, run):
    study = simulated / "wrong.toml"
    study.write_text((simulated / "study.toml").read_text() + "\n" + extra + "\n")
    done = run("fit", study)
    assert done.status == 2
    assert says in done.err
    assert done.err.count("\n") == 1 and done.err.startswith("error: ")
