"""A design in a folder that has one: what lies beside `design.toml` is never of another design."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynident import files
from dynident.closed_loop import Controller
from dynident.errors import FileError
from dynident.experiment_design import DesignTask, design
from dynident.experiment_design.design_files import EXPERIMENT, REFERENCE, write_design
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.experiment_design.written_design import DESIGN, MOTION_PAGE, motion_page
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

CONTROLLER = Controller(kind="pd", rate_hz=500.0, kp=(10.0, 10.0), kd=(2.0, 2.0))
FIRST, SECOND = "<p>first</p>", "<p>second</p>"


@pytest.fixture(scope="module")
def designed() -> RecordingDesign:
    model = Model(arm()) + "viscous_friction"
    data = Dataset((synthetic(model, true_values(model), 1, torque_std=0.05),))
    return design(model, data, DesignTask(duration=4.0, harmonics=2, starts=1))


def names(folder: Path) -> set[str]:
    return {one.name for one in folder.iterdir()}


def content(folder: Path) -> dict[str, bytes]:
    return {one.name: one.read_bytes() for one in folder.iterdir()}


def test_what_an_earlier_design_left_goes(designed, tmp_path) -> None:
    written = write_design(designed, tmp_path, 100.0, CONTROLLER, motion=FIRST)
    assert written[-1].name == DESIGN and {one.name for one in written} == names(tmp_path)
    assert names(tmp_path) >= {REFERENCE, EXPERIMENT, MOTION_PAGE}
    assert motion_page(tmp_path) == FIRST.encode()
    write_design(designed, tmp_path, 100.0, CONTROLLER, motion=SECOND)
    assert motion_page(tmp_path) == SECOND.encode()
    write_design(designed, tmp_path, 100.0, None)
    assert motion_page(tmp_path) is None
    assert names(tmp_path) & {DESIGN, EXPERIMENT, MOTION_PAGE, REFERENCE} == {DESIGN, REFERENCE}


@pytest.mark.parametrize("written", range(5))
def test_a_design_that_is_cut_short_leaves_the_older(
    designed, tmp_path, monkeypatch, written
) -> None:
    """Whichever file is the one that the disk has no room for."""
    write_design(designed, tmp_path, 100.0, CONTROLLER, motion=FIRST)
    older = content(tmp_path)
    left, whole = [written], files.write_bytes

    def write_bytes(path, *rest):
        if left[0] == 0:
            raise FileError("cannot be written", str(path))
        left[0] -= 1
        return whole(path, *rest)

    monkeypatch.setattr(files, "write_bytes", write_bytes)
    with pytest.raises(FileError, match="cannot be written"):
        write_design(designed, tmp_path, 100.0, CONTROLLER, motion=SECOND)
    assert content(tmp_path) == older
    monkeypatch.undo()
    write_design(designed, tmp_path, 100.0, CONTROLLER, motion=SECOND)
    assert motion_page(tmp_path) == SECOND.encode() and set(content(tmp_path)) == set(older)


def test_what_cannot_be_replaced_is_told_before_anything_is_written(designed, tmp_path) -> None:
    (tmp_path / MOTION_PAGE).mkdir()
    with pytest.raises(FileError, match=r"motion.html: is a folder, not a file"):
        write_design(designed, tmp_path, 100.0, CONTROLLER, motion=FIRST)
    assert names(tmp_path) == {MOTION_PAGE}
