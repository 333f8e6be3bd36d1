"""Runs hostile cases one after the other, each within its share of memory and processor time.

`python -m hostile.worker` reads the kind and the name of a case from standard input, one case a
line with a tab between them, and answers each with a line of JSON. A case beyond its share of time
ends the process: whoever asks gets no answer, and starts another for the next case.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import resource
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from hostile.case import HostileCase

MOST_SECONDS = 10
"""Of processor time, that a command may take."""
MOST_BYTES = 1 << 30
"""That a case may take beside what the libraries have taken."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one command left behind."""

    status: int
    out: str = ""
    err: str = ""
    changed: list[str] = field(default_factory=list)


def main() -> None:
    """Run what standard input names."""
    from hostile.corpus import KINDS, corpus

    tables = {kind: corpus(kind) for kind in KINDS}
    asked = os.fdopen(os.dup(0))
    # Commands find an end where they read, not the next case.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    load_libraries()
    forget_garbage()
    limit_memory()
    for line in asked:
        kind, name = line.rstrip("\n").split("\t")
        print(json.dumps([asdict(one) for one in _tried(tables[kind][name])]), flush=True)


def load_libraries() -> None:
    """Import what commands import when they need it: it is no memory of theirs."""
    import matplotlib.backends.backend_agg
    import plotly.graph_objects  # noqa: F401

    import dynident.diagnosis  # noqa: F401
    import dynident.reporting  # noqa: F401
    import dynident.study  # noqa: F401
    import dynident.study_draft
    import dynident.validation  # noqa: F401
    from dynident.robot import Robot
    from synthetic import ARM

    assert dynident.study_draft and matplotlib and Robot.from_text(ARM).n == 2


def forget_garbage() -> None:
    """Free what is left in circles; what is there after that is looked at no more."""
    gc.collect()
    gc.freeze()


def limit_memory() -> None:
    """Refuse this process more memory than it has and `MOST_BYTES`."""
    used = next(
        int(line.split()[1]) << 10
        for line in Path("/proc/self/status").read_text().splitlines()
        if line.startswith("VmData")
    )
    resource.setrlimit(resource.RLIMIT_DATA, (used + MOST_BYTES, used + MOST_BYTES))


def limit_time() -> None:
    """End this process when it has used `MOST_SECONDS` from now on, even in native code."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    end = int(used.ru_utime + used.ru_stime) + 1 + MOST_SECONDS
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (end, hard))


def _tried(case: HostileCase) -> Iterator[Outcome]:
    with tempfile.TemporaryDirectory(prefix="hostile.") as name:
        folder = Path(name)
        case.write(folder)
        before = listing(folder)
        for arguments in case.commands:
            # What the last one left in circles is no memory of this one. What it has imported
            # stays, and would be gone through before every command from then on.
            forget_garbage()
            limit_time()
            with contextlib.chdir(folder):
                status, out, err = run(case.run, arguments)
            after = listing(folder)
            changed = sorted(key for key in before | after if before.get(key) != after.get(key))
            yield Outcome(status=status, out=out, err=err, changed=changed)


def run(
    command: Callable[[tuple[str, ...]], object], arguments: tuple[str, ...]
) -> tuple[int, str, str]:
    """Run a command here; return its status and what it wrote, native code too."""
    with _captured() as said, warnings.catch_warnings():
        try:
            command(arguments)
            status = -1
        except SystemExit as stop:
            status = int(stop.code or 0)
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr)
            status = -2
    return status, said[0], said[1]


@contextlib.contextmanager
def _captured() -> Iterator[list[str]]:
    """Collect what goes to standard output and standard error, by whoever."""
    said: list[str] = []
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        kept = [os.dup(number) for number in (1, 2)]
        sys.stdout.flush()
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        try:
            yield said
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for number, old in enumerate(kept, start=1):
                os.dup2(old, number)
                os.close(old)
            for stream in (out, err):
                stream.seek(0)
                said.append(stream.read(1 << 20).decode(errors="replace"))


def listing(folder: Path) -> dict[str, tuple[int, int, int]]:
    """What is below a folder: kind, size and time of the last change; nothing is followed."""
    found = {}
    for path in folder.rglob("*"):
        entry = path.lstat()
        # Of folders only that they are there: temporary files change their times.
        is_file = not path.is_dir()
        found[str(path.relative_to(folder))] = (
            entry.st_mode,
            entry.st_size * is_file,
            entry.st_mtime_ns * is_file,
        )
    return found


if __name__ == "__main__":
    main()
