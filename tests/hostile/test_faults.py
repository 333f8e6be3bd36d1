"""A folder that may not be written, two at once, no reader, no HOME."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import dynident as di
from hostile.kills import content, finished, started
from hostile.writers import WRITERS, each_writer, prepare

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here"),
    pytest.mark.usefixtures("libraries"),
]


def as_nobody() -> None:
    """Give up the rights of root, whom no folder keeps out."""
    if os.getuid() == 0:
        os.setuid(65534)


@each_writer
def test_a_folder_that_may_not_be_written_stays_as_it_is(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    prepare(folder)
    before = content(folder)
    os.chmod(folder, 0o555)
    for above in tmp_path.parents:
        if above.stat().st_mode & 0o005 != 0o005 and above.stat().st_uid == os.getuid():
            os.chmod(above, above.stat().st_mode | 0o055)
    os.chmod(tmp_path, 0o755)
    try:
        with (tmp_path / "said").open("wb") as errors:
            child = started(WRITERS[name].words, folder, as_nobody, errors.fileno())
        status, said = finished(child), (tmp_path / "said").read_text(errors="replace")
    finally:
        os.chmod(folder, 0o755)
    assert status == 2 and "error: " in said and "Traceback" not in said, said
    assert content(folder) == before


@pytest.mark.slow
def test_two_that_add_at_once_leave_one_answer_or_both(tmp_path: Path) -> None:
    for round_ in range(5):
        folder = tmp_path / str(round_)
        folder.mkdir()
        prepare(folder)
        asked = ("coulomb_friction@elbow", "joint_spring@shoulder")
        children = [started(("add", "study.toml", one), folder) for one in asked]
        statuses = [finished(child) for child in children]
        there = {effect.label for effect in di.load(folder / "study.toml").model.effects}
        for one, status in zip(asked, statuses, strict=True):
            # Whoever was told that it is written finds it; whoever was refused does not.
            assert status in (0, 2) and (one in there) == (status == 0), (statuses, there)
        assert 0 in statuses and not [k for k in content(folder) if Path(k).name.startswith(".")]


ONE_AFTER_THE_OTHER = """
from dynident.cli import main
for words in {words!r}:
    try:
        main(words)
    except SystemExit as stop:
        if stop.code not in (None, 0, 1):
            raise
"""


def added_and_fitted(folder: Path, around: dict[str, str]) -> tuple[bytes, bytes]:
    """The study and the robot that two commands write, of one process."""
    folder.mkdir()
    prepare(folder)
    words = (WRITERS["add"].words, WRITERS["fit"].words)
    done = subprocess.run(
        [sys.executable, "-c", ONE_AFTER_THE_OTHER.format(words=words)],
        cwd=folder,
        env={**os.environ, **around},
        capture_output=True,
        timeout=120,
    )
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr
    return (folder / "study.toml").read_bytes(), (folder / "fit.urdf").read_bytes()


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    return added_and_fitted(tmp_path_factory.mktemp("surroundings") / "usual", {})


@pytest.mark.slow
@pytest.mark.parametrize(
    "around",
    [
        {
            "LC_ALL": "tr_TR.UTF-8",
            "HOME": "/nowhere/at/all",
            "XDG_CACHE_HOME": "/dev/null/x",
            "XDG_CONFIG_HOME": "",
        },
        {"LC_ALL": "C", "PYTHONIOENCODING": "ascii", "HOME": ""},
    ],
    ids=["Turkish without HOME", "ASCII with an empty HOME"],
)
def test_odd_surroundings_change_no_file(usual, around: dict[str, str], tmp_path: Path) -> None:
    assert added_and_fitted(tmp_path / "odd", around) == usual


@pytest.mark.slow
def test_a_reader_that_has_gone_loses_no_file(tmp_path: Path) -> None:
    prepare(tmp_path)
    end, start = os.pipe()
    os.close(end)
    words = WRITERS["fit"].words
    command = [sys.executable, "-m", "dynident.cli", *words]
    with os.fdopen(start, "wb") as gone:
        done = subprocess.run(
            command, cwd=tmp_path, stdout=gone, stderr=subprocess.PIPE, timeout=120
        )
    assert b"Traceback" not in done.stderr and b"Exception ignored" not in done.stderr
    for name, reads in WRITERS["fit"].results.items():
        reads(tmp_path / name)
