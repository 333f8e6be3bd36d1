"""The command `check`: tables that fit, one JSON object, and an exit status that tells."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from broken_robots import WRITERS, Fore, urdf
from synthetic import ARM

BODY = {"name", "kind", "body", "parts", "length", "length_from", "broken", "rules"}
BODY |= {"not_checked", "hints", "mend"}
RULE = {"rule", "value", "unit", "relative", "broken", "words"}
SWAPPED = Fore(moments=(0.0163, 0.0155, 0.0011))
JOINT = {"name", "quantity", "value", "unit", "relative", "sigma", "broken", "words"}


@pytest.mark.parametrize("name", WRITERS)
def test_healthy_and_broken(run, tmp_path, name):
    path = tmp_path / f"arm.{name}"
    path.write_text(WRITERS[name]())
    done = run("check", path)
    assert done.status == 0 and done.err == ""
    # A long path wraps the line.
    assert " ".join(done.out.split()).endswith(f"{path}: consistent: no rule is broken.")
    path.write_text(WRITERS[name](Fore(mass=-2)))
    done = run("check", path)
    assert done.status == 1 and done.err == ""
    assert "the mass is negative: -2 kg" in done.out and "BROKEN" in done.out
    after = " ".join(done.out.partition("NOT consistent: link 'fore'")[2].split())
    assert "Next, the nearest robot that can exist: dynident refit" in after
    assert "Traceback" not in done.out


@pytest.mark.parametrize(
    "fore",
    [Fore(), Fore(mass="nan"), Fore(moments=(0.0011, 0.0155, 0.03)), Fore(com="9 0 0"), SWAPPED],
)
def test_json(run, tmp_path, fore):
    (tmp_path / "arm.urdf").write_text(urdf(fore))
    done = run("check", "arm.urdf", "--json")
    said = done.json
    assert done.err == "" and done.status == (0 if said["consistent"] else 1)
    assert set(said) == {"name", "source", "consistent", "links", "bodies", "joints", "notes"}
    assert said["name"] == "arm.urdf" and said["source"] == "urdf"
    assert {one["name"] for one in said["links"]} == {"upper", "fore"}
    for body in said["links"] + said["bodies"]:
        assert set(body) == BODY
        assert body["broken"] == any(rule["broken"] for rule in body["rules"])
        for rule in body["rules"]:
            assert set(rule) == RULE and bool(rule["words"]) == (
                rule["broken"] or (rule["rule"] == "spread" and rule["value"] < 0)
            )
        for change in body["mend"]:
            assert set(change) == {"name", "before", "after", "unit"}
    for joint in said["joints"]:
        assert set(joint) == JOINT
    assert said["consistent"] == (not any(one["broken"] for one in said["links"]))


def test_a_hint_is_no_failure(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(urdf(SWAPPED))
    done = run("check", "arm.urdf")
    assert done.status == 0 and done.err == "" and "look at it" in done.out
    assert "axes swapped? It fits with x and z exchanged" in done.out
    assert "or the shapes are simplified" in " ".join(done.out.split())


def test_all_rules(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(urdf(Fore(mass=-1)))
    short, long = run("check", "arm.urdf"), run("check", "arm.urdf", "--all")
    assert short.status == long.status == 1 and long.out.endswith(short.out)
    assert "`dynident check --all`" in short.out
    rule = "inertia about the centre of mass"
    assert rule not in short.out and long.out.count(rule) == 2
    assert run("check", "arm.urdf", "--all", "--json").out == run("check", "arm.urdf", "--json").out


def test_tables_fit_a_page(run, tmp_path):
    rest = '<link name="{0}"><inertial><mass value="{1}"/><inertia ixx="1" iyy="1" izz="9"/>'
    rest += '</inertial></link><joint name="to {0}" type="fixed"><parent link="fore"/>'
    rest += '<child link="{0}"/></joint>'
    name = "a_rather_long_name_of_a_link"
    fore = Fore(products=(0.2, -0.1, 0.05), rest=rest.format(name, -1))
    (tmp_path / "arm.urdf").write_text(urdf(fore))
    done = run("check", "arm.urdf", "--all")
    assert done.status == 1
    assert max(len(line) for line in done.out.splitlines()) <= 110


def test_an_estimate(run, study, tmp_path):
    path = study()
    assert run("fit", path, "--out", "fit.json").status == 0
    done = run("check", "fit.json", "--json")
    said = done.json
    assert said["source"] == "estimate" and done.status == (0 if said["consistent"] else 1)
    assert {one["name"] for one in said["joints"]} == {"Fv@shoulder", "Fv@elbow"}
    assert all(one["sigma"] is not None for one in said["joints"])
    assert any("What the data cannot tell" in note for note in said["notes"])
    # A fit of consistent links chose what the data cannot tell.
    assert run("fit", path, "--consistency", "full", "--out", "full.json").status == 0
    assert not any("cannot tell" in note for note in run("check", "full.json").out.splitlines())


UNUSABLE = {
    "missing": (None, "no such file"),
    "empty": ("", "is empty"),
    "table": ("t,q\n0,1\n", "neither a robot description nor a saved estimate"),
    "xacro": (urdf(Fore(rest='<xacro:macro name="x"/>')), "xacro FILE.xacro"),
    "page": ("<html/>", "root element is <html>"),
    "another JSON": ("{}", "is not a dynident estimate"),
    "cut off": (ARM[:200], "not well-formed XML"),
}


@pytest.mark.parametrize(("text", "words"), UNUSABLE.values(), ids=UNUSABLE)
def test_unusable_files(run, tmp_path, text, words):
    path = tmp_path / "robot"
    if text is not None:
        path.write_text(text)
    for options in ((), ("--json",)):
        done = run("check", path, *options)
        assert done.status == 2 and done.out == ""
        assert done.err.startswith("error: ") and done.err.count("\n") == 1
        assert words in done.err and str(path) in done.err


def test_a_folder_and_bytes(run, tmp_path):
    assert "is a folder" in run("check", tmp_path).err
    path = tmp_path / "noise"
    path.write_bytes(np.random.default_rng(0).bytes(1000))
    done = run("check", path)
    assert done.status == 2 and "is not UTF-8 text" in done.err


def test_as_a_process(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(Fore(mass="nan", moments=(-1, 0, 0))))
    done = subprocess.run(
        [sys.executable, "-m", "dynident.cli", "check", str(path)], capture_output=True, text=True
    )
    assert done.returncode == 1 and done.stderr == ""
    assert "mass = nan" in done.stdout
