"""Times of the processor and peak memory."""

from __future__ import annotations

import math
import resource
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import TypeVar

T = TypeVar("T")

_STATUS, _FORGET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def spent() -> float:
    """CPU time of the process and of its children that ended, a compiler say, in s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def cpu(what: Callable[[], T], repeats: int = 1) -> tuple[float, T]:
    """Median time of the process, user and system, in s, and the last answer."""
    times = []
    while True:
        start = spent()
        answer = what()
        times.append(spent() - start)
        if len(times) >= repeats:
            return median(times), answer


def added_mib(what: Callable[[], object]) -> float:
    """Most memory that the process held during a call above what it held before, MiB.

    Where the system does not tell what is held now, above the most that was held before.
    """
    try:
        _FORGET.write_text("5")  # the peak begins anew
        before = _status("VmRSS")
    except (OSError, StopIteration):
        before = _peak()
    what()
    return _peak() - before


def added_own_mib(what: Callable[[], object]) -> float:
    """Most memory without a file behind it during a call above what was held before, MiB.

    Looked at every 2 ms. NaN where the system does not tell.
    """
    try:
        before = most = _status("RssAnon")
    except (OSError, StopIteration):
        what()
        return math.nan
    done = threading.Event()

    def watch() -> None:
        nonlocal most
        while not done.wait(0.002):
            most = max(most, _status("RssAnon"))

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        what()
    finally:
        done.set()
        watcher.join()
    return most - before


def _peak() -> float:
    try:
        # Of this program alone: what `getrusage` says begins with that of whoever started it.
        return _status("VmHWM")
    except (OSError, StopIteration):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / (2**20 if sys.platform == "darwin" else 2**10)


def _status(name: str) -> float:
    """A size in MiB that the system keeps of this process."""
    lines = _STATUS.read_text().splitlines()
    return int(next(line for line in lines if line.startswith(f"{name}:")).split()[1]) / 2**10
