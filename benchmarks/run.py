"""Run the benchmarks; write docs/benchmarks.md, its picture and the figures as JSON.

    python benchmarks/run.py                      all of them, as `make bench` does
    python benchmarks/run.py closed_loop ...      these; the page keeps what it has of the others
    python benchmarks/run.py --size quick         less work, to try it: printed, not written
    python benchmarks/run.py --without-peers      no environment is made for others
    python benchmarks/run.py --page               the page anew from the figures that are there

A benchmark is a module of this folder with a `BENCHMARK` (see `side_by_side/line.py`) and runs in a
process of its own. Who cannot be run is a line with the reason.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from side_by_side.line import SIZES
from side_by_side.page import page
from side_by_side.peer import SKIP
from side_by_side.picture import draw
from side_by_side.running import ROOT, in_this_process, merged, section

NAMES = [
    "identification",
    "batch_regressor",
    "least_squares_memory",
    "files_fitted",
    "joint_count",
    "effect_count",
    "process_count",
    "constrained_fit",
    "chain_length",
    "input_noise",
    "closed_loop",
    "csv_reading",
    "commands",
]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[[], *NAMES], metavar="NAME", default=[])
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument("--out", type=Path, help="folder of the page; docs at full size")
    parser.add_argument("--without-peers", action="store_true")
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("--here", metavar="NAME", help=argparse.SUPPRESS)
    said = parser.parse_args(arguments)
    if said.without_peers:
        os.environ[SKIP] = "skip"
    if said.here:
        in_this_process(said.here, said.size)
        return
    folder = said.out or (ROOT / "docs" if said.size == "full" else None)
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    kept = folder and folder / "benchmarks.json"
    found = json.loads(kept.read_text()) if kept and kept.exists() else {}
    for name in [] if said.page else said.names or NAMES:
        print(f"{name} ...", end=" ", flush=True)
        one = section(name, said.size)
        for line in one["lines"]:
            if line["missing"]:
                print(f"\n    {line['case']}, {line['who']}: {line['missing']}", end="")
        print(f"{one['run']['seconds']} s", flush=True)
        # Written after each: what is measured is not lost if the next one is interrupted.
        found = merged(found, {name: one}, NAMES)
        if kept:
            kept.write_text(json.dumps(found, indent=1) + "\n")
    if folder is None:
        print(page(found))
        return
    (folder / "benchmarks.md").write_text(page(found))
    draw(found, folder / "benchmarks.png")
    print(folder / "benchmarks.md")


if __name__ == "__main__":
    main()
