"""Run the benchmarks at the size in which they are quoted.

python benchmarks/run.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = (
    "hidden_effects.py",
    "batch_regressor.py",
    "least_squares_memory.py",
    "constrained_fit.py",
    "chain_length.py",
    "closed_loop.py",
    "input_noise.py",
    "csv_reading.py",
)


def main() -> None:
    for script in SCRIPTS:
        print(f"--- {script}", flush=True)
        subprocess.run([sys.executable, str(HERE / script)], check=True)


if __name__ == "__main__":
    main()
