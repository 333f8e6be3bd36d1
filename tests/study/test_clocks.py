"""Files on a wall clock: seconds since 1970 are no time of a session."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.recording import Recording, read
from dynident.study import load
from study_files import STUDY, recording, write_study

WALL = 1.7640912e9


def moved(path: Path, seconds: float) -> None:
    """Let the clock of a file show so much more."""
    header, *lines = path.read_text().splitlines()
    cells = (line.split(",", 1) for line in lines)
    rows = [f"{float(t) + seconds:.6f},{rest}" for t, rest in cells]
    path.write_text("\n".join([header, *rows]) + "\n")


def study_of(folder: Path, train: float, test: float, text: str = STUDY) -> list[Recording]:
    """The recordings of a study whose files show so many seconds more."""
    path = write_study(folder, text)
    moved(folder / "train.csv", train)
    moved(folder / "test.csv", test)
    study = load(path)
    return [*study.train.recordings, *study.test.recordings]


def test_a_wall_clock_tells_when_recordings_began(tmp_path: Path) -> None:
    train, test = study_of(tmp_path, WALL + 90.0, WALL)
    assert (train.start, test.start) == (90.0, 0.0)
    for one, seed in ((train, 0), (test, 1)):
        np.testing.assert_allclose(one.t, recording(seed).t, atol=1e-6)
    assert train.provenance.began == pytest.approx(WALL + 90.0)


def test_what_the_study_states_counts(tmp_path: Path) -> None:
    text = STUDY.replace('use = "test"', 'use = "test"\nstart = 40.0')
    train, test = study_of(tmp_path, WALL, WALL + 90.0, text)
    assert (train.start, test.start) == (0.0, 40.0)
    assert train.t[0] == test.t[0] == 0.0


@pytest.mark.parametrize(
    ("train", "test"),
    [(3.0, 50.0), (3.0, WALL), (WALL, WALL + 1e6)],
    ids=["session clocks", "one of each", "days apart"],
)
def test_other_clocks_tell_nothing_of_the_session(
    tmp_path: Path, train: float, test: float
) -> None:
    found = study_of(tmp_path, train, test)
    assert [one.start for one in found] == [0.0, 0.0]
    for one, shift in zip(found, (train, test), strict=True):
        assert one.t[0] == pytest.approx(shift if shift < WALL else 0.0)


def test_clocks_around_the_longest_session_go_on(tmp_path: Path) -> None:
    train, test = study_of(tmp_path, 99_990.0, 100_090.0)
    assert test.t[0] + test.start - (train.t[0] + train.start) == pytest.approx(100.0)


def test_a_start_of_zero_is_stated_too(tmp_path: Path) -> None:
    text = STUDY.replace("period = 8.0", "period = 8.0\nstart = 0.0")
    assert [one.start for one in study_of(tmp_path, WALL + 90.0, WALL, text)] == [0.0, 0.0]


@pytest.mark.parametrize("stamp", ["nan", "", "oops"])
def test_a_faulty_first_stamp_does_not_decide_what_a_clock_counts_from(
    tmp_path: Path, stamp: str
) -> None:
    text = STUDY.replace('use = "train"', 'use = "train"\nwindow = [4.0, 12.0]')
    path = write_study(tmp_path, text)
    moved(tmp_path / "train.csv", WALL)
    moved(tmp_path / "test.csv", WALL)
    header, first, *lines = (tmp_path / "train.csv").read_text().splitlines()
    faulty = ",".join([stamp, *first.split(",")[1:]])
    (tmp_path / "train.csv").write_text("\n".join([header, faulty, *lines]) + "\n")
    (train,) = load(path).train.recordings
    assert train.window == (4.0, 12.0) and 0.0 <= train.t[0] < 4.0


def test_a_window_on_a_clock_that_has_run_for_days_is_one_from_the_first_sample(
    tmp_path: Path,
) -> None:
    text = STUDY.replace('use = "train"', 'use = "train"\nwindow = [250004.0, 250012.0]')
    train, _ = study_of(tmp_path, 250_000.0, 250_100.0, text)
    assert train.window == (4.0, 12.0)


def test_a_window_counts_from_the_first_sample_of_a_wall_clock(tmp_path: Path) -> None:
    text = STUDY.replace('use = "train"', 'use = "train"\nwindow = [4.0, 12.0]')
    train, _ = study_of(tmp_path, WALL, WALL, text)
    assert train.window == (4.0, 12.0)
    path = tmp_path / "train.csv"
    lines = path.read_text().splitlines()
    lines[1400] = "oops," + lines[1400].split(",", 1)[1]
    path.write_text("\n".join(lines) + "\n")
    part = read(path, ["shoulder", "elbow"], sound_in=(4.0, 12.0))
    assert part.t[0] == 0.0 and 12.0 < part.t[-1] < 14.0
