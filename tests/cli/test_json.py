"""The JSON contract: one object on standard output, every key with its type, nothing beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dynident.effects import catalogue
from dynident.fitting import load_estimate
from dynident.robot import Robot
from study_files import CONTROLLER, STUDY, edited, listing
from synthetic import ARM, arm

REPEATED = STUDY
GIVEN = edited(("period = 8.0\n", "")) + "[noise]\nposition_std = 1e-5\ntorque_std = [0.05, 0.05]\n"
UNKNOWN = edited(("period = 8.0\n", ""))
NOTHING_MISSING = edited(('["viscous_friction"]', '["viscous_friction", "coulomb_friction@elbow"]'))
JOINTS = {"shoulder", "elbow"}
VERDICTS = {"nothing_missing", "explained", "unexplained"}


def number(value: Any, low: float = -np.inf, high: float = np.inf) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def is_place(said: dict[str, Any]) -> bool:
    """Whether effect, joint and source are those of an effect of the catalogue."""
    effect = catalogue()[said["effect"]]
    joint, source = said["joint"], said["source"]
    wanted = {"robot": 0, "joint": 1, "pair": 2, "joint or robot": int(joint is not None)}[
        effect.place
    ]
    assert (joint in JOINTS) if wanted else joint is None
    assert (source in JOINTS - {joint}) if wanted == 2 else source is None
    return True


def check_diagnosis(said: dict[str, Any], source: str) -> None:
    assert set(said) == {
        *("verdict", "noise", "joints", "steps", "candidates", "test_error", "notes"),
        "proposals",
        "wiring",
        "withdrawn",
        "rows",
        *(("detection_limits",) if said["verdict"] == "nothing_missing" else ()),
        *(("residual_dependence",) if said["verdict"] == "unexplained" else ()),
    }
    assert said["wiring"] == []
    assert said["verdict"] in VERDICTS
    assert said["noise"] == {"source": source}
    assert [joint["name"] for joint in said["joints"]] == ["shoulder", "elbow"]
    for joint in said["joints"]:
        torques = {"noise_rms", "torque_rms", "torque_unit"}
        assert set(joint) == {"name", "error_before", "error_after", *torques}
        assert joint["torque_unit"] == "N m" and number(joint["torque_rms"], 0)
        assert number(joint["error_before"], 0) and number(joint["error_after"], 0)
        known = joint["noise_rms"] is None if source == "unknown" else number(joint["noise_rms"], 0)
        assert known
    for step in said["steps"]:
        assert set(step) == {
            *("effect", "joint", "source", "test_error_before", "test_error_after"),
            "indistinguishable",
            "fall_standard_error",
            "at_joint",
        }
        there = step["at_joint"]
        assert set(there) == {"joint", "before", "after", "standard_error"}
        assert there["joint"] in ("shoulder", "elbow")
        assert 0.0 <= there["after"] < there["before"]
        assert is_place(step) and number(step["fall_standard_error"], 0)
        assert number(step["test_error_before"], 0) and number(step["test_error_after"], 0)
        for other in step["indistinguishable"]:
            assert set(other) == {"effect", "joint", "source"} and is_place(other)
    assert said["candidates"]
    # What was not tried has no gain: zero would be a finding.
    tried = [one["test_gain"] for one in said["candidates"] if one["test_gain"] is not None]
    assert tried and 0.0 not in tried and len(tried) < len(said["candidates"])
    for candidate in said["candidates"]:
        assert set(candidate) == {"effect", "joint", "source", "status", "p_value", "test_gain"}
        assert is_place(candidate)
        assert candidate["status"] in {"material", "not_material", "absorbed"}
        assert (candidate["p_value"] is None) == (candidate["status"] == "absorbed")
        assert candidate["p_value"] is None or number(candidate["p_value"], 0, 1)
        assert candidate["test_gain"] is None or number(candidate["test_gain"], -1, 1)
    errors = said["test_error"]
    assert set(errors) == {"before", "after", "noise_floor"}
    assert number(errors["before"], 0) and number(errors["after"], 0)
    floor = errors["noise_floor"]
    assert floor is None if source == "unknown" else number(floor, 0)
    assert all(isinstance(note, str) for note in said["notes"])
    if said["steps"]:
        assert said["steps"][0]["test_error_before"] == errors["before"]
        assert said["steps"][-1]["test_error_after"] == errors["after"]


@pytest.mark.parametrize(
    ("command", "text", "source"),
    [
        ("explain", REPEATED, "replicates"),
        ("explain", GIVEN, "given"),
        ("explain", UNKNOWN, "unknown"),
        pytest.param("diagnose", REPEATED, "replicates", marks=pytest.mark.slow),
    ],
)
def test_diagnosis(run, study, tmp_path, command, text, source):
    path = study(text)
    before = listing(tmp_path)
    done = run(command, path, "--json")
    assert done.status == 0 and done.err == ""
    said = done.json
    check_diagnosis(said, source)
    assert said["verdict"] == "explained"
    # Dry friction by any of its names; the hidden one itself is named.
    first = said["steps"][0]
    named = [(one["effect"], one["joint"]) for one in (first, *first["indistinguishable"])]
    assert ("coulomb_friction", "elbow") in named
    assert said["test_error"]["after"] < 0.5 * said["test_error"]["before"]
    assert listing(tmp_path) == before


@pytest.mark.slow
def test_nothing_missing(run, study):
    said = run("explain", study(NOTHING_MISSING), "--json").json
    check_diagnosis(said, "replicates")
    assert said["verdict"] == "nothing_missing" and said["steps"] == []
    assert said["detection_limits"]
    for one in said["detection_limits"]:
        assert set(one) == {"effect", "joint", "source", "at", "torque_rms"} and is_place(one)
        assert one["at"] in JOINTS and number(one["torque_rms"], 0)
    assert said["test_error"]["after"] <= 1.15 * said["test_error"]["noise_floor"]


@pytest.mark.slow
def test_a_search_that_was_stopped_says_its_limit(run, study):
    said = run("explain", study(), "--most", "0", "--json").json
    assert (said["verdict"], said["limit"], said["steps"]) == ("unexplained", 0, [])
    said = run("explain", study(), "--most", "1", "--json").json
    assert said["verdict"] == "explained" and "limit" not in said


@pytest.mark.slow
def test_without_test_recordings(run, study):
    text = STUDY[: STUDY.rindex("[[recordings]]")]
    said = run("diagnose", study(text), "--json").json
    check_diagnosis(said, "replicates")
    assert any("No test recordings" in note for note in said["notes"])


def test_fit(run, study, tmp_path):
    path = study(NOTHING_MISSING)
    done = run("fit", path, "--json", "--essential", "--out", "fit.json", "--robot", "new.urdf")
    assert done.status == 0
    assert all(line.startswith("warning: new.urdf: no rigid") for line in done.err.splitlines())
    said = done.json
    names = {parameter["name"]: parameter for parameter in said["parameters"]}
    assert len(names) == len(said["parameters"]) == 9
    for parameter in said["parameters"]:
        keys = {"name", "value", "sigma", "unit", "expression", "identified", "stands_for"}
        assert set(parameter) == keys
        assert number(parameter["identified"])
        assert number(parameter["value"]) and number(parameter["sigma"], 0)
    assert names["Fc@elbow"]["unit"] == "N m"
    assert abs(names["Fc@elbow"]["value"] - 1.5) < 0.05
    assert set(said["essential"]) <= set(names)
    assert np.shape(said["covariance"]) == (9, 9)
    assert len(said["torque_std"]) == len(said["joint_errors"]) == 2
    assert number(said["error"], 0, 1) and number(said["condition_number"], 1)
    assert isinstance(said["rows"], int) and said["status"] == "solved"
    assert [len(source["sha256"]) for source in said["recordings"]] == [64]

    saved = load_estimate(tmp_path / "fit.json")
    assert saved.value("Fc@elbow") == names["Fc@elbow"]["value"]
    motion = arm().random_motion(0, 50)
    again = Robot.from_file(tmp_path / "new.urdf").inverse_dynamics(*motion)
    np.testing.assert_allclose(again, saved.robot.inverse_dynamics(*motion), rtol=1e-9, atol=1e-9)
    # Identified from data of the true arm, so that it moves like the true arm.
    truth = arm().inverse_dynamics(*motion)
    assert np.linalg.norm(again - truth) < 0.05 * np.linalg.norm(truth)


def test_a_fit_says_what_the_description_that_it_writes_lacks(run, study) -> None:
    done = run("fit", study(NOTHING_MISSING), "--robot", "new.urdf")
    assert done.status == 0
    assert "new.urdf has the rigid bodies alone: friction" in " ".join(done.out.split())
    assert "rigid bodies alone" not in run("fit", study(NOTHING_MISSING)).out


def test_compare(run, study, tmp_path):
    path = study()
    before = listing(tmp_path)
    addition = "coulomb_friction@elbow"
    done = run("compare", path, "--json", "--with", addition, "--with", "joint_spring")
    assert done.status == 0 and done.err == ""
    said = done.json
    assert set(said) == {"noise", "models", "joints", "wiring"}
    assert number(said["noise"]["floor"], 0)
    assert [m["name"] for m in said["models"]] == ["study", f"+ {addition}", "+ joint_spring"]
    viscous = ["viscous_friction@shoulder", "viscous_friction@elbow"]
    springs = ["joint_spring@shoulder", "joint_spring@elbow"]
    effects = [model["effects"] for model in said["models"]]
    assert effects == [viscous, [*viscous, addition], viscous + springs]
    for model in said["models"]:
        assert set(model) == {"name", "effects", "error", "joints"}
        assert number(model["error"], 0)
        assert [set(joint) for joint in model["joints"]] == [{"name", "error"}] * 2
        assert all(number(joint["error"], 0) for joint in model["joints"])
    for joint in said["joints"]:
        assert set(joint) == {"name", "noise_rms", "torque_rms", "torque_unit"}
        assert number(joint["noise_rms"], 0) and number(joint["torque_rms"], 0)
    study_error, with_friction, with_spring = (m["error"] for m in said["models"])
    assert with_friction < 0.1 * study_error < with_spring
    assert listing(tmp_path) == before


def test_compare_where_the_noise_is_unknown(run, study):
    said = run("compare", study(UNKNOWN), "--json").json
    assert said["noise"] == {"floor": None}
    assert [joint["noise_rms"] for joint in said["joints"]] == [None, None]


@pytest.mark.slow
def test_report(run, study, tmp_path):
    path = study()
    done = run("report", path, "--json", "--to", "page.html")
    assert done.status == 0 and done.err == "report: page.html\n"
    said = done.json
    assert said.pop("report") == "page.html"
    check_diagnosis(said, "replicates")
    page = (tmp_path / "page.html").read_text()
    assert page.lstrip().lower().startswith("<!doctype html") and "coulomb" in page.lower()
    assert set(listing(tmp_path)) == {
        *("arm.urdf", "page.html", "study.toml", "test.csv", "train.csv"),
    }


GAINS = (("[3000.0, 1500.0]", "[300.0, 100.0]"), ("[120.0, 50.0]", "[40.0, 5.0]"))
EXPERIMENT = (
    'robot = "arm.urdf"\nlead_in = 0.2\n'
    '[[effects]]\neffect = "viscous_friction"\nvalues = { Fv = 1.0 }\n'
    '[[effects]]\neffect = "coulomb_friction@elbow"\nvalues = { Fc = 1.5 }\nhidden = true\n'
    + edited(("1000.0", "250.0"), *GAINS, text=CONTROLLER)
    + '[[recordings]]\nfile = "run.csv"\nduration = 4.0\nperiod = 2.0\n'
)


def test_simulate(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "experiment.toml").write_text(EXPERIMENT)
    done = run("simulate", "experiment.toml", "--out", "made/here", "--json")
    assert done.status == 0 and done.err == ""
    written = done.json["written"]
    assert written == [f"made/here/{name}" for name in ("run.csv", "arm.urdf", "study.toml")]
    study = (tmp_path / "made/here/study.toml").read_text()
    assert "viscous_friction" in study and "coulomb" not in study
    found = run("compare", "made/here/study.toml", "--json").json["models"][0]
    assert 0.01 < found["error"] < 0.9  # the hidden friction


def test_what_cannot_be_simulated_is_refused(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    text = edited(("rate_hz = 250.0", ""), text=EXPERIMENT)
    (tmp_path / "experiment.toml").write_text(text)
    done = run("simulate", "experiment.toml", "--out", "made")
    assert done.status == 2 and done.out == ""
    assert done.err.startswith("error: experiment.toml: controller.rate_hz: the controller's rate")
    assert not (tmp_path / "made").exists()


def test_simulate_into_a_file(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "experiment.toml").write_text(EXPERIMENT)
    before = listing(tmp_path)
    for place in ("arm.urdf", "arm.urdf/below"):
        done = run("simulate", "experiment.toml", "--out", place)
        assert done.status == 2 and done.out == ""
        assert "arm.urdf: is a file, not a folder. name another folder" in done.err
        assert done.err.count("\n") == 1 and listing(tmp_path) == before
