"""Hostile input by the hundred: one line that says what and where, status 2, and nothing is left.

Each kind has a module with its table. All are run in a process of their own, each command within
ten seconds of processor time and a gigabyte (`worker`).
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dynident.tables import printable
from hostile.corpus import KINDS, corpus

TESTS = Path(__file__).parents[1]
NAMES = [(kind, name) for kind in KINDS for name in corpus(kind)]


@pytest.fixture(scope="session")
def outcomes(request, tmp_path_factory) -> dict[tuple[str, str], list[dict]]:
    """What became of the cases that are asked for; one that ended the process has no outcomes."""
    # Tests elsewhere have cases of their own.
    own = (item for item in request.session.items if item.path == Path(__file__))
    asked = (getattr(item, "callspec", None) for item in own)
    left = [one.params["case"] for one in asked if one is not None and "case" in one.params]
    results = tmp_path_factory.mktemp("hostile") / "outcomes"
    around = {key: value for key, value in os.environ.items() if key != "DYNIDENT_DATA"}
    found: dict[tuple[str, str], list[dict]] = {}
    while left:
        results.write_text("")
        subprocess.run(
            [sys.executable, "-m", "hostile.worker", str(results)],
            input="\n".join("\t".join(case) for case in left),
            text=True,
            cwd=TESTS,
            env=around,
            timeout=3600,
        )
        done = [json.loads(line) for line in results.read_text().splitlines()]
        found |= dict(zip(left, done, strict=False))
        left = left[len(done) :]
        if left:  # it ended with this one: go on after it
            found[left.pop(0)] = []
    return found


@pytest.mark.parametrize("case", NAMES, ids=[f"{kind}: {name}" for kind, name in NAMES])
def test_one_line_or_a_right_answer(outcomes, case):
    kind, name = case
    expected = corpus(kind)[name]
    done = outcomes[case]
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


def test_there_are_many() -> None:
    assert len(NAMES) > 600
    assert all(
        case.message or case.files or kind == "calls"
        for kind in KINDS
        for case in corpus(kind).values()
    )
