"""The page of results: from a run of the least size, and where somebody cannot be run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import run
from side_by_side import peer, running
from side_by_side.line import Benchmark, Line, ratios
from side_by_side.page import number, page
from side_by_side.peer import SKIP, Peer, PeerMissing


def sections(*lines: Line, axis: str = "") -> dict:
    return {
        "machine": {"processor": "p", "processors": 2, "system": "s", "versions": {"numpy": "2"}},
        "sections": {
            "some_work": {
                "title": "Some work",
                "work": "What is done.",
                "compared": "CPU, s",
                "axis": axis,
                "lines": [running.as_json(line) for line in lines],
                "run": {"date": "2026-01-01", "size": "full", "seconds": 3, "load": 0.1},
            }
        },
    }


def rows(text: str) -> list[list[str]]:
    """Cells of the page's tables."""
    return [line[2:-2].split(" | ") for line in text.splitlines() if line.startswith("| ")]


@pytest.mark.slow
def test_a_run_of_the_least_size_becomes_a_page_with_a_picture(tmp_path: Path) -> None:
    run.main(["csv_reading", "effect_count", "--size", "tiny", "--out", str(tmp_path)])
    text = (tmp_path / "benchmarks.md").read_text()
    for name in ("csv_reading", "effect_count"):
        posed = running.benchmark(name)
        assert f"## {posed.title}\n" in text
        assert posed.work in text
    cells = rows(text)
    assert ["work", "by", "CPU, s", "times ours", "wall, s"] in cells
    assert [row[1] for row in cells].count("**dynident.read**") == 1
    assert "tiny size: not to be quoted" in text
    assert (tmp_path / "benchmarks.png").stat().st_size > 0
    kept = json.loads((tmp_path / "benchmarks.json").read_text())
    assert not [line for s in kept["sections"].values() for line in s["lines"] if line["missing"]]
    # What was there stays when another benchmark is run, and the order is the page's.
    assert list(running.merged(kept, {"closed_loop": {}}, run.NAMES)["sections"]) == [
        "effect_count",
        "closed_loop",
        "csv_reading",
    ]


def test_a_page_goes_into_a_folder_that_is_not_there_yet(tmp_path: Path, monkeypatch) -> None:
    """Before anything is run: no work is lost at its end."""
    folder = tmp_path / "new" / "folder"

    def ran(name: str, size: str) -> dict:
        assert folder.is_dir()
        line = Line(case="a", who="dynident", figures={"CPU, s": 1.0})
        return sections(line)["sections"]["some_work"]

    monkeypatch.setattr(run, "section", ran)
    run.main(["csv_reading", "--size", "tiny", "--out", str(folder)])
    assert "## Some work" in (folder / "benchmarks.md").read_text()


def test_all_that_is_listed_can_be_run() -> None:
    for name in run.NAMES:
        posed = running.benchmark(name)
        assert isinstance(posed, Benchmark)
        assert posed.title
        assert posed.work.endswith(".")


def test_a_missing_peer_is_a_line_with_the_reason() -> None:
    reason = "not installed: No matching distribution | none"
    lines = (
        Line(case="a", who="dynident", figures={"CPU, s": 2.0}),
        Line(case="a", who="other", missing=reason),
        Line(case="a", who="another", figures={"CPU, s": 5.0}),
    )
    cells = rows(page(sections(*lines)))
    assert cells[2] == ["a", "**dynident**", "2.00", "1.00"]
    assert cells[3] == ["", "other: not installed: No matching distribution / none", "", ""]
    assert cells[4] == ["", "another", "5.00", "2.50"]


def test_why_a_peer_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peer, "PEERS", tmp_path)
    monkeypatch.setattr(peer, "ENVIRONMENTS", tmp_path / "made")
    with pytest.raises(PeerMissing, match=r"there is no peers/nobody.txt"):
        Peer(script="x.py", environment="nobody").ask({})
    (tmp_path / "broken.txt").write_text("not a requirement\n")
    monkeypatch.setattr(peer.sys, "executable", str(tmp_path / "no_python"))
    with pytest.raises(PeerMissing, match=r"^not installed: .*no_python"):
        Peer(script="x.py", environment="broken").ask({})
    monkeypatch.setenv(SKIP, "skip")
    with pytest.raises(PeerMissing, match="not asked for"):
        Peer(script="x.py", environment="broken").ask({})


def test_a_peer_that_fails_says_its_last_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(peer, "PEERS", tmp_path)
    (tmp_path / "fails.py").write_text("raise SystemExit('no solution: infeasible')")
    with pytest.raises(PeerMissing, match=r"^no solution: infeasible$"):
        Peer(script="fails.py").ask({})
    (tmp_path / "silent.py").write_text("print('hello')")
    with pytest.raises(PeerMissing, match="no answer: hello"):
        Peer(script="silent.py").ask({})


@pytest.mark.slow
def test_what_a_benchmark_had_before_it_failed_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "breaks.py").write_text(
        "from side_by_side.line import Benchmark, Line\n"
        "def lines(size):\n"
        "    yield Line(case='a', who='dynident', figures={'CPU, s': 1.0})\n"
        "    raise ValueError('a word')\n"
        "BENCHMARK = Benchmark(title='t', work='w.', compared='', lines=lines)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    lines, _ = running.in_a_process("breaks", "tiny")
    assert lines[0].figures == {"CPU, s": 1.0}
    assert lines[1].missing == "stopped with status 1: ValueError: a word"


def test_ratios_are_to_the_first_of_ours_in_a_case() -> None:
    lines = [
        Line(case="a", who="peer", figures={"x": 6.0}),
        Line(case="a", who="dynident", figures={"x": 2.0}),
        Line(case="a", who="dynident, compiled", figures={"x": 1.0}),
        Line(case="b", who="peer", figures={"x": 6.0}),
        Line(case="a", who="other", figures={"y": 6.0}),
    ]
    assert ratios(lines, "x") == [3.0, 1.0, 0.5, None, None]


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.0, "0"), (123.4, "123"), (1234.5, "1230"), (0.012345, "0.0123"), (1e-9, "1.0e-09")],
)
def test_numbers_have_three_digits(value: float, said: str) -> None:
    assert number(value) == said
