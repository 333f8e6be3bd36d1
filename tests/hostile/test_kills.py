"""Killed in the middle, no room on the disk, two at once: nothing is lost, and nothing is half."""

from __future__ import annotations

import os

import pytest

from hostile.kills import WRITERS, at_line, at_moment, damage, each_writer, uninterrupted

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here"),
    pytest.mark.usefixtures("libraries"),
]
LINES = (2, 9, 17)


@each_writer
def test_a_kill_leaves_the_old_or_the_new(name):
    writer = WRITERS[name]
    for line in LINES:
        killed, lost = damage(writer, at_line(writer, line))
        assert killed and lost == []
    _, lost = damage(writer, at_moment(writer, 0.05))
    assert lost == []


@each_writer
def test_what_nobody_kills_is_written(name):
    files = uninterrupted(WRITERS[name]).files
    assert set(WRITERS[name].results) <= set(files)
