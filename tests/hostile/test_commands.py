"""Hostile input by the hundred: one line that says what and where, status 2, and nothing is left.

Each kind has a module with its table. All are run in a process of their own, each command within
ten seconds of processor time and a gigabyte (`worker`), and a case within two minutes by the clock:
who waits uses no processor.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from threading import Timer

import pytest

from dynident.tables import printable
from hostile.corpus import KINDS, corpus

TESTS = Path(__file__).parents[1]
BAGS = TESTS.parent / "benchmarks"
"""Where `ros_bags` is, which writes bags for tests and benchmarks alike."""
SHARE = 6
"""Of so many cases `make test-fast` tries one."""
MOST_SECONDS = 120.0
"""By the clock, that a case may take."""
WORKER = (sys.executable, "-m", "hostile.worker")
NAMES = [(kind, name) for kind in KINDS for name in corpus(kind)]


class Tried:
    """Cases that are tried in a process of their own, begun again after one that ends it."""

    def __init__(self, command: Sequence[str] = WORKER, most_seconds: float = MOST_SECONDS) -> None:
        self.command, self.most_seconds = command, most_seconds
        self.around = {key: value for key, value in os.environ.items() if key != "DYNIDENT_DATA"}
        own = os.environ.get("PYTHONPATH", "")
        self.around["PYTHONPATH"] = os.pathsep.join(filter(None, (str(BAGS), own)))
        self.process = self.begun()

    def begun(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            self.command,
            cwd=TESTS,
            env=self.around,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def outcomes(self, kind: str, name: str) -> list[dict]:
        """What became of the commands of a case; nothing, where it ended the process."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(f"{kind}\t{name}\n")
        self.process.stdin.flush()
        late = Timer(self.most_seconds, self.process.kill)
        late.start()
        answer = self.process.stdout.readline()
        late.cancel()
        if answer.endswith("\n"):
            return json.loads(answer)
        self.end()
        self.process = self.begun()
        return []

    def end(self) -> None:
        """Let the process end, as it does when nothing more is asked."""
        try:
            self.process.communicate(timeout=self.most_seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()


@pytest.fixture(scope="module")
def tried() -> Iterator[Tried]:
    one = Tried()
    yield one
    one.end()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=": ".join(case), marks=pytest.mark.slow if k % SHARE else ())
        for k, case in enumerate(NAMES)
    ],
)
def test_one_line_or_a_right_answer(tried: Tried, case: tuple[str, str]) -> None:
    kind, name = case
    expected = corpus(kind)[name]
    done = tried.outcomes(kind, name)
    assert len(done) == len(expected.commands), "it took too long, or ended the process"
    for one in done:
        said = one["err"].splitlines()
        lines = [line for line in said if not line.startswith("warning: ")]
        assert "encountered" not in one["err"] and "Traceback" not in one["err"]
        assert printable(one["err"]) == one["err"] and printable(one["out"]) == one["out"]
        assert [file for file in one["changed"] if Path(file).name.startswith(".")] == []
        if not expected.message:
            assert one["status"] in (0, 1) and one["out"] and lines == []
            continue
        assert one["status"] == 2 and one["out"] == "" and one["changed"] == []
        assert len(lines) == 1 and lines[0].startswith("error: ") and said[-1] == lines[0]
        assert not re.search(r"error: (unexpected \w+:|out of memory)", lines[0])
        assert re.search(expected.message, lines[0]) and len(lines[0]) < 700


@pytest.mark.slow
def test_a_case_that_waits_for_ever_fails_alone() -> None:
    """Sleep uses no processor time, of which alone the worker itself has a limit."""
    waits = "import time; print(end='[', flush=True); time.sleep(3600)"
    one = Tried((sys.executable, "-c", waits), most_seconds=1.0)
    first = one.process
    assert one.outcomes("any", "case") == []
    assert first.returncode and one.process is not first and one.process.poll() is None
    one.end()
    assert one.process.returncode


def test_there_are_many() -> None:
    assert len(NAMES) > 600
    assert all(
        case.message or case.files or kind == "calls"
        for kind in KINDS
        for case in corpus(kind).values()
    )
