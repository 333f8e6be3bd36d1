"""`dynident refit`: what it prints, what it writes, and what it refuses."""

from __future__ import annotations

import re

import numpy as np
import pytest

from dynident.fitting import load_estimate
from dynident.inertia import PARAMETERS, margins
from dynident.robot import Robot
from study_files import listing
from synthetic import ARM, arm

BROKEN = ARM.replace('ixx="0.01"', 'ixx="0.3"')


@pytest.fixture
def broken(tmp_path):
    path = tmp_path / "broken.urdf"
    path.write_text(BROKEN)
    return path


def csv() -> str:
    rows = [
        f"{p}.{link.name},{x!r}"
        for link in arm().links[1:]
        for p, x in zip(PARAMETERS, link.phi.tolist(), strict=True)
    ]
    return "\n".join(["name,value", *rows]) + "\n"


def consistent(path) -> bool:
    return all(margins(link.phi).consistent for link in Robot.from_file(path).links)


def test_a_broken_robot_is_mended(run, broken, tmp_path):
    done = run("refit", broken, "--out", "refitted.urdf")
    assert done.status == 0 and done.err == ""
    for words in (
        "Made fully consistent: 1 of 2 links moved.",
        r"upper .*triangle -0.18",
        "This is the optimum",
        r"Written: refitted.urdf \(only inertial elements changed\).",
        "All 3 links are fully consistent",
        "Drake read joints and inertias from the file, and simulated",
        "Pinocchio read joints and inertias from the file",
    ):
        assert re.search(words, done.out), words
    assert consistent(tmp_path / "refitted.urdf") and broken.read_text() == BROKEN
    again = run("refit", "refitted.urdf", "--out", "refitted.urdf")
    assert "Nothing to fix" in again.out and "unchanged, to the byte" in again.out
    assert run("check", "refitted.urdf").status == 0


def test_the_file_itself_may_be_replaced(run, broken, tmp_path):
    assert run("refit", broken, "--out", broken).status == 0
    assert consistent(broken) and [p.name for p in tmp_path.iterdir()] == ["broken.urdf"]


def test_json(run, study, broken, tmp_path):
    done = run("refit", broken, "--study", study(), "--out", "new.urdf", "--json")
    assert done.status == 0 and done.err == ""
    said = done.json
    assert set(said) == {
        *("out", "verified", "consistency", "unchanged", "links", "metric", "prior", "misfit"),
        *("certificate", "notes", "effects", "torque_errors"),
    }
    assert said["out"] == "new.urdf" and said["consistency"] == "full" and not said["unchanged"]
    assert said["verified"]["notion"] == "full" and said["verified"]["drake"] == "own parser"
    assert said["verified"]["inverse_dynamics_difference"] < 1e-10
    assert said["certificate"]["optimal"] is True
    assert [link["name"] for link in said["links"]] == ["upper", "fore"]
    assert [link["was_consistent"] for link in said["links"]] == [False, True]
    assert [effect["name"] for effect in said["effects"]] == ["Fv@shoulder", "Fv@elbow"]
    errors = said["torque_errors"]
    assert set(errors) == {"recordings", "noise_floor", "as_given", "least_squares", "refit"}
    assert errors["recordings"] == "test" and 0 < errors["noise_floor"] < 0.1
    for name in ("as_given", "least_squares", "refit"):
        assert 0 < errors[name]["error"] < 1
        assert [joint["name"] for joint in errors[name]["joints"]] == ["shoulder", "elbow"]
    written = {link.name: link.phi for link in Robot.from_file(tmp_path / "new.urdf").links}
    for link in said["links"]:
        np.testing.assert_allclose(written[link["name"]], link["after"], rtol=1e-12, atol=1e-14)
    alone = run("refit", broken, "--out", "new.urdf", "--json").json
    assert alone["torque_errors"] is None and alone["metric"] is None


def test_an_estimate(run, study, tmp_path):
    assert run("fit", study(), "--out", "fit.json").status == 0
    done = run("refit", "fit.json", "--out", "new.urdf", "--json")
    assert done.status == 0 and done.err == ""
    assert done.json["metric"] == "covariance of the estimate"
    assert consistent(tmp_path / "new.urdf")
    before = load_estimate(tmp_path / "fit.json").robot
    np.testing.assert_allclose(done.json["links"][0]["before"], before.links[1].phi)


def test_lists_of_numbers(run, study, broken, tmp_path):
    (tmp_path / "mine.csv").write_text(csv())
    for more in (("--robot", "broken.urdf"), ("--study", study())):
        done = run("refit", "mine.csv", *more, "--out", "new.urdf", "--json")
        assert done.status == 0 and done.err == "" and done.json["unchanged"]
        reloaded = Robot.from_file(tmp_path / "new.urdf")
        np.testing.assert_allclose(reloaded.theta, arm().theta, rtol=1e-12, atol=1e-14)
    both = ("--robot", "broken.urdf", "--study", "study.toml")
    assert run("refit", "mine.csv", *both, "--out", "new.urdf").status == 0
    (tmp_path / "mine.csv").write_text(",".join(map(repr, arm().theta.tolist())))
    more = ("--order", "dynident", "--robot", "broken.urdf", "--out", "new.urdf")
    assert run("refit", "mine.csv", *more).status == 0
    np.testing.assert_allclose(Robot.from_file(tmp_path / "new.urdf").theta, arm().theta)


@pytest.mark.parametrize(
    "options",
    [("--solver", "nlp"), ("--distance", "entropic", "--spread", "0.1"), ("--consistency", "semi")],
)
def test_options(run, study, broken, options):
    done = run("refit", broken, "--study", study(), "--out", "new.urdf", *options)
    assert done.status == 0 and done.err == ""


MASSLESS = re.sub(r'mass value="2"', 'mass value="0"', ARM).replace(
    'ixx="0.004" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"',
    'ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"',
)
FILES = {
    "nan.urdf": ARM.replace('izz="0.06"', 'izz="nan"'),
    "massless.urdf": MASSLESS,
    "mine.csv": csv(),
    "short.csv": csv().replace("Izz.fore", "Izz.four"),
    "numbers.csv": "1\n2\n3\n",
    "other.json": "{}",
    "longer.urdf": ARM.replace('xyz="0.4 0 0"', 'xyz="0.5 0 0"'),
    "hip.urdf": ARM.replace("shoulder", "hip"),
}
BAD = {
    "no file": (("none.urdf", "--out", "a.urdf"), r"none.urdf: no such file"),
    "no place": (("broken.urdf",), r"Missing option '--out'"),
    "no folder": (("broken.urdf", "--out", "no/a.urdf"), r"no: no such folder"),
    "a folder": (("broken.urdf", "--out", "."), r"is a folder"),
    "other format": (("broken.urdf", "--out", "a.sdf"), r"a.sdf: the description is of .* URDF"),
    "over the study": (
        ("broken.urdf", "--study", "study.toml", "--out", "study.toml"),
        r"study.toml: is not a robot description",
    ),
    "over the list": (
        ("mine.csv", "--robot", "broken.urdf", "--out", "mine.csv"),
        r"mine.csv: is not a robot description. write to another file",
    ),
    "NaN": (("nan.urdf", "--out", "a.urdf"), r"nan.urdf: link 'upper': is not finite \(Izz = nan"),
    "massless end": (
        ("massless.urdf", "--out", "massless.urdf"),
        r"massless.urdf: the new description fails: .* Nothing was written",
    ),
    "no estimate": (("other.json", "--out", "a.urdf"), r"other.json: is not a dynident estimate"),
    "no robot": (("mine.csv", "--out", "a.urdf"), r"does not say of which robot.*--robot"),
    "no order": (
        ("numbers.csv", "--robot", "broken.urdf", "--out", "a.urdf"),
        r"numbers.csv, header: .* no order",
    ),
    "unknown order": (
        ("numbers.csv", "--robot", "broken.urdf", "--order", "x", "--out", "a.urdf"),
        r"no order 'x' of parameters. orders: dynident, paper",
    ),
    "wrong count": (
        ("numbers.csv", "--robot", "broken.urdf", "--order", "paper", "--out", "a.urdf"),
        r"3 numbers for 2 moving bodies .* 20 are needed",
    ),
    "order of a description": (
        ("broken.urdf", "--order", "paper", "--out", "a.urdf"),
        r"broken.urdf: is no CSV file.* leave out the order",
    ),
    "unknown link": (
        ("short.csv", "--robot", "broken.urdf", "--out", "a.urdf"),
        r"name Izz.four: no such parameter. did you mean 'fore'",
    ),
    "other joints": (
        ("hip.urdf", "--study", "study.toml", "--out", "a.urdf"),
        r"no moving joint 'shoulder'",
    ),
    "other kinematics": (
        ("broken.urdf", "--robot", "longer.urdf", "--out", "a.urdf"),
        r"has other kinematics",
    ),
    "wrong notion": (
        ("broken.urdf", "--consistency", "none", "--out", "a.urdf"),
        r"'full', 'semi'",
    ),
    "wrong spread": (("broken.urdf", "--spread", "-1", "--out", "a.urdf"), r"spread = -1"),
}


@pytest.mark.parametrize("kind", BAD)
def test_unusable_input(run, study, broken, tmp_path, kind):
    arguments, message = BAD[kind]
    study()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    before = listing(tmp_path)
    done = run("refit", *arguments)
    assert done.status == 2 and done.out == "", done
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert re.search(message, done.err), done.err
    assert listing(tmp_path) == before


def test_help(run):
    said = " ".join(run("refit", "--help").out.split())
    assert "Example: dynident refit robot.urdf --out refitted.urdf" in said and "--json" in said
    done = run("refit", "robot.urdf", "--out", "refitted.urdf")
    assert done.status == 2 and "robot.urdf: no such file" in done.err
