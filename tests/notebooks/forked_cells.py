"""Cells of a notebook in a child of this process, which has loaded the libraries already.

A kernel of its own imports for as long as many a notebook computes. What a kernel does with a cell
IPython's shell does too: it shows what is displayed, draws what is left open, and prints warnings.
"""

from __future__ import annotations

import logging
import os
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType

from hostile.kills import finished
from hostile.worker import load_libraries

INLINE = "module://matplotlib_inline.backend_inline"
"""Where a kernel lets Matplotlib draw."""


@dataclass(frozen=True)
class CellOutcome:
    """What became of a cell: its traceback, if it failed, and what it wrote to standard error."""

    failure: str
    errors: str


@cache
def load_everything() -> None:
    """Import what notebooks import, so that children have it."""
    import IPython.core.interactiveshell
    import matplotlib_inline.backend_inline
    import pandas
    from matplotlib import font_manager, get_data_path

    load_libraries()
    assert IPython and matplotlib_inline and pandas
    # The list of fonts that this machine keeps may be of other times.
    for font in (Path(get_data_path()) / "fonts" / "ttf").glob("*.ttf"):
        font_manager.fontManager.addfont(font)


def run_cells(sources: Sequence[str], folder: Path, patience: float) -> Iterator[CellOutcome]:
    """Run cells one after the other in a process of their own, up to the first that fails.

    Parameters
    ----------
    sources : of the cells.
    folder : where they run.
    patience : in seconds, for each cell; TimeoutError if one takes longer.
    """
    load_everything()
    test, theirs = Pipe()
    sys.stdout.flush()
    child = os.fork()
    if not child:
        status = 1
        try:
            os.chdir(folder)
            _run(sources, theirs)
            status = 0
        finally:
            os._exit(status)
    theirs.close()
    try:
        for source in sources:
            if not test.poll(patience):
                raise TimeoutError(f"in {patience} s a cell does not end:\n{source}")
            outcome = test.recv()
            yield outcome
            if outcome.failure:
                return
    finally:
        test.close()
        os.kill(child, 9)
        finished(child)


def _run(sources: Sequence[str], test: Connection) -> None:
    from IPython.core.interactiveshell import InteractiveShell
    from IPython.utils.capture import capture_output
    from matplotlib import pyplot
    from traitlets.config import Config

    _as_python_begins()
    pyplot.switch_backend(INLINE)
    quiet = Config({"HistoryManager": {"enabled": False}})
    shell = InteractiveShell.instance(config=quiet, user_module=ModuleType("__main__"))
    sys.path.insert(0, "")
    for source in sources:
        with capture_output() as said:
            done = shell.run_cell(source, store_history=True)
        failed = done.error_before_exec or done.error_in_exec
        lines = traceback.format_exception(failed) if failed else []
        test.send(CellOutcome("".join(lines), said.stderr))


def _as_python_begins() -> None:
    """Let warnings and the log be said as they are where no test listens."""

    def to_stderr(message, category, filename, lineno, file=None, line=None) -> None:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))

    warnings.resetwarnings()
    for unseen in (ImportWarning, PendingDeprecationWarning, DeprecationWarning, ResourceWarning):
        warnings.simplefilter("ignore", unseen)
    warnings.filterwarnings("default", category=DeprecationWarning, module="__main__")
    warnings.showwarning = to_stderr
    logging.getLogger().handlers.clear()
