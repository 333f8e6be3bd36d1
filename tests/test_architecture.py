"""What pages have from the source is current; paths and names on that of the architecture exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from make_architecture import PAGE, page
from make_reference import made
from package_map import PACKAGE, circles, reachable, reduced

PATHS = sorted(set(re.findall(r"`((?:[a-z_]+/)*[a-z_]+(?:\.py|/)(?::[\w.]+)?)`", PAGE.read_text())))


def test_what_is_made_from_the_source_is_current() -> None:
    """`python docs/make_architecture.py` makes it so."""
    assert page(PAGE.read_text()) == PAGE.read_text()


@pytest.mark.parametrize("path", made(), ids=lambda path: path.name)
def test_the_reference_is_current(path: Path) -> None:
    """`python docs/make_reference.py` makes it so: schemas, keys, effects, symbols."""
    assert path.read_text() == made()[path]


def test_a_page_without_a_place_for_the_picture_is_refused() -> None:
    with pytest.raises(ValueError, match="picture"):
        page("nothing")


@pytest.mark.parametrize("path", PATHS)
def test_paths_and_names_exist(path: str) -> None:
    file, _, name = path.partition(":")
    root = PACKAGE.parents[1] if file.startswith(("tests/", "docs/")) else PACKAGE
    assert (root / file).exists()
    node: ast.AST = ast.parse((root / file).read_text()) if name else ast.Module([], [])
    for part in filter(None, name.split(".")):
        found = [n for n in ast.iter_child_nodes(node) if part in _defined(n)]
        assert found, f"no {part} in {file}"
        node = found[0]


def test_the_page_answers_with_paths() -> None:
    assert len(PATHS) > 60


def test_arrows_that_a_longer_way_replaces_are_left_out() -> None:
    edges = {"a": frozenset("bcd"), "b": frozenset("c"), "c": frozenset("d"), "d": frozenset()}
    less = reduced(edges)
    assert less == {"a": {"b"}, "b": {"c"}, "c": {"d"}, "d": set()}
    assert all(reachable(less, node) == reachable(edges, node) for node in edges)
    assert circles(edges) == []


def test_circles_are_found_whole() -> None:
    edges = {
        "a": frozenset("b"),
        "b": frozenset("c"),
        "c": frozenset("ad"),
        "d": frozenset("e"),
        "e": frozenset("d"),
        "f": frozenset("a"),
    }
    assert circles(edges) == [("a", "b", "c"), ("d", "e")]


def _defined(node: ast.AST) -> set[str]:
    """Names that a statement defines."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return {target.id for target in targets if isinstance(target, ast.Name)}
