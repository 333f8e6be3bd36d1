"""How many files of the package a command calls into: what a reader who follows it has to open.

    python benchmarks/files_entered.py                       explain on problems/hidden_effect
    python benchmarks/files_entered.py fit problems/emps/study.toml --json

A file counts when a function or method with a name of its own is called in it; what runs on import
does not, nor do lambdas, comprehensions and dunder methods, which constructors and operators call.
The number goes to standard error, with the count of each room and the files themselves; standard
output is the command's own.
"""

from __future__ import annotations

import inspect
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
EXPLAIN = ["explain", str(ROOT / "problems" / "hidden_effect" / "study.toml"), "--json"]


def main() -> None:
    import dynident.cli

    package = Path(dynident.cli.__file__).parents[1]
    files = entered(lambda: run(dynident.cli.main, sys.argv[1:] or EXPLAIN), package)
    rooms = Counter(file.parts[0].removesuffix(".py") for file in files)
    say = "\n".join(map(str, [*files, "", *(f"{n:4d} {room}" for room, n in rooms.items())]))
    print(f"{say}\n{len(files):4d} files", file=sys.stderr)


def run(command: Callable[[list[str]], Any], arguments: list[str]) -> None:
    """Run a command line to its end, whatever its exit status."""
    try:
        command(arguments)
    except SystemExit as end:
        if end.code:
            print(f"the command ended with status {end.code}", file=sys.stderr)


def entered(work: Callable[[], Any], package: Path) -> list[Path]:
    """Return the files below a folder, relative to it, in which functions are called by work."""
    called: set[CodeType] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            called.add(frame.f_code)

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    named = {Path(code.co_filename) for code in called if _is_named_function(code)}
    return sorted(path.relative_to(package) for path in named if path.is_relative_to(package))


def _is_named_function(code: CodeType) -> bool:
    """Tell functions with a name from modules and the bodies of classes, which run on import."""
    is_function = bool(code.co_flags & inspect.CO_OPTIMIZED)
    return is_function and not code.co_name.startswith(("<", "__"))


if __name__ == "__main__":
    main()
