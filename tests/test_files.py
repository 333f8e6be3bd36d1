"""What is written takes the place of a file, and of nothing but a file."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

import dynident as di
from dynident import files
from dynident.errors import FileError
from dynident.recording.formats.write import write as write_recording
from dynident.robot import Robot
from dynident.robot.patching import write as write_robot
from dynident.robot.verify import write_verified
from dynident.study import add_effects
from study_files import STUDY, write_study
from synthetic import ARM, arm, synthetic, true_values

Writer = Callable[[Path], object]
MODEL = di.Model(arm())
RECORDING = synthetic(MODEL, true_values(MODEL), duration=8.0, rate_hz=100.0, torque_std=0.1)
WRITERS: dict[str, tuple[str, Writer]] = {
    "bytes": ("a.bin", lambda path: files.write_bytes(path, b"new")),
    "text": ("a.txt", lambda path: files.write_text(path, "new")),
    "recording": ("a.csv", lambda path: write_recording(RECORDING, path)),
    "robot": ("a.urdf", lambda path: write_robot(arm(), path)),
    "verified robot": ("a.urdf", lambda path: write_verified(arm(), path)),
    "estimate": ("a.json", lambda path: di.fit(MODEL, RECORDING).save(path)),
}
OLD = ARM.replace("arm", "old")


@pytest.mark.parametrize(("name", "write"), WRITERS.values(), ids=WRITERS)
def test_a_pipe_stays_a_pipe(name, write, tmp_path):
    os.mkfifo(tmp_path / name)
    (tmp_path / f"link{Path(name).suffix}").symlink_to(name)
    for path in (tmp_path / name, tmp_path / f"link{Path(name).suffix}"):
        for refused in (write, files.require_place):
            with pytest.raises(FileError, match="is not a regular file, but a device") as told:
                refused(path)
            assert told.value.where == str(path) and "\n" not in str(told.value)
    assert stat.S_ISFIFO((tmp_path / name).stat().st_mode)
    assert len(list(tmp_path.iterdir())) == 2  # no temporary file is left


@pytest.mark.parametrize(("name", "write"), WRITERS.values(), ids=WRITERS)
def test_a_link_stays_a_link(name, write, tmp_path):
    """Relative and in another folder, and a link to a link; the target keeps its permissions."""
    (tmp_path / "there").mkdir()
    (tmp_path / "here").mkdir()
    target, path = tmp_path / "there" / name, tmp_path / "here" / name
    target.write_text(OLD)
    target.chmod(0o640)
    (tmp_path / "middle").symlink_to(Path("there") / name)
    path.symlink_to("../middle")
    files.require_place(path)
    write(path)
    assert path.is_symlink() and (tmp_path / "middle").is_symlink()
    assert target.read_text() != OLD and not target.is_symlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert os.listdir(tmp_path / "here") == os.listdir(tmp_path / "there") == [name]


def test_a_link_to_nothing_yet_makes_its_target(tmp_path):
    path = tmp_path / "link"
    path.symlink_to("target")
    files.write_text(files.require_place(path), "new")
    assert path.is_symlink() and (tmp_path / "target").read_text() == "new"
    lost = tmp_path / "lost"
    lost.symlink_to("nowhere/target")
    with pytest.raises(FileError, match="no such folder"):
        files.require_place(lost)
    with pytest.raises(FileError, match="cannot be written"):
        files.write_text(lost, "new")


def test_links_to_folders_and_in_circles(tmp_path):
    (tmp_path / "folder").mkdir()
    for name, to, words in (("a", "folder", "is a folder"), ("b", "b", "cannot be written")):
        (tmp_path / name).symlink_to(to)
        for refused in (files.require_place, lambda path: files.write_text(path, "new")):
            with pytest.raises(FileError, match=words):
                refused(tmp_path / name)
        assert (tmp_path / name).is_symlink()


def test_a_failed_verification_leaves_the_target_of_a_link(tmp_path):
    def refuse(_: Path) -> None:
        raise FileError("no")

    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    with pytest.raises(FileError):
        files.write_bytes(tmp_path / "link", b"new", refuse)
    assert (tmp_path / "target").read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["link", "target"]


def test_effects_are_added_to_a_study_through_its_link(tmp_path):
    study = write_study(tmp_path, STUDY)
    link = tmp_path / "linked.toml"
    link.symlink_to(study.name)
    (effect,) = (di.Model(Robot.from_text(ARM)) + "joint_spring@elbow").effects
    add_effects(link, (effect,))
    assert link.is_symlink() and "joint_spring@elbow" in study.read_text()
