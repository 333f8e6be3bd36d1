"""A study that names code: asked for on a terminal, refused in a pipe, run with --trust."""

from __future__ import annotations

import hashlib
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dynident.effect_modules import remember
from study_files import CONTROLLER, STUDY, listing
from user_effects import (
    HOSTILE,
    PLACES,
    SAG,
    SAGGING,
    UNSOUND,
    own_settings,
    put,
    put_place,
    with_columns,
)

WITH_MODULE = STUDY.replace(
    'effects = ["viscous_friction"]',
    'effects = ["viscous_friction", "cable_sag@elbow"]\neffect_modules = ["mine.py"]',
)
COMMANDS = {
    "explain": ("--report", "report.html"),
    "diagnose": (),
    "fit": ("--out", "fit.json"),
    "compare": (),
    "payload": (),
    "add": ("quadratic_drag@elbow",),
    "report": ("--to", "report.html"),
    "show": ("--to", "picture.png"),
    "simulate": (),
}
LOOP = """
[controller]
kind = "pd"
kp = [400.0, 120.0]
kd = [50.0, 8.0]
rate_hz = 250.0

[[recordings]]
file = "run.csv"
duration = 8.0
period = 2.0
"""

__all__ = ["own_settings"]
pytestmark = pytest.mark.usefixtures("own_settings")


@pytest.mark.parametrize("name", COMMANDS)
def test_in_a_pipe_code_is_refused_and_nothing_is_written(run, study, tmp_path, name):
    path = study(WITH_MODULE + CONTROLLER)
    put(tmp_path / "mine.py", f"open({str(tmp_path / 'ran')!r}, 'w')\n" + SAG)
    before = listing(tmp_path)
    done = run(name, path, *COMMANDS[name])
    assert done.status == 2 and done.out == ""
    assert done.err.startswith(f"error: {path}: effect_modules: would run code that is not trusted")
    assert done.err.count("\n") == 1 and "--trust" in done.err and "mine.py" in done.err
    assert listing(tmp_path) == before


def test_refit_asks_for_its_study_too(run, study, tmp_path):
    put(tmp_path / "mine.py", SAG)
    arguments = ("arm.urdf", "--study", study(WITH_MODULE), "--out", "new.urdf")
    assert "not trusted" in run("refit", *arguments).err
    assert run("refit", *arguments, "--trust", "--json").status == 0


@pytest.mark.parametrize("name", [*COMMANDS, "refit"])
def test_every_command_that_reads_a_study_takes_trust(run, name):
    assert "--trust" in run(name, "--help").out


def test_trust_is_for_once(run, study, tmp_path, own_settings):
    path = study(WITH_MODULE)
    put(tmp_path / "mine.py", "print('from the module')\n" + SAG)
    done = run("compare", path, "--trust", "--json")
    assert done.status == 0 and done.err == "from the module\n"
    assert set(done.json)
    assert list(own_settings.iterdir()) == []


def test_what_was_trusted_before_runs_in_a_pipe(run, study, tmp_path):
    path = study(WITH_MODULE)
    put(tmp_path / "mine.py", SAG)
    assert run("compare", path, "--json").status == 2
    remember([hashlib.sha256(SAG.encode()).hexdigest()])
    done = run("compare", path, "--with", "cable_sag@shoulder", "--json")
    assert done.status == 0 and done.err == ""


@pytest.mark.parametrize("answer", ["y", "n", ""])
@pytest.mark.slow
def test_on_a_terminal_it_asks_and_remembers_a_yes(study, tmp_path, own_settings, answer):
    path = study(WITH_MODULE)
    put(tmp_path / "mine.py", SAG)
    done, said = at_a_terminal(path, answer)
    assert str(tmp_path / "mine.py") in said and "run it, now and whenever it is the same?" in said
    if answer == "y":
        assert done.returncode == 0, said
        (kept,) = (own_settings / "dynident").iterdir()
        assert kept.read_text() == hashlib.sha256(SAG.encode()).hexdigest() + "\n"
        done, said = at_a_terminal(path, "")
        assert done.returncode == 0 and "trusted" not in said
    else:
        assert done.returncode == 2 and "error: " in said and done.stdout == ""
        assert list(own_settings.iterdir()) == []


def at_a_terminal(path: Path, answer: str) -> tuple[subprocess.CompletedProcess[str], str]:
    """Run a command that believes to be watched; what it shows besides its answer."""
    ours, theirs = pty.openpty()
    os.write(ours, f"{answer}\n".encode())
    command = [sys.executable, "-m", "dynident.cli", "compare", str(path), "--json"]
    done = subprocess.run(
        command, stdin=theirs, stderr=theirs, stdout=subprocess.PIPE, text=True, check=False
    )
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 65536):
            said += part
    except OSError:  # the end, on Linux
        pass
    os.close(ours)
    return done, said.decode()


@pytest.mark.parametrize("kind", [*HOSTILE, *UNSOUND, *PLACES])
def test_hostile_modules_are_one_line(run, study, tmp_path, kind):
    name = "mine.py"
    if kind in PLACES:
        name, words = put_place(tmp_path, kind), PLACES[kind]
    else:
        content, words = {**HOSTILE, **UNSOUND}[kind]
        put(tmp_path / name, content)
    path = study(WITH_MODULE.replace("mine.py", name))
    before = sorted(one.name for one in tmp_path.iterdir())
    done = run("compare", path, "--trust")
    assert done.status == 2 and done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert re.search(words, done.err) and "\x1b" not in done.err
    assert sorted(one.name for one in tmp_path.iterdir()) == before


LATE = {
    "raises": ("return {}['speed']", r"mine.py:\d+: KeyError: 'speed'"),
    "not finite": ("return np.log(0.0 * block.v[:, j])", r"cable_sag@.* not finite, first at q = "),
    "too short": ("return block.v[:-1, j]", r"cable_sag@.*at_joint\(\) has the shape"),
}


@pytest.mark.parametrize("kind", LATE)
@pytest.mark.parametrize("command", [("diagnose",), ("compare", "--with", "cable_sag@elbow")])
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_effects_that_fail_in_the_work_are_one_line(run, study, tmp_path, kind, command):
    """Sound on the samples that are tried when they are read, and not on recordings."""
    line, words = LATE[kind]
    late = with_columns("if len(block.t) <= 25:\n            return block.v[:, j]")
    put(tmp_path / "mine.py", f"{late}        {line}\n")
    path = study(WITH_MODULE.replace(', "cable_sag@elbow"', ""))
    done = run(command[0], path, *command[1:], "--trust")
    assert done.status == 2 and done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert re.search(words, done.err), done.err


@pytest.mark.parametrize("hidden", ["true", "false"])
@pytest.mark.slow
def test_experiments_name_modules_too(run, study, tmp_path, hidden):
    study()
    put(tmp_path / "mine.py", SAG)
    head = 'robot = "arm.urdf"\neffect_modules = ["mine.py"]\n'
    text = f"{head}{SAGGING}hidden = {hidden}\n{LOOP}"
    (tmp_path / "experiment.toml").write_text(text)
    done = run("simulate", "experiment.toml", "--out", "made")
    assert done.status == 2 and "not trusted" in done.err and not (tmp_path / "made").exists()
    done = run("simulate", "experiment.toml", "--out", "made", "--trust")
    assert done.status == 0, done.err
    text = (tmp_path / "made" / "study.toml").read_text()
    if hidden == "true":
        assert "cable_sag" not in text and not (tmp_path / "made" / "mine.py").exists()
    else:
        assert '"cable_sag@elbow"' in text and 'effect_modules = ["mine.py"]' in text
        assert (tmp_path / "made" / "mine.py").read_text() == SAG
    assert run("compare", "made/study.toml", "--json").status == 0
