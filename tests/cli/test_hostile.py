"""Impossible numbers that are refitted: one line, no traceback."""

from __future__ import annotations

import re

import pytest

from dynident.inertia import PARAMETERS
from study_files import listing
from synthetic import ARM


def refused(run, folder, message: str, *arguments: str) -> None:
    before = listing(folder)
    done = run(*arguments)
    assert done.status == 2 and done.out == "", done
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert "Traceback" not in done.err and "encountered" not in done.err
    assert re.search(message, done.err), done.err
    assert listing(folder) == before


FILES = {
    "arm.urdf": (
        (ARM.replace('mass value="4"', 'mass value="1e308"'), r"link 'upper': .*\(m = 1e\+308, "),
        (ARM.replace('mass value="4"', 'mass value="1e-300"'), r"link 'upper': .*\(m = 1e-300\)"),
        (ARM.replace('ixx="0.01"', 'ixx="-1e200"'), r"'upper': is beyond any robot \(Ixx = -1e"),
        (ARM.replace('ixx="0.01"', 'ixx="nan"'), r"'upper': is not finite \(Ixx = nan"),
        ("", r"arm.urdf: is empty"),
        ("junk\n", r"arm.urdf: .*XML"),
    ),
    "arm.sdf": (("m,1\n", r"arm.sdf: .*XML"), (" \n", r"is empty")),
    "arm.XML": (("junk", r"arm.XML: .*XML"),),
    "fit.json": (("", r"fit.json: is empty"), ("junk", r"is not a dynident estimate \(not JSON")),
    "mine.csv": (("", r"mine.csv: is empty"), ("junk", r"is taken for a CSV")),
}


@pytest.mark.parametrize(
    ("name", "text", "message"), [(n, t, m) for n, cases in FILES.items() for t, m in cases]
)
def test_files_that_cannot_be_refitted(run, tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    refused(run, tmp_path, message, "refit", name, "--out", "new.urdf")


def test_what_is_believed_is_held_to_the_same(run, tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "huge.urdf").write_text(ARM.replace('mass value="4"', 'mass value="1e308"'))
    more = ("--robot", "huge.urdf", "--out", "new.urdf")
    refused(run, tmp_path, r"huge.urdf: link 'upper': .*1e\+308", "refit", "arm.urdf", *more)


@pytest.mark.parametrize("value", ["1e308", "-1e308", "1e30"])
def test_numbers_in_a_csv_beyond_any_robot(run, tmp_path, value):
    (tmp_path / "arm.urdf").write_text(ARM)
    rows = [f"{p}.{link},1" for link in ("upper", "fore") for p in PARAMETERS]
    rows[9] = f"Izz.upper,{value}"
    (tmp_path / "mine.csv").write_text("\n".join(["name,value", *rows]))
    more = ("--robot", "arm.urdf", "--out", "new.urdf")
    message = rf"mine.csv, name Izz.upper: '{re.escape(value)}' is no property of a robot"
    refused(run, tmp_path, message, "refit", "mine.csv", *more)
