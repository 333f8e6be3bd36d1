"""The floors of the house: a room imports only from rooms above it."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "toolkit" / "dynident"
FLOORS = [
    ("errors",),
    ("files", "tables"),
    ("settings", "places", "threads"),
    ("inertia", "moments"),
    ("recording",),
    ("robot",),
    ("effects",),
    ("model",),
    ("constraints",),
    ("nlp", "regression"),
    ("closed_loop",),
    ("fitting",),
    ("consistency", "validation"),
    ("evidence",),
    ("diagnosis",),
    ("study",),
    ("refitting",),
    ("reporting",),
    ("cli",),
]
HEIGHT = {room: height for height, rooms in enumerate(FLOORS) for room in rooms}
PLOTTING = {"matplotlib", "plotly"}


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def sources() -> list[Path]:
    return [p for p in sorted(PACKAGE.rglob("*.py")) if p != PACKAGE / "__init__.py"]


def imported(path: Path) -> list[tuple[str, bool]]:
    """Modules imported by a file, and whether at run time when the file is first imported."""
    tree = ast.parse(path.read_text())
    typing_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
    }
    top = {id(node) for node in tree.body}
    found = []
    for node in ast.walk(tree):
        if id(node) in typing_only:
            continue
        if isinstance(node, ast.Import):
            found += [(alias.name, id(node) in top) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.append((str(node.module), id(node) in top))
            if node.module == "dynident":
                found += [(f"dynident.{a.name}", id(node) in top) for a in node.names]
    return found


@pytest.mark.parametrize("path", sources(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_down_the_floors_only(path: Path) -> None:
    here = room_of(path)
    assert here in HEIGHT, f"room '{here}' is on no floor"
    for name, _ in imported(path):
        parts = name.split(".")
        if parts[0] != "dynident" or len(parts) == 1:
            continue
        other = parts[1]
        allowed = other == here or HEIGHT[other] < HEIGHT[here]
        assert allowed, f"{here} imports {other}, which is above it"


@pytest.mark.parametrize("path", sources(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_the_report_imports_plotting_libraries(path: Path) -> None:
    names = {name.split(".")[0] for name, _ in imported(path)}
    assert room_of(path) == "reporting" or not names & PLOTTING


def test_every_file_has_a_docstring_and_most_are_short() -> None:
    lengths = {}
    for path in sources():
        text = path.read_text()
        assert ast.get_docstring(ast.parse(text)), f"{path} has no docstring"
        lengths[path] = text.count("\n")
    assert sum(n >= 300 for n in lengths.values()) <= 0.1 * len(lengths), lengths


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = ("pydrake", "pinocchio", "plotly", "matplotlib", "casadi", "scipy", "pandas", "numpy")
    code = f"import sys, dynident, dynident.cli; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
