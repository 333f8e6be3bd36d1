"""A limit to how long an answer may take."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_AGAIN_S = 5.0  # a callback from a compiled library may swallow what is raised in it


class TimeUp(BaseException):
    """The limit has passed: not an `Exception`, which the code that is stopped might handle."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimeUp` in what is inside once so many seconds of wall-clock time have passed.

    A compiled function is stopped when it returns. Only the main thread of a process can be stopped
    so: joblib's own workers run cases there, Dask's threads do not, and have no limit.

    Parameters
    ----------
    seconds : the limit, s; 0 for none.
    """
    if not seconds or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: object) -> None:
        raise TimeUp

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds, _AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
