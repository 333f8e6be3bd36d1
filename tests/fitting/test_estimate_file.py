"""The file of an estimate: what is written is read back, and what is damaged is refused."""

from __future__ import annotations

import copy
import json
import re

import numpy as np
import pytest

import dynident as di
from dynident.errors import FileError, FitError
from dynident.fitting import Estimate, load_estimate
from dynident.model import Model
from dynident.recording import Dataset
from hostile.estimates import MUTATIONS, changed, estimate_of_arm
from synthetic import arm, synthetic, true_values

HUGE = 10**400


@pytest.fixture(scope="module")
def good() -> dict:
    return estimate_of_arm().to_dict()


def refused(tmp_path, text: str) -> str:
    path = tmp_path / "damaged.json"
    path.write_text(text)
    with pytest.raises(FitError) as caught:
        load_estimate(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ") and "\n" not in said and len(said) - len(str(path)) < 300
    assert "save one with Estimate.save" in said
    return said.removeprefix(str(path))


@pytest.mark.parametrize("kind", MUTATIONS)
def test_damage_is_refused_with_its_place(good, tmp_path, kind):
    key, value = MUTATIONS[kind]
    said = refused(tmp_path, json.dumps(changed(good, key, value)))
    # The key or its table; without its effects a model has fewer parameters than are listed.
    place = re.search(r"estimate \(([\w.]+)", said)
    tables = {key.split(".")[0], *(("parameters",) if key == "model.effects" else ())}
    assert place and place.group(1).split(".")[0] in tables, said


def keys(content, path=""):
    """Every key, and the first of each list."""
    items = content.items() if isinstance(content, dict) else enumerate(content[:1])
    for key, value in items:
        yield f"{path}{key}"
        if isinstance(value, dict | list):
            yield from keys(value, f"{path}{key}.")


ANYTHING = (None, "x", 1e308, float("nan"), HUGE, [], {}, -1, True, [1, 2], "\ud800", 10**6)


@pytest.mark.slow
def test_whatever_is_read_can_be_worked_with(good, tmp_path):
    """Every key takes every wrong value: refused in one line, or read and computed with."""
    path = tmp_path / "odd.json"
    found = [key for key in keys(good) if not key.startswith("certificate.")]
    assert len(found) > 40
    for key in found:
        for value in ANYTHING:
            path.write_text(json.dumps(changed(good, key, value)))
            try:
                loaded = load_estimate(path)
            except FitError as error:
                assert "\n" not in str(error)
                continue
            assert isinstance(loaded, Estimate)
            assert np.all(np.isfinite(loaded.values)) and np.all(np.isfinite(loaded.covariance))
            loaded.summary()
            loaded.to_dict()


def test_a_file_that_is_no_json(tmp_path):
    for text, words in (
        ("", "is empty"),
        (" \n", "is empty"),
        ("junk", "not JSON"),
        ("[" * 100_000, "nested too deeply"),
        ('{"rows": ' + "1" * 5000 + "}", "not JSON"),
        ("[1]", "content: "),
        ("{}", "format: is missing"),
    ):
        assert words in refused(tmp_path, text)


def test_cut_anywhere(good, tmp_path):
    text = json.dumps(good)
    for end in range(1, len(text), len(text) // 20):
        refused(tmp_path, text[:end])


def test_a_broken_model_is_told_as_the_model(good, tmp_path):
    text = good["model"]["robot"]
    for robot, words in (
        ("", "model: "),
        ("<robot", "XML"),
        (text.replace("elbow", "elbo"), "elbow"),
    ):
        assert words in refused(tmp_path, json.dumps(changed(good, "model.robot", robot)))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (float("nan"), "should be a finite number"),
        (float("inf"), "should be a finite number"),
        (1e200, "should be less than 1e+30"),
        (-1e200, "should be greater than -1e+30"),
    ],
)
def test_a_number_that_is_none_is_called_so(good, tmp_path, value, words):
    said = refused(tmp_path, json.dumps(changed(good, "parameters.0.value", value)))
    assert "(parameters.0.value: " in said and words in said


def test_unknown_errors_are_no_damage(tmp_path):
    """What was given and not fitted has no residual: NaN, in the file too (or null)."""
    content = estimate_of_arm().to_dict()
    for value in (None, float("nan")):
        for key in ("error", "condition_number", "torque_std.0", "joint_errors.1"):
            content = changed(content, key, value)
        path = tmp_path / "given.json"
        path.write_text(json.dumps(content))
        loaded = load_estimate(path)
        assert np.isnan(loaded.error) and np.isnan(loaded.torque_std[0])
        np.testing.assert_array_equal(loaded.values, estimate_of_arm().values)


def test_links_survive(tmp_path):
    found = di.project(arm()).estimate
    loaded = load_estimate(found.save(tmp_path / "links.json"))
    assert found.links and loaded.links and list(found.links) == list(loaded.links)
    for name, phi in found.links.items():
        np.testing.assert_array_equal(loaded.links[name], phi)
    content = found.to_dict()
    for key, value in (("links.upper", [1.0] * 9), ("links.leg", [1.0] * 10)):
        assert f"({key}: " in refused(tmp_path, json.dumps(changed(content, key, value)))
    for value in (HUGE, 1e30, float("inf"), "1"):
        broken = copy.deepcopy(content)
        broken["links"]["upper"][3] = value
        assert "(links.upper.3: " in refused(tmp_path, json.dumps(broken))


def test_no_such_file(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        load_estimate(tmp_path / "none.json")


def test_a_value_and_its_sigma_are_of_the_same_combination() -> None:
    """The rotor of the shoulder cannot be told from the inertia of the arm: their sum is known."""
    model = Model(arm()) + "rotor_inertia@shoulder"
    truth = true_values(model, Ia__shoulder=0.3)
    data = Dataset((synthetic(model, truth, 1, torque_std=0.02),))
    rows = {one["name"]: one for one in di.fit(model, data).to_dict()["parameters"]}
    inertia, rotor = rows["Izz.upper"], rows["Ia@shoulder"]
    both = truth[model.names.index("Izz.upper")] + 0.3
    assert inertia["identified"] == pytest.approx(inertia["value"] + rotor["value"], rel=1e-9)
    assert abs(inertia["identified"] - both) < 4.0 * inertia["sigma"] < 0.01 * both
    assert "Ia@shoulder" in inertia["stands_for"]
    assert rotor["sigma"] is None and rotor["identified"] is None
    assert rotor["stands_for"] == "not identified on its own, only in combinations"
    for name in ("my.upper", "mx.fore", "my.fore"):  # each is a column of its own
        assert rows[name]["identified"] == rows[name]["value"] and rows[name]["stands_for"] == ""
