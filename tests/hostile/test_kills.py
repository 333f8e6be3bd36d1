"""Killed in the middle, or no room on the disk: nothing is lost, and nothing is half."""

from __future__ import annotations

import os
from pathlib import Path

import click
import pytest

from dynident.cli import commands, main
from hostile.kills import Written, content, killed_after, killed_within, no_room, written
from hostile.writers import ALIKE, IN_PLACE, READ, WITH_CODE_OF_THEIR_OWN, WRITERS, Writer, prepare

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here"),
    pytest.mark.usefixtures("libraries"),
]
LINES = (2, 9, 17)


@pytest.fixture(scope="module", params=WITH_CODE_OF_THEIR_OWN)
def writer(request: pytest.FixtureRequest) -> Writer:
    return WRITERS[request.param]


@pytest.fixture(scope="module")
def disturbed(writer: Writer) -> Written:
    """What becomes of a command whose process is killed, or whose disk is full, as it writes.

    Most of its time goes into what comes before the writing, which is done once.
    """
    return written(writer, [*map(killed_within, LINES), no_room])


def test_a_kill_leaves_the_old_or_the_new_and_no_kill_the_new(
    writer: Writer, disturbed: Written
) -> None:
    *killed, _ = disturbed.damage
    assert [(one.killed, one.lost) for one in killed] == [(True, [])] * len(LINES)
    assert set(writer.results) <= set(disturbed.files)
    assert killed_after(writer, 0.05).lost == []


def test_no_room_leaves_the_old_files_and_one_line(writer: Writer, disturbed: Written) -> None:
    full = disturbed.damage[-1]
    assert full.status == 2
    lines = [line for line in full.said.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1 and "Traceback" not in full.said, full.said
    # What fills a folder may have written what was small enough.
    left = {k: v for k, v in full.files.items() if not writer.may_write(k)}
    assert left == disturbed.before


def test_every_command_that_writes_is_among_those_that_are_killed() -> None:
    """Whatever names a file in a command is said to be read alone, or is written by a writer."""
    named = {
        f"{name} {one.opts[0]}"
        for name, command in commands.commands.items()
        for one in command.params
        if isinstance(one.type, click.Path | click.File)
    }
    killed = {
        f"{one.words[0]} {word}"
        for one in WRITERS.values()
        for word in one.words
        if word[:2] == "--"
    }
    in_place = {one for one in IN_PLACE if one.split()[0] in {w.words[0] for w in WRITERS.values()}}
    alike = {option for option, writer in ALIKE.items() if writer in WRITERS}
    written = {one for one in killed if one in named} | in_place | alike
    assert not written & READ
    assert written | READ == named
    assert commands.commands.keys() == {one.split()[0] for one in named}


@pytest.mark.slow
def test_commands_that_name_no_file_to_write_leave_the_folder_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = {one.words[0] for one in WRITERS.values()}
    only_read = set(commands.commands) - written
    assert only_read == {"check", "compare", "diagnose", "payload"}
    prepare(tmp_path)
    before = content(tmp_path)
    monkeypatch.chdir(tmp_path)
    for name in sorted(only_read):
        with pytest.raises(SystemExit):
            main((name, "arm.urdf" if name == "check" else "whole.toml"))
    assert content(tmp_path) == before
