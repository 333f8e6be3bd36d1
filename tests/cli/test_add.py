"""`dynident add` writes an effect into the study file and nothing else."""

from __future__ import annotations

import tomllib

import pytest

from dynident.cli import main
from dynident.study import load
from study_files import STUDY, edited, listing


@pytest.mark.slow
def test_comments_and_order_stay(run, study, tmp_path):
    path = study()
    before = listing(tmp_path)
    done = run("add", path, "coulomb_friction@elbow", "--json")
    assert done.status == 0 and done.err == ""
    said = done.json
    assert said["added"] == ["coulomb_friction@elbow"]
    old, new = (model["error"] for model in said["models"])
    assert new < 0.1 * old
    wanted = edited(('["viscous_friction"]', '["viscous_friction", "coulomb_friction@elbow"]'))
    assert path.read_text() == wanted
    after = listing(tmp_path)
    assert {**after, "study.toml": b""} == {**before, "study.toml": b""}
    # The error that was foretold is the error of the study that was written.
    assert run("compare", path, "--json").json["models"][0]["error"] == new
    assert run("explain", path, "--json").json["verdict"] == "nothing_missing"


def test_words(run, study):
    path = study()
    done = run("add", path, "coulomb_friction@elbow")
    assert done.status == 0 and done.err == ""
    assert "study" in done.out and "+ coulomb_friction@elbow" in done.out
    assert "explain may print other figures" in done.out
    assert done.out.rstrip().endswith(f"Written into {path}.") or "Written into" in done.out


NO_EFFECTS = edited(('effects = ["viscous_friction"]\n', ""))
LAYOUTS = {
    "no effects": (NO_EFFECTS, []),
    "no effects, CRLF": (NO_EFFECTS.replace("\n", "\r\n"), []),
    "no effects, a quoted key": (NO_EFFECTS.replace("robot =", '"robot" ='), []),
    "none yet": (edited(('["viscous_friction"]', "[]")), []),
    "lines": (
        edited(('["viscous_friction"]', '[\n  "viscous_friction",   # oil\n]  # so far')),
        ["# oil", "# so far"],
    ),
    "lines without a last comma": (
        edited(
            ('["viscous_friction"]', '[\n  "joint_spring@elbow", # a\n  "viscous_friction" # b\n]')
        ),
        ["# a", "# b"],
    ),
    "CRLF": (STUDY.replace("\n", "\r\n"), []),
    "at the end": (
        NO_EFFECTS.replace(
            "[[recordings]]", 'effects = [ "viscous_friction" ]\n\n[[recordings]]', 1
        ),
        [],
    ),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_of_the_list(run, study, layout):
    text, comments = LAYOUTS[layout]
    path = study("")
    path.write_bytes(text.encode())
    assert run("add", path, "coulomb_friction@elbow").status == 0
    new = path.read_bytes().decode()
    old_content, content = tomllib.loads(text), tomllib.loads(new)
    effects = content.pop("effects")
    known = old_content.pop("effects", [])
    assert sorted(effects) == sorted([*known, "coulomb_friction@elbow"])
    assert content == old_content
    for comment in ("# The arm of the tests.", "# base first", "# the long one", *comments):
        assert comment in new
    # What the file held before is still there, line by line and in order.
    untouched = [line for line in text.splitlines() if "friction" not in line and "[]" not in line]
    lines = iter(new.splitlines())
    assert all(line in lines for line in untouched)
    assert ("\r\n" in new) == ("\r\n" in text)
    load(path)


def test_only_what_is_missing_is_added(run, study):
    path = study(edited(('"viscous_friction"', '"viscous_friction@elbow"')))
    said = run("add", path, "viscous_friction", "--json").json
    assert said["added"] == ["viscous_friction@shoulder"]
    assert [str(effect.label) for effect in load(path).model.effects] == [
        *("viscous_friction@elbow", "viscous_friction@shoulder"),
    ]


def test_payload_where_a_recording_carries_it(run, study):
    entry = 'use = "train"\n'
    path = study(edited((entry, f"{entry}payload = true\n")))
    assert run("add", path, "payload", "--json").json["added"] == ["payload"]
    assert "payload" in load(path).model


@pytest.mark.slow
def test_explain_leaves_the_study_alone(run, study, tmp_path):
    path = study()
    before = listing(tmp_path)
    assert run("explain", path).status == 0
    assert listing(tmp_path) == before


def test_a_study_that_may_not_be_written_stays(study, monkeypatch, capfd):
    """The new text goes to a neighbour first: a failure leaves the old one whole."""
    from dynident import files
    from dynident.errors import FileError

    path = study()

    def fail(*_: object) -> None:
        raise FileError("cannot be written (No space left on device)", str(path))

    monkeypatch.setattr(files, "write_bytes", fail)
    with pytest.raises(SystemExit) as stop:
        main(["add", str(path), "coulomb_friction@elbow"])
    said = capfd.readouterr()
    assert stop.value.code == 2 and said.out == ""
    assert said.err.startswith("error: ") and "No space left" in said.err
    assert path.read_text() == STUDY


def test_several_effects_are_added_at_once(run, study):
    path = study()
    done = run("add", path, "coulomb_friction@elbow", "torque_offset", "--json")
    assert done.status == 0
    added = ["coulomb_friction@elbow", "torque_offset@shoulder", "torque_offset@elbow"]
    assert done.json["added"] == added
    assert [m["name"] for m in done.json["models"]] == [
        "study",
        "+ coulomb_friction@elbow + torque_offset",
    ]
    labels = [effect.label for effect in load(path).model.effects]
    assert labels[-3:] == added
