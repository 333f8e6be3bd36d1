"""What the scripts of this folder share: work is read, done twice or more, and answered as JSON.

Each is run as `python SCRIPT.py WORK.npz [name=value ...]`. It needs NumPy and what it is to show,
never the package itself (but for `dynident_fit.py`).
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

LEAST, LONGEST = 3, 20.0  # repeats; s after which there are no more


def answer(solve: Callable[[Any, dict[str, str]], Any]) -> None:
    """Print the times of a solution, its values and the memory that it took.

    Parameters
    ----------
    solve : from the arrays of the work and the settings to an array.

    Notes
    -----
    "imports" is the CPU time in s from the start of the process, "cold" the first solution, "warm"
    the median of more, "peak" the most memory of the process in MiB.
    """
    imports = time.process_time()
    work = np.load(sys.argv[1])
    settings = dict(said.split("=", 1) for said in sys.argv[2:])
    times = []
    values = np.empty(0)
    most = int(settings.get("repeats", LEAST)) + 1
    while not times or (len(times) < most and sum(times) < LONGEST):
        start = spent()
        values = np.asarray(solve(work, settings), dtype=float)
        times.append(spent() - start)
    said = {
        "imports": imports,
        "cold": times[0],
        "warm": median(times[1:] or times),
        "repeats": len(times),
        "peak": _peak(),
        "values": values.tolist(),
    }
    print(json.dumps(said))


def spent() -> float:
    """CPU time of the process and of its children that ended, a compiler say, in s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _peak() -> float:
    try:
        # Of this program alone: what `getrusage` says begins with that of whoever started it.
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM:")).split()[1]) / 2**10
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        2**20 if sys.platform == "darwin" else 2**10
    )


def effect_columns(work: Any) -> np.ndarray:
    """Columns of rotor inertia and viscous friction, (T, n, 2 n)."""
    v, a = work["v"], work["a"]
    n = v.shape[1]
    columns = np.zeros((len(v), n, 2 * n))
    joints = np.arange(n)
    columns[:, joints, joints] = a
    columns[:, joints, n + joints] = v
    return columns


def least_squares(regressor: np.ndarray, work: Any) -> np.ndarray:
    """The least of all that fit best, of regressor and effects: what one writes first."""
    Y = np.concatenate([regressor, effect_columns(work)], axis=2)
    rows = Y.reshape(-1, Y.shape[2])
    return np.linalg.lstsq(rows, work["tau"].ravel(), rcond=1e-10)[0]
