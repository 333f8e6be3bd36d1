"""Unusable input: one clear line, exit status 2, no traceback, and nothing is written.

Most of it is in `hostile`; here is what needs more than a folder and a command.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from dynident.cli import main
from dynident.recording import write
from hostile.recordings import LINES, still
from study_files import edited, listing, recording
from synthetic import ARM


def refused(run, folder: Path, message: str, *arguments: str | Path) -> str:
    """Run the command and hold it to what unusable input must give; return the line."""
    before = listing(folder)
    done = run(*arguments)
    assert done.status == 2, done
    assert done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert "Traceback" not in done.err and len(done.err) < 700
    assert re.search(message, done.err), done.err
    assert listing(folder) == before
    return done.err


# --- studies ------------------------------------------------------------------------------------


def test_study_files(run, tmp_path):
    refused(run, tmp_path, r"none.toml: no such file. check the path", "explain", "none.toml")
    refused(run, tmp_path, r"is a folder, not a file", "explain", tmp_path)
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    refused(run, tmp_path, r"binary.toml: is not UTF-8 text", "explain", "binary.toml")
    (tmp_path / "null.toml").write_bytes(b"\0" * 100)
    refused(run, tmp_path, r"null.toml: is not TOML", "explain", "null.toml")
    refused(run, tmp_path, r"no/study.toml: no such file", "add", "no/study.toml", "joint_spring")
    refused(run, tmp_path, r"none.toml: no such file", "simulate", "none.toml", "--out", "x")
    meant = r"binry.toml: no such file. did you mean 'binary.toml'\?"
    refused(run, tmp_path, meant, "explain", "binry.toml")
    (tmp_path / "gone.toml").symlink_to("nowhere.toml")
    (tmp_path / "folder.toml").mkdir()
    for name in ("gone.toml", "folder.tom"):
        refused(run, tmp_path, rf"{name}: no such file. check the path", "explain", name)


# --- recordings ---------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".parquet"])
def test_truncated(run, study, tmp_path, suffix):
    path = study(edited(("train.csv", f"train{suffix}")))
    file = write(recording(0), tmp_path / f"train{suffix}")
    file.write_bytes(file.read_bytes()[:5000])
    refused(run, tmp_path, rf"train{suffix}: .*(complete|no column)", "explain", path)


class Trap:
    def __reduce__(self):
        return (pytest.fail, ("a file was unpickled",))


def test_pickled(run, study, tmp_path):
    path = study(edited(("train.csv", "train.npz")))
    t = np.arange(3.0)
    columns = {name: t for name in LINES[0].split(",")}
    np.savez(tmp_path / "train.npz", **{**columns, "q.elbow": np.array([Trap()] * 3)})
    message = r"train.npz: 'q.elbow' holds Python objects, which are never loaded"
    refused(run, tmp_path, message, "explain", path)


# --- robots -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_joint_at_rest_is_named(run, study, tmp_path):
    path = study()
    (tmp_path / "train.csv").write_text(still(slice(2, 3)))
    done = run("fit", path)
    assert done.status == 0
    assert re.search(r"^warning: .*train.csv: elbow stands still in every training", done.err)
    assert done.err.count("\n") == 1
    assert "The data do not excite every parameter" in done.out
    for command in ("compare", "explain"):
        done = run(command, path, "--json")
        assert done.status == 0 and "elbow stands still" in done.err
        assert done.json


def test_a_joint_without_torque_is_named(run, study, tmp_path):
    path = study()
    for name in ("train.csv", "test.csv"):
        lines = [line.rpartition(",")[0] for line in (tmp_path / name).read_text().splitlines()]
        (tmp_path / name).write_text(
            "\n".join([lines[0] + ",tau.elbow"] + [f"{x},0" for x in lines[1:]])
        )
    done = run("compare", path, "--json")
    assert done.status == 0 and done.err.count("\n") == 1
    assert re.search(r"^warning: .*train.csv: the torque of elbow is zero throughout", done.err)
    assert [joint["error"] for joint in done.json["models"][0]["joints"]][1] is None


def test_massless_robot(run, study, tmp_path):
    """A model of massless links is something to start from: nothing given enters the fit."""
    path = study()
    text = re.sub(r'mass value="\d"', 'mass value="0"', ARM)
    (tmp_path / "arm.urdf").write_text(re.sub(r'(i[xyz]{2})="[^"]*"', r'\1="0"', text))
    done = run("fit", path, "--json")
    assert done.status == 0 and done.json["error"] < 0.1


# --- arguments ----------------------------------------------------------------------------------


def test_an_event_of_one_recording_is_nothing_to_fit(run, study, tmp_path):
    text = edited(('"viscous_friction"', '"viscous_friction", "contact@elbow"'))
    refused(
        run, tmp_path, r"contact@elbow: happened once.* its window in the study", "fit", study(text)
    )


def test_what_a_terminal_would_obey_is_spelt_out(run, study, tmp_path):
    text = edited(('"test.csv"', '"a\\u202e\\u001b[31mb\\u0007.csv"'))
    said = refused(run, tmp_path, r"a.u202e.u001b\[31mb.u0007.csv", "compare", study(text))
    assert not {"\u202e", "\x1b", "\x07"} & set(said)


def test_what_nobody_foresaw_is_one_line_too(run, study, capfd, monkeypatch):
    path = study()

    def broken(*_: object, **__: object) -> None:
        raise ValueError("two\nlines")

    monkeypatch.setattr("dynident.study.load", broken)
    with pytest.raises(SystemExit) as stop:
        main(["compare", str(path)])
    assert stop.value.code == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1 and "unexpected ValueError: two lines" in said
    monkeypatch.setenv("DYNIDENT_TRACEBACK", "1")
    with pytest.raises(ValueError, match="two"):
        main(["compare", str(path)])
