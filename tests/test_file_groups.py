"""Files that belong together: after a kill the older ones are whole, or the new ones are."""

from __future__ import annotations

import os
import signal
import sys
import threading
from pathlib import Path

import pytest

from dynident import file_groups, files
from dynident.errors import FileError
from dynident.file_groups import groups_below, in_group, replaced_together

NAMES = ("a.txt", "b.txt", "only_old.txt", "sign.txt")
OLD = {"a.txt": "old a", "b.txt": "old b", "only_old.txt": "old", "sign.txt": "old"}
NEW = {"a.txt": "new a", "b.txt": "new b", "sign.txt": "new"}


def put(folder: Path, group: dict[str, str]) -> None:
    with replaced_together(folder, NAMES, last="sign.txt") as beside:
        for name, text in group.items():
            files.write_text(beside / name, text)


def seen(folder: Path) -> dict[str, str]:
    """What a reader finds of the group."""
    found = {name: in_group(folder, name) for name in NAMES}
    return {name: path.read_text() for name, path in found.items() if path.is_file()}


def left(folder: Path) -> set[str]:
    return {one.name for one in folder.iterdir()}


def killed(folder: Path, line: int) -> bool:
    """Put the new files in a child that is killed after some lines; whether it was."""

    def within(_frame, event, _argument):
        nonlocal line
        line -= event == "line"
        if line < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return within

    def enter(frame, _event, _argument):
        return within if frame.f_code.co_filename == file_groups.__file__ else None

    child = os.fork()
    if not child:
        sys.settrace(enter)
        put(folder, NEW)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here")
@pytest.mark.slow
def test_a_kill_at_any_line_loses_nothing(tmp_path: Path, monkeypatch) -> None:
    # The disk may take its time: a kill takes from no file what is written.
    monkeypatch.setattr(os, "fsync", lambda _: None)
    outcomes, line, running = set(), 0, True
    while running:
        # Each in a folder of its own: what is below all of them grows with the lines.
        above = tmp_path / str(line)
        folder = above / "group"
        above.mkdir()
        put(folder, OLD)
        (folder / "log.csv").write_text("of the user")
        running = killed(folder, line)
        found = seen(folder)
        # What goes with the older ones may still be there, or not, while the change is made.
        outcome = "old" if found == OLD else "new"
        if outcome == "new":
            assert {**found, **NEW} == found, line
        # Where the sign is in its place, so is all that it stands for.
        if (folder / "sign.txt").exists():
            whole = OLD if (folder / "sign.txt").read_text() == "old" else NEW
            assert {name: (folder / name).read_text() for name in whole} == whole
        outcomes.add(outcome)
        assert [one.name for one in groups_below(above, "sign.txt")] == ["sign.txt"]
        third = {"a.txt": "third", "sign.txt": "third"}
        put(folder, third)
        assert seen(folder) == third
        assert (folder / "log.csv").read_text() == "of the user"
        assert left(folder) == {*third, "log.csv"}
        line += 1
    assert outcomes == {"old", "new"} and line > 20


def test_what_fails_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    put(tmp_path, OLD)
    with pytest.raises(ZeroDivisionError), replaced_together(tmp_path, NAMES, "sign.txt") as beside:
        (beside / "a.txt").write_text("half")
        _ = 1 / 0
    assert seen(tmp_path) == OLD and left(tmp_path) == set(OLD)
    (tmp_path / "b.txt").unlink()
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(FileError, match=r"b.txt: is a folder"):
        put(tmp_path, NEW)
    assert left(tmp_path) == set(OLD)


def test_two_writers_leave_one_group(tmp_path: Path) -> None:
    """The second completes its files while those of the first wait."""
    put(tmp_path, OLD)
    with replaced_together(tmp_path, NAMES, last="sign.txt") as beside:
        for name in NAMES:
            files.write_text(beside / name, "second")
        put(tmp_path, NEW)
        assert seen(tmp_path) == NEW and beside.is_dir()
        os.mkdir(tmp_path / ".complete")
        (tmp_path / ".complete" / "a.txt").write_text("first")
    assert seen(tmp_path) == dict.fromkeys(NAMES, "second") and left(tmp_path) == set(NAMES)


def test_folders_of_the_user_stay(tmp_path: Path) -> None:
    for name in (".new.plan", ".new.my_notes", ".dynident-new.2026-11-23"):
        (tmp_path / name).mkdir()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / ".dynident-new.abcdefgh").symlink_to(elsewhere)
    put(tmp_path, NEW)
    assert left(tmp_path) == {
        *NEW,
        ".new.plan",
        ".new.my_notes",
        ".dynident-new.2026-11-23",
        ".dynident-new.abcdefgh",
        "elsewhere",
    }


@pytest.mark.slow
def test_who_changes_places_is_alone(tmp_path: Path, monkeypatch) -> None:
    """Another writer that ends while older files go waits, and its files are not among them."""
    put(tmp_path, OLD)
    third = dict.fromkeys(NAMES, "third")
    other = threading.Thread(target=put, args=(tmp_path, third))
    remove = files.remove

    def meanwhile(path: Path) -> None:
        if not other.ident:
            other.start()
            other.join(0.5)
        remove(path)

    monkeypatch.setattr(file_groups.files, "remove", meanwhile)
    put(tmp_path, NEW)
    other.join()
    assert seen(tmp_path) == third and left(tmp_path) == set(NAMES)
