"""The command in a process of its own: start, pipes, terminals and Ctrl-C."""

from __future__ import annotations

import json
import os
import re
import select
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study_files import STUDY, edited, listing, write_study

COMMANDS = (
    *("explain", "diagnose", "fit", "compare", "add", "simulate", "report", "check", "refit"),
    "demo",
)
DYNIDENT = (sys.executable, "-m", "dynident.cli")
ENTRY = STUDY[STUDY.index("[[recordings]]") : STUDY.rindex("[[recordings]]")]
LIMIT = 120.0


HEAVY = {"arch", "casadi", "matplotlib", "pandas", "plotly", "sklearn", "statsmodels"}
COMPUTING = HEAVY | {"numpy", "pinocchio", "pydantic", "pydrake", "scipy"}


def shell(
    *arguments: str | Path, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    words = [*DYNIDENT, *map(str, arguments)]
    around = {**os.environ, **environment}
    return subprocess.run(words, capture_output=True, text=True, cwd=cwd, env=around, timeout=LIMIT)


def loaded(told: str) -> set[str]:
    """Return the packages whose import Python told on standard error."""
    lines = told.splitlines()
    assert all(line.startswith("import time:") for line in lines)
    return {line.rpartition("|")[2].strip().partition(".")[0] for line in lines}


def test_help_loads_nothing_that_computes_and_has_an_example():
    for command in ((), *((name,) for name in COMMANDS)):
        done = shell(*command, "--help", PYTHONPROFILEIMPORTTIME="1")
        assert done.returncode == 0
        text = " ".join(done.stdout.split())
        start = " ".join(("Example: dynident", *(command or ("explain",))))
        assert start in text and "\\b" not in text
        assert "dynident" in (packages := loaded(done.stderr))
        assert not packages & COMPUTING, command
        for name in () if command else COMMANDS:
            assert re.search(rf"^  {name} ", done.stdout, re.MULTILINE)


@pytest.mark.slow
def test_a_fit_loads_only_what_it_uses(tmp_path):
    """Of what is heavy: SciPy for linear algebra, Drake and Pinocchio for the robot.

    CasADi makes functions of many samples: here are few.
    """
    few = STUDY.replace("period = 8.0", "window = [0.0, 8.0]")
    done = shell("fit", write_study(tmp_path, few), PYTHONPROFILEIMPORTTIME="1")
    assert done.returncode == 0
    packages = loaded(done.stderr)
    assert "scipy" in packages and not packages & HEAVY


@pytest.mark.slow
def test_errors_reach_the_shell(tmp_path):
    path = write_study(tmp_path, edited(('"viscous_friction"', '"viscous"')))
    before = listing(tmp_path)
    done = shell("explain", path)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1
    assert "did you mean 'viscous_friction'" in done.stderr
    assert listing(tmp_path) == before


@pytest.mark.slow
def test_a_pipe_gets_json_alone_and_no_progress(tmp_path):
    done = shell("compare", write_study(tmp_path), "--json")
    assert done.returncode == 0 and done.stderr == ""
    assert json.loads(done.stdout)["models"]


@pytest.mark.parametrize(("flag", "reader"), [("", "head -1"), ("--json", "true")])
@pytest.mark.slow
def test_broken_pipe(tmp_path, flag, reader):
    path = write_study(tmp_path)
    command = f"{shlex.join(DYNIDENT)} compare {shlex.quote(str(path))} {flag} | {reader}"
    script = f"{command}; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=LIMIT)
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[-1] == "0"
    assert len(lines) == (2 if reader == "head -1" else 1)


def read_until(terminal: int, words: bytes, limit: float = LIMIT) -> bytes:
    """Read what a process writes to its terminal until some words appear, or it ends."""
    seen, end = b"", time.monotonic() + limit
    while words not in seen and time.monotonic() < end:
        ready, _, _ = select.select([terminal], [], [], 0.5)
        if not ready:
            continue
        try:
            piece = os.read(terminal, 4096)
        except OSError:  # Linux: the other side is closed
            break
        if not piece:
            break
        seen += piece
    return seen


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
@pytest.mark.slow
def test_interrupt_during_a_diagnosis(tmp_path):
    """A terminal shows progress; Ctrl-C ends it with one line, status 130, and no files."""
    # The same recording many times: enough work to be interrupted in the middle of it.
    path = write_study(tmp_path, STUDY + "\n" + ENTRY * 12)
    (tmp_path / "old.html").write_text("an older report")
    before = listing(tmp_path)
    terminal, other = os.openpty()
    words = [*DYNIDENT, "explain", str(path), "--report", str(tmp_path / "old.html")]
    # A shell's background job ignores SIGINT, and its children would too.
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=other, env={**os.environ, "TERM": "xterm"}
        )
    finally:
        signal.signal(signal.SIGINT, inherited)
    os.close(other)
    try:
        assert b"diagnosing: " in read_until(terminal, b"diagnosing: ")
        process.send_signal(signal.SIGINT)
        said = read_until(terminal, b"half written")
        said += read_until(terminal, b"nothing more comes")
        assert process.wait(LIMIT) == 130
        assert process.stdout is not None and process.stdout.read() == b""
    finally:
        process.kill()
        process.wait()
        os.close(terminal)
        assert process.stdout is not None
        process.stdout.close()
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", said.decode())
    assert "Traceback" not in text and "KeyboardInterrupt" not in text
    lines = [line for line in re.split(r"[\r\n]+", text) if "interrupted" in line]
    assert lines == ["interrupted; nothing was left half written"]
    assert listing(tmp_path) == before
