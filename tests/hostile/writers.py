"""Commands that write, the files that they read and replace, and who reads what they wrote."""

from __future__ import annotations

import tempfile
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.recording import write
from dynident.robot import Robot
from hostile.case import place
from hostile.experiments import EXPERIMENT
from laws_hidden import recordings as hidden_recordings
from loop_studies import LOOP_STUDY, write_loop_study
from study_files import CONTROLLER, STUDY, edited, write_study
from synthetic import ARM


@dataclass(frozen=True, kw_only=True)
class Writer:
    """A command that writes.

    Attributes
    ----------
    words : of the command.
    results : files that it writes, with what reads them or raises.
    folder : in which others may stand beside them.
    """

    words: tuple[str, ...]
    results: dict[str, Callable[[Path], object]]
    folder: str = ""

    def may_write(self, file: str) -> bool:
        """Whether a file is in the folder that it fills."""
        return bool(self.folder) and file.startswith(f"{self.folder}/")


def _page(path: Path) -> None:
    assert path.read_text().rstrip().endswith("</html>")


def _picture(path: Path) -> None:
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG") and b"IEND" in data[-12:]


def _tables(path: Path) -> None:
    assert di.read(path).samples > 2


def _reference(path: Path) -> None:
    assert np.loadtxt(path, delimiter=",", skiprows=1).shape[1] == 5


def _toml(path: Path) -> None:
    tomllib.loads(path.read_text())


WRITERS = {
    "add": Writer(
        words=("add", "study.toml", "coulomb_friction@elbow"), results={"study.toml": di.load}
    ),
    "fit": Writer(
        words=("fit", "study.toml", "--out", "fit.json", "--robot", "fit.urdf"),
        results={"fit.json": di.load_estimate, "fit.urdf": Robot.from_file},
    ),
    "refit": Writer(
        words=("refit", "arm.urdf", "--out", "new.urdf"), results={"new.urdf": Robot.from_file}
    ),
    "refit in place": Writer(
        words=("refit", "broken.urdf", "--out", "broken.urdf"),
        results={"broken.urdf": Robot.from_file},
    ),
    "init": Writer(
        words=("init", "arm.urdf", "train.csv", "test.csv", "--out", "draft.toml"),
        results={"draft.toml": di.load},
    ),
    "show": Writer(words=("show", "study.toml", "--to", "old.png"), results={"old.png": _picture}),
    "explain": Writer(
        words=("explain", "whole.toml", "--most", "0", "--report", "old.html"),
        results={"old.html": _page},
    ),
    "report": Writer(
        words=("report", "whole.toml", "--most", "0", "--to", "new.html"),
        results={"new.html": _page},
    ),
    "simulate": Writer(
        words=("simulate", "loop/study.toml", "--report", "loop.html", "--plot", "loop.png"),
        results={"loop.html": _page, "loop.png": _picture},
    ),
    "experiment": Writer(
        words=("simulate", "experiment.toml", "--out", "virtual"),
        results={"virtual/run1.csv": _tables, "virtual/study.toml": _toml},
        folder="virtual",
    ),
    "demo": Writer(words=("demo", "--to", "demo.html"), results={"demo.html": _page}),
    "demo of a design": Writer(
        words=("demo", "--design", "settled"),
        results={"settled/study.toml": _toml, "settled/next/design.toml": _toml},
        folder="settled",
    ),
    "design": Writer(
        words=("design", "study.toml", "--starts", "1", "--harmonics", "3", "--out", "next"),
        results={
            "next/reference.csv": _reference,
            "next/robot.urdf": Robot.from_file,
            "next/experiment.toml": _toml,
            "next/motion.html": _page,
            "next/design.toml": _toml,
        },
    ),
    "changes": Writer(
        words=("changes", "before.json", "after.json", "--to", "old.html"),
        results={"old.html": _page},
    ),
    "instruments": Writer(
        words=("fit", "loop/study.toml", "--method", "iv", "--plot", "old.png"),
        results={"old.png": _picture},
    ),
    "laws": Writer(
        words=("explain", "law/study.toml", "--most", "1", "--laws", "l.toml"),
        results={"l.toml": _toml},
    ),
    "open": Writer(words=("open", "study.toml", "--no-browser"), results={"study.toml": di.load}),
}

ALIKE = {"explain --design": "design"}
"""Options that write with the code of another writer, and take long to get there."""
IN_PLACE = ("add study", "open study")
"""Arguments that are written to as well as read."""
_OF_STUDIES = ("compare", "design", "diagnose", "explain", "fit", "payload", "report", "show")
READ = frozenset(
    {
        *(f"{one} study" for one in _OF_STUDIES),
        *(f"changes {one}" for one in ("before", "after", "--study", "--effects")),
        *(f"refit {one}" for one in ("what", "--study", "--effects", "--robot")),
        *("check robot", "check --effects", "design --limits", "init robot"),
        *("simulate file", "simulate --estimate"),
    }
)
"""Arguments and options that name files which are read, and left as they are."""

LONG = tuple(WRITERS.keys() - {"add", "fit", "refit", "init", "changes", "open"})
"""Commands that take seconds, in tests of which the others are in `make test-fast`."""
MARKED = [pytest.param(one, marks=pytest.mark.slow if one in LONG else ()) for one in WRITERS]
each_writer = pytest.mark.parametrize("name", MARKED)
WITH_CODE_OF_THEIR_OWN = [one for one in MARKED if one.values[0] != "demo of a design"]
"""Less `demo --design`, which begins to write as `simulate` does, with the experiment."""


def prepare(folder: Path) -> None:
    """Write what the commands read, and some of what they replace."""
    write_study(folder, STUDY + CONTROLLER)
    # Where nothing is missing, nothing is asked of what is left.
    complete = edited(('"viscous_friction"', '"viscous_friction", "coulomb_friction@elbow"'))
    place(folder / "whole.toml", complete + CONTROLLER)
    (folder / "loop").mkdir()
    write_loop_study(folder / "loop", LOOP_STUDY)
    robot = (folder / "arm.urdf").read_text()
    place(folder / "broken.urdf", robot.replace('ixx="0.01"', 'ixx="9"'))
    place(folder / "experiment.toml", EXPERIMENT)
    place(folder / "old.html", "<html>\nan older page</html>")
    place(folder / "old.png", b"\x89PNG older IEND\xae\x42\x60\x82")
    for name, text in zip(("before.json", "after.json"), _estimates(), strict=True):
        place(folder / name, text)
    (folder / "next").mkdir()
    for name, text in _older_design().items():
        place(folder / "next" / name, text)
    (folder / "law").mkdir()
    (folder / "law" / "arm.urdf").write_text(ARM)
    for one, text in zip(("train.csv", "test.csv"), _with_a_law(), strict=True):
        place(folder / "law" / one, text)
    place(folder / "law" / "study.toml", STUDY.replace(*_ALL_BUT_THE_LAW))


_ALL_BUT_THE_LAW = (
    'effects = ["viscous_friction"]',
    'effects = ["viscous_friction", "coulomb_friction", "joint_spring", "torque_ripple"]',
)


@cache
def _estimates() -> tuple[str, str]:
    """Two estimates of the arm, from recordings of their own."""
    with tempfile.TemporaryDirectory(prefix="kills.") as name:
        study = di.load(write_study(Path(name)))
        found = [di.fit(study.model, one) for one in (study.train, study.test)]
        first, second = (one.save(Path(name) / "fit.json").read_text() for one in found)
    return first, second


@cache
def _with_a_law() -> tuple[bytes, bytes]:
    """Two recordings of an arm with a law at its elbow that no catalogue has."""
    with tempfile.TemporaryDirectory(prefix="kills.") as name:
        made = hidden_recordings({"c*q*load": 0.2})[:2]
        first, second = (write(one, Path(name) / "one.csv").read_bytes() for one in made)
    return first, second


def _older_design() -> dict[str, str]:
    """Files as an earlier design left them."""
    return {
        "reference.csv": "t,q_ref.shoulder,v_ref.shoulder,q_ref.elbow,v_ref.elbow\n0,0,0,0,0\n",
        "robot.urdf": ARM,
        "experiment.toml": EXPERIMENT,
        "motion.html": "<html>\nan older page</html>",
        "design.toml": 'sentence = "older"\n',
    }
