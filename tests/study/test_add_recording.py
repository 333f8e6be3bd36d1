"""A recording is written into a study as the last of its list; all else stays."""

from __future__ import annotations

import tomllib

import pytest

from dynident.errors import StudyError
from dynident.study import add_recording, load
from loop_studies import recordings, write_loop_study


def test_a_recording_is_added_and_read(tmp_path) -> None:
    path = write_loop_study(tmp_path)
    text = "# mine\n" + path.read_text()
    path.write_text(text)
    before = load(path)
    made = recordings()[0].replace(name="more.csv", start=20.0)
    (tmp_path / "more.csv").write_bytes((tmp_path / "train.csv").read_bytes())
    add_recording(path, made)
    after = load(path)
    assert [one.name for one in after.train.recordings] == ["train.csv", "more.csv"]
    assert after.train.recordings[1].start == 20.0
    assert after.train.recordings[1].period == made.period
    assert after.controller == before.controller
    now = tomllib.loads(path.read_text())
    assert now["recordings"][:-1] == tomllib.loads(text)["recordings"]
    assert path.read_text().startswith("# mine\n")


def test_a_recording_that_is_there_is_not_added(tmp_path) -> None:
    path = write_loop_study(tmp_path)
    text = path.read_text()
    with pytest.raises(StudyError, match=r"has train\.csv already"):
        add_recording(path, recordings()[0])
    assert path.read_text() == text


def test_recordings_that_are_no_tables_are_left_alone(tmp_path) -> None:
    path = tmp_path / "study.toml"
    path.write_text('recordings = [{file = "a.csv"}]\n')
    with pytest.raises(StudyError, match="no list of recordings"):
        add_recording(path, recordings()[0])
