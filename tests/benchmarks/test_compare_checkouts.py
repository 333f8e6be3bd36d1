"""What counts as a difference between the answers of two checkouts."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from compare_checkouts import differences, report

TOLERANCE = 1e-9


def found(one: object, other: object) -> list[tuple[str, bool]]:
    return list(differences(one, other, TOLERANCE))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"a": [1.0, {"b": None}], "c": "x"}, {"c": "x", "a": [1.0, {"b": None}]}),
        ({"a": 1.0}, {"a": 1.0 + 1e-10}),
        ({"a": 1e6}, {"a": 1e6 * (1 + 1e-10)}),
        ({"a": 0.0}, {"a": 1e-15}),
        ({"a": math.nan}, {"a": math.nan}),
        ({"a": 3}, {"a": 3.0}),
    ],
)
def test_equal(one: object, other: object) -> None:
    assert found(one, other) == []


@pytest.mark.parametrize(
    ("one", "other", "where"),
    [
        ({"a": 1.0}, {"a": 1.0 + 1e-8}, ".a"),
        ({"a": 1e-6}, {"a": 1.1e-6}, ".a"),
        ({"a": {"b": [0.0, 1.0]}}, {"a": {"b": [0.0, 2.0]}}, ".a.b[1]"),
        ({"a": [1.0]}, {"a": [1.0, 2.0]}, ".a"),
        ({"a": math.nan}, {"a": 0.0}, ".a"),
        ({"a": True}, {"a": 1}, ".a"),
        ({"a": None}, {"a": 0.0}, ".a"),
        ({"a": "explained"}, {"a": "unexplained"}, ".a"),
        ({"a": 1, "b": 2}, {"a": 1}, ".b"),
        ({"a": 1}, {"a": 1, "b": 2}, ".b"),
    ],
)
def test_different(one: object, other: object, where: str) -> None:
    ((line, is_sentence),) = found(one, other)
    assert line.startswith(f"{where}: ")
    assert not is_sentence


def test_either_order_gives_as_many() -> None:
    one = {"a": 1.0, "b": [1, 2, {"c": "x"}], "d": None}
    other = {"a": 1.0, "b": [1, 3, {"c": "y", "e": 0}]}
    assert len(found(one, other)) == len(found(other, one)) == 4


def test_a_reworded_sentence_is_told_apart_from_a_changed_name() -> None:
    ((_, is_sentence),) = found({"why": "it is small"}, {"why": "it is tiny"})
    assert is_sentence
    ((_, is_sentence),) = found({"why": "small"}, {"why": "tiny"})
    assert not is_sentence


def written(folder: Path, **answers: object) -> Path:
    folder.mkdir()
    for name, answer in answers.items():
        (folder / f"{name}.json").write_text(json.dumps(answer))
    return folder


def test_report_of_two_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = written(tmp_path / "one", fit={"error": 0.5, "note": "one thing"})
    other = written(tmp_path / "other", fit={"error": 0.5, "note": "another thing"})
    assert report(one, other, TOLERANCE, words=False) == 0
    assert "fit.json: equal, 1 sentences reworded" in capsys.readouterr().out
    assert report(one, other, TOLERANCE, words=True) == 1
    lacking = written(tmp_path / "lacking")
    assert report(one, lacking, TOLERANCE, words=False) == 1
    assert "in one of the two only" in capsys.readouterr().out
