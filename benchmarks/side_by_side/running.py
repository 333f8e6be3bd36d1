"""Benchmarks run one by one, each in a process of its own, and their answers kept as JSON."""

from __future__ import annotations

import importlib
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from side_by_side.line import Benchmark, Line, Size, as_json, from_json

ROOT = Path(__file__).resolve().parents[2]
VERSIONS = ("casadi", "drake", "mujoco", "numpy", "pandas", "pin", "scikit-learn", "scipy")

_LIMIT = 2400.0  # s of one benchmark
_MARK = "LINE "


def benchmark(name: str) -> Benchmark:
    """The benchmark of a module beside `run.py`."""
    return importlib.import_module(name).BENCHMARK


def in_this_process(name: str, size: Size) -> None:
    """Do the work; print each line as JSON behind a mark."""
    for line in benchmark(name).lines(size):
        print(_MARK + json.dumps(as_json(line)), flush=True)


def in_a_process(name: str, size: Size, seconds: float = _LIMIT) -> tuple[list[Line], float]:
    """Lines of a benchmark, with one that says why if it did not come to its end; its time in s."""
    run = Path(__file__).resolve().parents[1] / "run.py"
    command = [sys.executable, str(run), "--here", name, "--size", size]
    start, failed = time.monotonic(), ""
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=seconds,
            env={"OMP_NUM_THREADS": "1", **os.environ},
        )
        out = done.stdout
        if done.returncode:
            last = [line for line in done.stderr.splitlines() if line.strip()][-1:]
            failed = f"stopped with status {done.returncode}: {''.join(last)[:300]}"
    except subprocess.TimeoutExpired as error:
        out = (error.stdout or b"").decode() if isinstance(error.stdout, bytes) else ""
        failed = f"stopped after {seconds:g} s"
    lines = list(_lines(out))
    if failed:
        lines.append(Line(case="", who="the rest", missing=failed))
    return lines, time.monotonic() - start


def _lines(text: str) -> Iterator[Line]:
    for line in text.splitlines():
        if line.startswith(_MARK):
            yield from_json(json.loads(line.removeprefix(_MARK)))


def section(name: str, size: Size) -> dict[str, Any]:
    """Run a benchmark; what the page needs to know of it."""
    load = os.getloadavg()[0]
    lines, seconds = in_a_process(name, size)
    posed = benchmark(name)
    return {
        "title": posed.title,
        "work": posed.work,
        "compared": posed.compared,
        "axis": posed.axis,
        "lines": [as_json(line) for line in lines],
        "run": {
            "date": datetime.now(UTC).strftime("%Y-%m-%d"),
            "size": size,
            "seconds": round(seconds),
            "load": round(load, 2),
        },
    }


def machine() -> dict[str, Any]:
    """Processor and versions of what is compared."""
    found: dict[str, str] = {}
    for package in ("dynident", *VERSIONS):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return {
        "processor": _processor(),
        "processors": os.cpu_count(),
        "system": f"{platform.system()}, Python {platform.python_version()}",
        "versions": found,
    }


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return names[0] if names else platform.machine()


def merged(before: Mapping[str, Any], found: Mapping[str, Any], order: list[str]) -> dict[str, Any]:
    """Answers of a run put over those of earlier ones, in the page's order."""
    sections = {**before.get("sections", {}), **found}
    return {
        "machine": machine(),
        "sections": {name: sections[name] for name in order if name in sections},
    }
