"""Whole commands as a user types them: processor, wall clock and memory of the process."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from side_by_side.line import Benchmark, Line, Size

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"
STUDIES = {"two joints": "hidden_effect", "seven joints": "seven_joint_arm"}
IMPORTS = "import pinocchio, scipy.signal, pandas, pydrake.multibody.plant"


WAYS = {"dynident": "auto", "dynident, no compiler": "never"}
"""And what the environment says of compiling."""


def measured(command: list[str], cache: str, compiling: str = "auto") -> dict[str, float]:
    """CPU time, wall clock and peak memory of a command."""
    start = time.perf_counter()
    environment = {**os.environ, "XDG_CACHE_HOME": cache, "DYNIDENT_COMPILE": compiling}
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(command)} ended with status {process.returncode}")
    return {
        "CPU, s": used.ru_utime + used.ru_stime,
        "of the system, s": used.ru_stime,
        "wall, s": time.perf_counter() - start,
        "peak memory, MiB": used.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10),
    }


def lines(size: Size) -> Iterator[Line]:
    asked = {
        f"{verb}, {what}": [verb, str(PROBLEMS / folder / "study.toml"), "--json"]
        for what, folder in STUDIES.items()
        for verb in ("fit", "explain")
    }
    wanted = {"tiny": 0, "quick": 2, "full": len(asked)}[size]
    asked = {"--help": ["--help"], **dict(list(asked.items())[:wanted])}
    own = [sys.executable, "-m", "dynident.cli"]
    with tempfile.TemporaryDirectory() as cache:
        measured([*own, "--help"], cache)  # files are in the system's memory
        for case, command in asked.items():
            for who, compiling in WAYS.items() if case != "--help" else [("dynident", "auto")]:
                figures = measured([*own, *command], cache, compiling)
                yield Line(case=case, who=who, figures=figures)
        figures = measured([sys.executable, "-c", IMPORTS], cache)
        yield Line(case="imports of a script by hand", who=f"`{IMPORTS}`", figures=figures)


BENCHMARK = Benchmark(
    title="Whole commands",
    work="`dynident fit` and `explain` on `problems/hidden_effect` and `problems/seven_joint_arm`, "
    "imports included, with a cache of compiled functions that was empty before the first; and "
    "what the imports of a script of one's own take.",
    compared="",
    lines=lines,
)
