"""What is being done, for logs and notebooks: a line now and then, while it takes long."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable

EVERY = 10.0
"""s between lines, and before the first one."""
LOG = logging.getLogger("dynident")
"""The lines are information: `logging.basicConfig(level="INFO")` shows them in a script."""


def logged(title: str) -> Callable[..., None]:
    """Return a display of progress that writes to the log, at most a line every ten seconds.

    In a notebook, where nothing else is set up, the lines are printed to standard error.

    Parameters
    ----------
    title : what is being done, as a whole.
    """
    if "ipykernel" in sys.modules:
        to_standard_error()
    started = last = time.monotonic()

    def show(doing: object = "", done: float | None = None, total: float | None = None) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < EVERY:
            return
        last = now
        part = f", {100 * done / total:.0f} %" if done is not None and total else ""
        LOG.info("%s: %s%s (%.0f s)", title, doing, part, now - started)

    return show


def to_standard_error() -> None:
    """Print the log's lines to standard error, unless logging has been set up."""
    if LOG.handlers or logging.getLogger().handlers:
        return
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    LOG.addHandler(handler)
    if LOG.level == logging.NOTSET:
        LOG.setLevel(logging.INFO)
