"""Whether two checkouts answer alike: every command's JSON on every study and robot in `problems/`.

    python benchmarks/compare_checkouts.py record CHECKOUT ANSWERS [--study NAME ...]
    python benchmarks/compare_checkouts.py compare ANSWERS ANSWERS [--tolerance 1e-9]

`record` runs the commands of a checkout's own source on its own problems and keeps what they
print, one file an answer; answers that are there already are not asked for again. `compare` lists
every value of two such folders that differs, and exits with 1 if one does. Numbers are equal
within the tolerance, relative to the larger of the two, and keys, names and verdicts are equal to
the letter. Sentences (strings with a space) are counted apart: `--words` prints both of each pair,
and makes a reworded one a difference.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeGuard

ROOT = Path(__file__).parents[1]
LINES_SHOWN = 40


def main() -> None:
    parser = argparse.ArgumentParser("compare_checkouts", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    record = commands.add_parser("record", help="run a checkout's commands")
    record.add_argument("checkout", type=Path)
    record.add_argument("answers", type=Path)
    record.add_argument("--study", nargs="*", help="only problems whose path holds one of these")
    compare = commands.add_parser("compare", help="compare two folders of answers")
    compare.add_argument("answers", type=Path, nargs=2)
    compare.add_argument("--tolerance", type=float, default=1e-9)
    compare.add_argument("--words", action="store_true", help="sentences count as well")
    options = parser.parse_args()
    if options.command == "record":
        record_answers(options.checkout.resolve(), options.answers, options.study)
    else:
        sys.exit(
            report(options.answers[0], options.answers[1], options.tolerance, words=options.words)
        )


def record_answers(checkout: Path, answers: Path, only: list[str] | None) -> None:
    """Run each command of a checkout whose answer is not there yet."""
    answers.mkdir(parents=True, exist_ok=True)
    problems = checkout / "problems"
    wanted = [
        (path, asked)
        for kind, asked in (("study*.toml", asked_of_study), ("*.urdf", asked_of_robot))
        for path in sorted(problems.glob(f"*/{kind}"))
        if only is None or any(word in str(path.relative_to(problems)) for word in only)
    ]
    for path, asked in wanted:
        with tempfile.TemporaryDirectory() as scratch:
            for name, arguments in asked(path, Path(scratch)):
                stem = str(path.relative_to(problems)).replace("/", ".")
                target = answers / f"{stem}.{name}.json"
                if not target.exists() or "--out" in arguments:  # others need what it writes
                    text = answer(checkout, arguments).replace(scratch, "SCRATCH")
                    target.write_text(text.replace(str(checkout), "CHECKOUT"))
                    print(target.name, flush=True)


def asked_of_study(study: Path, scratch: Path) -> Iterator[tuple[str, list[str]]]:
    """Name each question about a study, with its command."""
    estimate = str(scratch / "estimate.json")
    yield "explain", ["explain", str(study)]
    yield "fit", ["fit", str(study), "--out", estimate]
    yield "iv", ["fit", str(study), "--method", "iv"]
    yield "full", ["fit", str(study), "--consistency", "full"]
    yield "bayes", ["fit", str(study), "--method", "bayes"]
    yield "compare", ["compare", str(study)]
    yield "check", ["check", estimate]
    yield "refit", ["refit", estimate, "--out", str(scratch / "refitted.urdf")]


def asked_of_robot(robot: Path, scratch: Path) -> Iterator[tuple[str, list[str]]]:
    """Name each question about a robot description, with its command."""
    yield "check", ["check", str(robot)]
    yield "refit", ["refit", str(robot), "--out", str(scratch / "refitted.urdf")]


def answer(checkout: Path, arguments: list[str]) -> str:
    """Run one command of a checkout; return its answer as JSON text."""
    environment = {
        "DYNIDENT_DATA": str(ROOT.parent / "shared" / "data"),
        **os.environ,
        "PYTHONPATH": str(checkout / "toolkit"),
    }
    done = subprocess.run(
        [sys.executable, "-m", "dynident.cli", *arguments, "--json"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    try:
        said = json.loads(done.stdout)
    except json.JSONDecodeError:
        said = {"stdout": done.stdout, "stderr": done.stderr}
    return json.dumps({"status": done.returncode, "answer": said}, indent=1)


def report(one: Path, other: Path, tolerance: float, *, words: bool) -> int:
    """Print what differs between two folders of answers; return the exit status."""
    names = sorted({path.name for folder in (one, other) for path in folder.glob("*.json")})
    status = 0
    for name in names:
        if not ((one / name).exists() and (other / name).exists()):
            print(f"{name}: in one of the two only")
            status = 1
            continue
        first, second = (json.loads((folder / name).read_text()) for folder in (one, other))
        found = list(differences(first, second, tolerance))
        values = [line for line, is_sentence in found if words or not is_sentence]
        reworded = len(found) - len(values)
        tail = f", {reworded} sentences reworded" if reworded else ""
        print(f"{name}: {f'{len(values)} differences' if values else 'equal'}{tail}")
        for line in values[:LINES_SHOWN]:
            print(f"    {line}")
        status = status or int(bool(values))
    return status


def differences(
    one: Any, other: Any, tolerance: float, where: str = ""
) -> Iterator[tuple[str, bool]]:
    """Yield a line for each value that differs, and whether it is a sentence."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            if key in one and key in other:
                yield from differences(one[key], other[key], tolerance, f"{where}.{key}")
            else:
                yield f"{where}.{key}: in one of the two only", False
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (first, second) in enumerate(zip(one, other, strict=True)):
            yield from differences(first, second, tolerance, f"{where}[{number}]")
    elif _is_number(one) and _is_number(other):
        both_nan = math.isnan(one) and math.isnan(other)
        if not both_nan and not math.isclose(one, other, rel_tol=tolerance, abs_tol=1e-14):
            yield f"{where}: {one!r} and {other!r}", False
    elif one != other or isinstance(one, bool) is not isinstance(other, bool):
        sentence = isinstance(one, str) and isinstance(other, str) and " " in one
        yield f"{where}: {str(one)[:300]!r} and {str(other)[:300]!r}", sentence


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


if __name__ == "__main__":
    main()
