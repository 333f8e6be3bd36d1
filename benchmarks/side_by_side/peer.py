"""Peers in processes, and if need be environments, of their own, on work written to a file.

A peer is a script of `benchmarks/peers` that reads an NPZ file and prints one JSON object as its
last line (see `peers/answering.py`). Its environment is made from `peers/NAME.txt` when it is first
asked for, in `.bench/NAME`, which git ignores, and made anew when that list changes.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

PEERS = Path(__file__).resolve().parents[1] / "peers"
ENVIRONMENTS = Path(__file__).resolve().parents[2] / ".bench"
SKIP = "DYNIDENT_BENCH_PEERS"
"""Environment variable: "skip" makes no environment and leaves out all who need one."""

_INSTALLING, _WORKING = 900.0, 900.0  # s
_LINE = 300  # characters of a reason


class PeerMissing(Exception):
    """A peer that cannot be asked, and why."""


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A script, and whose environment it runs in.

    Attributes
    ----------
    script : its name in `peers`.
    environment : the list in `peers` without ".txt"; empty for the one that this runs in.
    """

    script: str
    environment: str = ""

    def ask(self, work: Mapping[str, Any], **settings: str) -> dict[str, Any]:
        """Its answer on arrays, with settings by name.

        Raises
        ------
        PeerMissing
            If it cannot be installed, fails or takes too long.
        """
        python = interpreter(self.environment) if self.environment else Path(sys.executable)
        said = [f"{name}={value}" for name, value in settings.items()]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "work.npz"
            np.savez(file, **work)
            command = [str(python), str(PEERS / self.script), str(file), *said]
            environment = {**os.environ, "OMP_NUM_THREADS": "1", "XDG_CACHE_HOME": folder}
            if self.environment:
                environment.pop("PYTHONPATH", None)
            done = _run(command, _WORKING, environment)
        try:
            return json.loads(done.stdout.splitlines()[-1])
        except (IndexError, json.JSONDecodeError) as error:
            raise PeerMissing(f"no answer: {_last_line(done.stdout or done.stderr)}") from error


def interpreter(name: str) -> Path:
    """The interpreter of an environment, which is made if it is not there.

    Raises
    ------
    PeerMissing
        If the environment cannot be made.
    """
    if os.environ.get(SKIP) == "skip":
        raise PeerMissing("not asked for in this run")
    listed = PEERS / f"{name}.txt"
    if not listed.exists():
        raise PeerMissing(f"not installed: there is no peers/{listed.name}")
    folder = ENVIRONMENTS / name
    python, stamp = folder / "bin" / "python", folder / "installed.txt"
    if stamp.exists() and stamp.read_text() == listed.read_text() and python.exists():
        return python
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(exist_ok=True)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    try:
        _run([sys.executable, "-m", "venv", str(folder)], _INSTALLING)
        _run([*pip, "-r", str(listed)], _INSTALLING)
    except PeerMissing as error:
        raise PeerMissing(f"not installed: {error}") from error
    stamp.write_text(listed.read_text())
    return python


def _run(
    command: list[str], seconds: float, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=seconds, env=environment
        )
    except subprocess.TimeoutExpired as error:
        raise PeerMissing(f"stopped after {seconds:g} s") from error
    except subprocess.CalledProcessError as error:
        raise PeerMissing(_last_line(error.stderr) or f"exit status {error.returncode}") from error
    except OSError as error:
        raise PeerMissing(str(error)) from error


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    # pip's hints follow the error itself.
    errors = [line for line in lines if line.startswith("ERROR")]
    return (errors or lines or [""])[-1][:_LINE]
