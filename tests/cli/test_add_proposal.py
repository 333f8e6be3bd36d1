"""`dynident add STUDY --proposal K` writes what `explain` has proposed, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

import dynident as di
from dynident.recording import write
from laws_hidden import recordings
from study_files import STUDY
from synthetic import ARM

LAW = "c*q*load"
KNOWN = 'effects = ["viscous_friction", "coulomb_friction"]'

MORE = """
[[recordings]]
file = "more.csv"
use = "train"
period = 8.0
"""


@pytest.fixture
def misleading(tmp_path: Path) -> Path:
    """A study of an arm whose hidden law resembles a spring, which the catalogue has."""
    (tmp_path / "arm.urdf").write_text(ARM)
    made = recordings({LAW: 0.2})
    for one, name in zip(made, ("train.csv", "more.csv", "test.csv"), strict=True):
        write(one, tmp_path / name)
    path = tmp_path / "study.toml"
    path.write_text(STUDY.replace('effects = ["viscous_friction"]', KNOWN) + MORE)
    return path


@pytest.mark.slow
def test_the_law_is_written_and_not_what_it_is_proposed_instead_of(misleading, run, sought) -> None:
    """By a name that no law of a file has."""
    misleading.with_name("lab.toml").write_text('[laws.proposal1]\ntorque = "c*v^2*q"\n')
    misleading.write_text(misleading.read_text() + '\n[laws]\nlab = "lab.toml"\n')
    done = run("add", misleading, "--proposal", "1", "--json")
    assert done.status == 0, done.err
    assert done.json["added"] == ["law:proposal2@elbow"]
    assert sought[0].proposals[0].instead_of
    before, after = (one["error"] for one in done.json["models"])
    assert after < 0.4 * before
    model = di.load(misleading).model
    assert {one.name: one.torque for one in model.laws} == {
        "proposal1": "c*v^2*q",
        "proposal2": LAW,
    }
    assert {one.name for one in model.effects} == {
        "viscous_friction",
        "coulomb_friction",
        "law:proposal2",
    }


@pytest.mark.slow
def test_it_is_sought_as_explain_was_told_to(misleading, run) -> None:
    """With --most 0 nothing is added, and nothing proposed."""
    text = misleading.read_text()
    done = run("add", misleading, "--proposal", "1", "--most", "0")
    assert done.status == 2 and "none was made" in done.err
    assert misleading.read_text() == text


def test_effects_that_are_named_are_not_sought(misleading, run) -> None:
    done = run("add", misleading, "joint_spring@elbow", "--most", "2")
    assert done.status == 2 and "--most is of --proposal" in done.err


def test_laws_of_one_name_in_two_files_are_refused_with_both_places(misleading, run) -> None:
    for name, torque in (("one.toml", "c*v*q"), ("two.toml", "c*v^2*q")):
        misleading.with_name(name).write_text(f'[laws.proposal1]\ntorque = "{torque}"\n')
    text = misleading.read_text()
    misleading.write_text('laws = ["one.toml", "two.toml"]\n' + text)
    done = run("diagnose", misleading)
    assert done.status == 2 and done.err.count("\n") == 1
    assert "'proposal1' is another law in" in done.err and "rename one of them" in done.err
    assert all(name in done.err for name in ("one.toml", "two.toml"))
    misleading.write_text('laws = ["one.toml", "one.toml"]\n' + text)
    assert [one.torque for one in di.load(misleading).model.laws] == ["c*v*q"]
