"""The package as a map: its modules, what each imports, its rooms and the floors that they are on.

Read from the source alone, without importing it. The tests hold the source against the floors,
and `make_architecture.py` draws them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "toolkit" / "dynident"
FACADES = ("__init__.py", "__init__.pyi")

FLOORS = (
    ("errors", "words"),
    ("files", "tables"),
    ("arguments", "late_modules", "progress", "settings", "data_files", "file_groups", "threads"),
    ("criteria", "clusters"),
    ("inertia", "moments", "batch"),
    ("recording",),
    ("robot", "formulas"),
    ("effects",),
    ("effect_modules",),
    ("model",),
    ("constraints",),
    ("nlp", "regression"),
    ("closed_loop",),
    ("fitting",),
    ("consistency", "validation"),
    ("wiring",),
    ("evidence",),
    ("diagnosis",),
    ("experiment_design",),
    ("study",),
    ("effect_contract",),
    ("study_draft",),
    ("refitting",),
    ("reporting",),
    ("explorer",),
    ("cli",),
    ("__main__",),
)
"""Rooms (and files beside them), the ground floor first: imports go to floors below."""


@dataclass(frozen=True)
class Module:
    """A file of the package.

    `name` is what it is imported by, `tree` its syntax, `names` every absolute name that it
    imports (`a.b.c` for `from a.b import c`), wherever in the file the import stands.
    """

    name: str
    path: Path
    tree: ast.Module
    names: frozenset[str]

    @property
    def room(self) -> str:
        """The first folder or file below the package; empty for the package itself."""
        return room_of(self.name)

    @property
    def is_facade(self) -> bool:
        """Whether it stands for a whole package."""
        return self.path.name in FACADES


def room_of(name: str) -> str:
    """Return the room of a module; empty for the package itself."""
    return [*name.split("."), ""][1]


@cache
def modules() -> Mapping[str, Module]:
    """Return every module by its name; the stub of a lazy facade adds what it imports."""
    found: dict[str, Module] = {}
    for path in sorted(PACKAGE.rglob("*.py*")):
        if path.suffix in (".py", ".pyi"):
            name = _name(path)
            tree = ast.parse(path.read_text())
            names = frozenset(_imported(tree, name))
            same = found.get(name, Module(name, path, tree, frozenset()))
            found[name] = replace(same, names=same.names | names)
    return found


@cache
def imports() -> Mapping[str, frozenset[str]]:
    """Return for each module those of the package that it imports."""
    known = modules()
    targets = {
        module.name: {name if name in known else name.rpartition(".")[0] for name in module.names}
        for module in known.values()
    }
    return {name: frozenset(found & set(known) - {name}) for name, found in targets.items()}


@cache
def room_imports() -> Mapping[str, frozenset[str]]:
    """Return for each room the rooms that it imports; the package's own facade is none."""
    found: dict[str, set[str]] = {room: set() for floor in FLOORS for room in floor}
    for name, others in imports().items():
        if room := room_of(name):
            found[room] |= {room_of(other) for other in others} - {room, ""}
    return {room: frozenset(others) for room, others in found.items()}


def reachable(edges: Mapping[str, frozenset[str]], start: str) -> set[str]:
    """Return what can be reached from a node of a graph by one step or more."""
    seen: set[str] = set()
    left = list(edges[start])
    while left:
        node = left.pop()
        if node not in seen:
            seen.add(node)
            left += edges[node]
    return seen


def circles(edges: Mapping[str, frozenset[str]]) -> list[tuple[str, ...]]:
    """Return the groups of nodes of a graph each of which reaches every other of its group."""
    reach = {node: reachable(edges, node) for node in edges}
    groups = {
        tuple(sorted(other for other in reach[node] if node in reach[other]))
        for node in edges
        if node in reach[node]
    }
    return sorted(groups)


def reduced(edges: Mapping[str, frozenset[str]]) -> Mapping[str, frozenset[str]]:
    """Return a graph without circles less each arrow that a longer way replaces."""
    reach = {node: reachable(edges, node) for node in edges}
    return {
        node: others - {far for other in others for far in reach[other]}
        for node, others in edges.items()
    }


def first_line(tree: ast.AST) -> str:
    """Return the first line of a module's, class's or function's docstring."""
    text = ast.get_docstring(tree) if isinstance(tree, _DOCUMENTED) else None
    return (text or "").split("\n")[0]


_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def blocks(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what stands in the blocks of a statement: statements, and handlers and cases of them.

    No expressions, of which most of a tree is made.
    """
    for field in ("body", "handlers", "cases", "orelse", "finalbody"):
        found = getattr(node, field, None)
        if isinstance(found, list):
            yield from found


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield all statements of a tree, those inside of others too."""
    left = [tree]
    while left:
        node = left.pop()
        yield node
        left += blocks(node)


def _name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if path.name in FACADES else parts)


def _imported(tree: ast.Module, name: str) -> Iterator[str]:
    """Yield every name that a module imports, relative ones (as stubs have them) made absolute."""
    for node in statements(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            origin = node.module or ""
            if node.level:
                origin = f"{name}.{origin}".rstrip(".")
            yield from (f"{origin}.{alias.name}" for alias in node.names)
