"""Progress in logs: a line now and then, none of what is quick."""

from __future__ import annotations

import itertools

import pytest

from dynident.progress import EVERY, logged


def test_a_line_every_ten_seconds(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    caplog.set_level("INFO", logger="dynident")
    clock = itertools.count(0.0, EVERY / 4)
    monkeypatch.setattr("dynident.progress.time.monotonic", lambda: next(clock))
    show = logged("diagnosing")
    for k in range(1, 10):
        show("scoring", k, 20)
    assert caplog.messages == [
        "diagnosing: scoring, 20 % (10 s)",
        "diagnosing: scoring, 40 % (20 s)",
    ]


def test_what_is_quick_says_nothing(caplog) -> None:
    caplog.set_level("INFO", logger="dynident")
    logged("fitting")("a step")
    assert caplog.messages == []
