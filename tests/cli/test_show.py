"""`dynident show` draws what a study has read."""

from __future__ import annotations

import pytest

from study_files import STUDY, listing


@pytest.mark.parametrize(
    ("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_a_picture_is_drawn_and_a_table_printed(run, study, tmp_path, suffix, start):
    done = run("show", study(), "--to", f"seen.{suffix}")
    assert done.status == 0 and done.err == ""
    assert "train.csv" in done.out and "8 s, to" in done.out and f"seen.{suffix}" in done.out
    assert (tmp_path / f"seen.{suffix}").read_bytes().startswith(start)


def test_several_entries_of_one_file_are_one_line(run, study):
    entries = '\n[[recordings]]\nfile = "train.csv"\nwindow = [{}, {}]\nuse = "{}"\n'
    text = STUDY.partition("[[recordings]]")[0]
    text += entries.format(0, 9, "train") + entries.format(9, 16, "test")
    (one,) = run("show", study(text), "--json").json["recordings"]
    assert one["name"] == "train.csv" and one["uses"] == {"train": 1, "test": 1}
    assert one["duration"] == 16.0 and one["period"] is None


@pytest.mark.slow
def test_what_a_file_holds_and_is_not_read_is_said(run, study, tmp_path):
    path = study()
    lines = (tmp_path / "train.csv").read_text().splitlines()
    (tmp_path / "train.csv").write_text("\n".join([*lines[:9], "# a pause", *lines[9:], ""]))
    done = run("show", path)
    said = "Not read of train.csv: 1 line of comment among the samples."
    assert said in " ".join(done.out.split())
    first, second = run("show", path, "--json").json["recordings"]
    assert first["not_read"] == ["1 line of comment among the samples"]
    assert second["not_read"] == []


def test_bad_places_are_refused_before_anything_is_read(run, study, tmp_path):
    path = study()
    before = listing(tmp_path)
    for to, words in (("seen.gif", "no kind of picture"), ("no/seen.png", "no such folder")):
        done = run("show", path, "--to", to)
        assert done.status == 2 and done.out == "" and words in done.err
    assert listing(tmp_path) == before
