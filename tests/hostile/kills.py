"""Commands that write, disturbed at any moment: what was there is whole, or what is new is.

`python -m hostile.kills --kills 200` kills as often, at random moments, and prints what was lost.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

from dynident import file_groups, files
from dynident.cli import main as command
from dynident.explorer.effect_choices import EffectChoice
from dynident.explorer.local_server import LocalServer
from hostile.worker import load_libraries
from hostile.writers import WRITERS, Writer, prepare

WRITING = {files: ("write_bytes", "write_text"), file_groups: ("_finish",)}
"""Code that writes: functions of a module, within which a command is killed."""
Fault = Callable[[], object]
"""Called in a process that is about to write, and spoils that."""


def _click(self: LocalServer) -> None:
    """Do what a click on the page of `dynident open` does, in the place of waiting for one."""
    opened = self.versions.latest()
    effect = opened.study.model + "coulomb_friction@elbow"
    choice = EffectChoice(effect=effect.effects[-1], group="others", words="")
    self.versions.write([choice], opened.digest, "tab")
    self.versions.stop()


def content(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder by its name from there."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def started(
    words: tuple[str, ...],
    folder: Path,
    before: Callable[[], object] = lambda: None,
    errors: int | None = None,
) -> int:
    """Run a command in a child of this process; return its number.

    Parameters
    ----------
    words : the command.
    folder : where it runs.
    before : called in the child before the command.
    errors : the descriptor that errors go to; None for nowhere.
    """
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    status = 3
    try:
        os.chdir(folder)
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent if errors is None else errors, 2)
        if errors is not None:
            _say_it_here()
        LocalServer.serve = _click
        before()
        command(words)
    except SystemExit as stop:
        status = int(stop.code or 0)
    finally:
        with contextlib.suppress(OSError):
            sys.stderr.flush()
        os._exit(status)


def _say_it_here() -> None:
    """Let Python write to the descriptors: pytest has put streams of its own in their place."""
    sys.stdout = os.fdopen(1, "w", closefd=False)
    sys.stderr = os.fdopen(2, "w", closefd=False)


def killed_within(lines: int) -> Fault:
    """Return what kills the process after some lines of the code that writes files."""
    return partial(sys.settrace, _killer(lines))


def no_room() -> None:
    """Let no file grow beyond some bytes, as a full disk does not."""
    # Python would cut its own bytecode short, and other tests would read that.
    sys.dont_write_bytecode = True
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, 20))


def _stopped_where_it_writes(faults: Sequence[Fault], test: Connection) -> None:
    """Let this process stop before it first writes, and try faults there.

    What comes before the writing is the same whatever the fault, and may be a whole diagnosis: it
    is done once. There a child is begun for each fault, which goes on from that moment; the test,
    told by `test`, looks at what it leaves and puts the folder back.
    """
    stopped = False

    def faults_come_first(function: Callable) -> Callable:
        @wraps(function)
        def run(*arguments: object, **options: object) -> object:
            nonlocal stopped
            first, stopped = not stopped, True
            if first and _survives(faults, test):
                test.close()
            return function(*arguments, **options)

        return run

    for module, names in WRITING.items():
        for name in names:
            setattr(module, name, faults_come_first(getattr(module, name)))


def _survives(faults: Sequence[Fault], test: Connection) -> bool:
    """Begin a child for each fault, and say whether this process is none of them."""
    test.send(None)
    for fault in faults:
        test.recv()
        end, start = os.pipe()
        child = os.fork()
        if not child:
            os.dup2(start, 2)
            _say_it_here()
            fault()
            return False
        os.close(start)
        with os.fdopen(end, "rb") as errors:
            said = errors.read().decode(errors="replace")
        test.send((finished(child), said))
    test.recv()
    return True


def _killer(lines: int) -> Callable:
    """Return a trace function that kills this process within the code that writes files."""
    left = lines

    def within(frame, event, _argument):
        nonlocal left
        if event == "line":
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return within

    def enter(frame, _event, _argument):
        code = frame.f_code
        here = (names for module, names in WRITING.items() if code.co_filename == module.__file__)
        return within if code.co_name in next(here, ()) else None

    return enter


def finished(child: int) -> int:
    """Wait for a child; return its status, below zero the signal that ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@dataclass(frozen=True, kw_only=True)
class Damage:
    """What a command that was disturbed left behind.

    Attributes
    ----------
    status : with which it ended, below zero the signal that ended it; it may have been done.
    said : on standard error.
    lost : what is gone, or half there.
    files : what is there.
    """

    status: int
    said: str = ""
    lost: list[str]
    files: dict[str, bytes]

    @property
    def killed(self) -> bool:
        return self.status == -signal.SIGKILL


@dataclass(frozen=True, kw_only=True)
class Written:
    """What a command writes.

    Attributes
    ----------
    before : the files that were there.
    damage : what each fault leaves.
    files : what there is where nothing disturbs it.
    seconds : that all took.
    """

    before: dict[str, bytes]
    damage: list[Damage]
    files: dict[str, bytes]
    seconds: float


def written(writer: Writer, faults: Sequence[Fault] = ()) -> Written:
    """Run a command to its end, and disturb it where it begins to write.

    Parameters
    ----------
    writer : the command; AssertionError if it fails.
    faults : each is tried from the moment before the first file is written.
    """
    with tempfile.TemporaryDirectory(prefix="kills.") as name:
        folder = Path(name)
        prepare(folder)
        before, begun = content(folder), time.monotonic()
        test, theirs = Pipe()
        child = started(writer.words, folder, lambda: _stopped_where_it_writes(faults, theirs))
        theirs.close()
        test.recv()  # EOFError where it ends, and has written nothing
        stopped, damage = _Kept.of(folder), []
        assert stopped.files == before, "it has written in another way"
        for _ in faults:
            test.send(None)
            status, said = test.recv()
            damage.append(_damage(writer, folder, before, status, said))
            stopped.put_back(folder)
        test.send(None)
        assert finished(child) in (0, 1), writer.words
        seconds = time.monotonic() - begun
        return Written(before=before, damage=damage, files=content(folder), seconds=seconds)


@dataclass(frozen=True)
class _Kept:
    """What a folder holds at some moment: its folders, and its files with their content."""

    folders: frozenset[Path]
    files: dict[str, bytes]

    @classmethod
    def of(cls, folder: Path) -> _Kept:
        return cls(frozenset(p for p in folder.rglob("*") if p.is_dir()), content(folder))

    def put_back(self, folder: Path) -> None:
        """Leave in the folder what was there, and touch nothing that is as it was."""
        inner_first = sorted(folder.rglob("*"), reverse=True)
        for path in inner_first:
            if path.is_dir():
                if path not in self.folders:
                    path.rmdir()
            elif str(path.relative_to(folder)) not in self.files:
                path.unlink()
        for path in sorted(self.folders):
            path.mkdir(exist_ok=True)
        now = content(folder)
        for name, data in self.files.items():
            if now.get(name) != data:
                (folder / name).write_bytes(data)


def _damage(
    writer: Writer, folder: Path, before: dict[str, bytes], status: int, said: str = ""
) -> Damage:
    """Look at what a command that ended with a status has left of what was there before."""
    after = content(folder)
    lost = [f"{file} is gone" for file in before if file not in after]
    for file, data in after.items():
        if before.get(file) == data:
            continue
        # The neighbour that was to take a place, or the folder of several.
        hidden = any(part.startswith(".") for part in Path(file).parts)
        if file in writer.results:
            try:
                writer.results[file](folder / file)
            except Exception as error:
                lost.append(f"{file} is broken: {error}")
        elif not hidden and not writer.may_write(file):
            lost.append(f"{file} is changed")
    if status == 0 and len(after) < len(before):
        lost.append("it said that all was well")
    return Damage(status=status, said=said, lost=lost, files=after)


def killed_after(writer: Writer, seconds: float) -> Damage:
    """Kill a command after some time, and look at what is left."""
    with tempfile.TemporaryDirectory(prefix="kills.") as name:
        folder = Path(name)
        prepare(folder)
        before = content(folder)
        child = started(writer.words, folder)
        time.sleep(seconds)
        os.kill(child, signal.SIGKILL)
        return _damage(writer, folder, before, finished(child))


def main() -> None:
    """Kill every command in turn, half of the times while it writes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    load_libraries()
    rng = random.Random(asked.seed)
    seconds = {name: written(writer).seconds for name, writer in WRITERS.items()}
    count, found = Counter(), []
    for number in range(asked.kills):
        name = list(WRITERS)[number % len(WRITERS)]
        writer = WRITERS[name]
        if (number // len(WRITERS)) % 2:
            lines = rng.randrange(30 * len(writer.results))
            (left,) = written(writer, [killed_within(lines)]).damage
        else:
            left = killed_after(writer, rng.uniform(0.0, 1.05 * seconds[name]))
        count["killed" if left.killed else "done before"] += 1
        found += [f"{name}: {one}" for one in left.lost]
    print(dict(count), *(found or ["nothing lost, nothing half"]), sep="\n")


if __name__ == "__main__":
    main()
