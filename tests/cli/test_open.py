"""What `dynident open` refuses; what it serves is tested in `explorer`."""

from __future__ import annotations

import importlib.util


def test_without_dash_it_says_what_to_install(run, study, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    done = run("open", study())
    assert (done.status, done.out) == (2, "")
    assert done.err == "error: the page needs Dash. pip install 'dynident[app]'\n"


def test_what_is_no_study_is_not_served(run, study):
    done = run("open", study("robot = 3"), "--no-browser")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("error: ") and done.err.count("\n") == 1
