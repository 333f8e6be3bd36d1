"""What keeps the source readable: small rooms, unique names, short functions, plain signatures.

Which rules lint can check, it does (`pyproject.toml`): positional arguments, stale parameters of
docstrings, relative imports. Here is what it cannot.
"""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import takewhile

from package_map import Module, blocks, modules, statements

FILES_IN_A_ROOM = 15
LINES_OF_A_FUNCTION = 80
FIELDS_BY_POSITION = 4
UNDOCUMENTED_ARGUMENTS = 2

PLAIN_FACTS: dict[str, str] = {
    "carries_payload": "whether the robot held its payload: a fact about the instant",
    "carries": "the same of a recording",
    "payload": "the same of a recording, None where it is not known",
    "hidden": "whether an experiment keeps the effect to itself: stored as it is",
}
"""Boolean arguments that say how things are and choose no behaviour, with the reason."""


@dataclass(frozen=True)
class Function:
    """A function or method of the package, with the classes and functions that it stands in."""

    module: Module
    node: ast.FunctionDef | ast.AsyncFunctionDef
    owners: tuple[ast.AST, ...]

    @property
    def name(self) -> str:
        owners = [getattr(owner, "name", "") for owner in self.owners]
        return ".".join([*self.module.name.split(".")[1:], *owners, self.node.name])

    @property
    def is_public(self) -> bool:
        inside = any(isinstance(owner, ast.FunctionDef) for owner in self.owners)
        names = [self.node.name, *(getattr(owner, "name", "") for owner in self.owners)]
        return not inside and not any(name.startswith("_") for name in names)

    @property
    def is_command(self) -> bool:
        """Whether the command line calls it, with options by their names."""
        return any("command(" in d or d == "command" for d in self.decorators)

    @property
    def decorators(self) -> list[str]:
        return [ast.unparse(decorator) for decorator in self.node.decorator_list]

    @property
    def arguments(self) -> list[ast.arg]:
        """All but `self` and `cls`."""
        a = self.node.args
        found = [*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg]
        skip = {"self", "cls"} if self.owners else set()
        return [arg for arg in found if arg is not None and arg.arg not in skip]

    def own_nodes(self) -> Iterator[ast.AST]:
        """Yield the nodes of the body, less those of functions within."""
        left: list[ast.AST] = list(self.node.body)
        while left:
            node = left.pop()
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                yield node
                left += ast.iter_child_nodes(node)


@cache
def functions() -> list[Function]:
    found: list[Function] = []

    def visit(module: Module, node: ast.AST, owners: tuple[ast.AST, ...]) -> None:
        for child in blocks(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                found.append(Function(module, child, owners))
            inner = isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
            visit(module, child, (*owners, child) if inner else owners)

    for module in modules().values():
        visit(module, module.tree, ())
    return found


@cache
def classes() -> dict[str, list[tuple[Module, ast.ClassDef]]]:
    found = defaultdict(list)
    for module in modules().values():
        for node in statements(module.tree):
            if isinstance(node, ast.ClassDef):
                found[node.name].append((module, node))
    return found


def test_every_file_has_a_docstring_and_most_are_short() -> None:
    sources = modules().values()
    assert [m.name for m in sources if not ast.get_docstring(m.tree)] == []
    long = [m.name for m in sources if m.path.read_text().count("\n") >= 300]
    assert len(long) <= 0.1 * len(sources), long


def test_rooms_are_small() -> None:
    count = Counter(m.path.parent for m in modules().values() if not m.is_facade)
    crowded = {str(folder.name) for folder, files in count.items() if files > FILES_IN_A_ROOM}
    assert crowded == set()


def test_names_of_classes_are_unique() -> None:
    assert {name for name, places in classes().items() if len(places) > 1} == set()


def test_names_of_modules_are_unique() -> None:
    names = Counter(m.path.stem for m in modules().values() if not m.is_facade)
    assert {name for name, n in names.items() if n > 1} - {"__main__"} == set()


def test_functions_are_short() -> None:
    found = {f.name for f in functions() if _lines(f.node) > LINES_OF_A_FUNCTION}
    assert found == set()


def test_no_boolean_switches_what_a_public_function_does() -> None:
    """A `Literal`, an enum or two functions say what is chosen; `f(x, True)` does not."""
    found = {
        f"{function.name} {argument.arg}"
        for function in functions()
        if function.is_public and not function.is_command
        for argument in function.arguments
        if _is_boolean(argument) and argument.arg not in PLAIN_FACTS
    }
    assert found == set()


def test_every_plain_fact_is_used() -> None:
    used = {a.arg for f in functions() if f.is_public for a in f.arguments if _is_boolean(a)}
    assert set(PLAIN_FACTS) <= used


def test_dataclasses_of_many_fields_take_keywords() -> None:
    found = {
        name
        for name, places in classes().items()
        for _, node in places
        if not name.startswith("_")
        and _takes_positions(node)
        and len(_fields(node)) > FIELDS_BY_POSITION
    }
    assert found == set()


def test_public_functions_of_many_arguments_are_documented() -> None:
    """Parameters and what is returned and raised, unless the method that it overrides says so.

    What is returned has a section of its own. One value may be said in the summary line instead,
    which then begins with "Return" or "Yield"; several values (a tuple of them) may not.
    """
    found = {
        f"{function.name}: {', '.join(missing)}"
        for function in functions()
        if function.is_public
        and len(function.arguments) > UNDOCUMENTED_ARGUMENTS
        and not function.is_command
        and not {"overload", "override"} & set(function.decorators)
        and not _overrides(function)
        and (missing := _undocumented(function))
    }
    assert found == set()


def test_documented_attributes_exist() -> None:
    """Every name in a section "Attributes" is a field, a property or set by a method."""
    found = {
        f"{name}: {attribute}"
        for name, places in classes().items()
        for _, node in places
        for attribute in set(_documented_attributes(node)) - set(_members(node))
    }
    assert found == set()


def _lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    return (node.end_lineno or 0) - node.lineno + 1


def _is_boolean(argument: ast.arg) -> bool:
    if argument.annotation is None:
        return False
    parts = re.split(r"\s*\|\s*", ast.unparse(argument.annotation).strip("\"'"))
    return "bool" in parts


def _takes_positions(node: ast.ClassDef) -> bool:
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    found = [d for d in decorators if re.match(r"(dataclasses\.)?dataclass\b", d)]
    return bool(found) and not any("kw_only=True" in d for d in found)


def _fields(node: ast.ClassDef) -> list[str]:
    """Fields that the constructor takes by position: none after `_: KW_ONLY`."""
    found = [n for n in node.body if isinstance(n, ast.AnnAssign)]
    found = list(takewhile(lambda n: ast.unparse(n.annotation) != "KW_ONLY", found))
    return [
        ast.unparse(n.target)
        for n in found
        if "ClassVar" not in ast.unparse(n.annotation)
        and not (n.value and re.search(r"(init=False|kw_only=True)", ast.unparse(n.value)))
    ]


def _documented_attributes(node: ast.ClassDef) -> list[str]:
    """Return the names in the section "Attributes" of a class."""
    section = re.search(
        r"^Attributes\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)",
        ast.get_docstring(node) or "",
        re.MULTILINE | re.DOTALL,
    )
    heads = re.findall(r"^(\S[^:\n]*?)(?: ?:.*)?$", section[1], re.MULTILINE) if section else []
    return [name.strip() for head in heads for name in head.split(",")]


def _members(node: ast.ClassDef) -> Iterator[str]:
    """Yield the attributes of a class, those from its base classes in the package with them."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Attribute) and isinstance(inner.ctx, ast.Store):
            yield from [inner.attr] if ast.unparse(inner.value) == "self" else []
    for inner in node.body:
        if isinstance(inner, ast.AnnAssign):
            yield ast.unparse(inner.target)
        elif isinstance(inner, ast.Assign):
            yield from map(ast.unparse, inner.targets)
        elif isinstance(inner, ast.FunctionDef):
            yield inner.name
    for base in node.bases:
        for _, parent in classes().get(ast.unparse(base).split("[")[0], ()):
            yield from _members(parent)


def _overrides(function: Function) -> bool:
    """Whether a class above it in the package has a method of that name, which documents it."""
    left = [b for owner in function.owners if isinstance(owner, ast.ClassDef) for b in owner.bases]
    while left:
        base = ast.unparse(left.pop()).split("[")[0]
        for _, node in classes().get(base, ()):
            if any(getattr(n, "name", None) == function.node.name for n in node.body):
                return True
            left += node.bases
    return False


def _undocumented(function: Function) -> list[str]:
    """Return the parts that a function's docstring lacks."""
    text = ast.get_docstring(function.node) or ""
    missing = []
    if not _has(text, "Parameters"):
        missing.append("Parameters")
    returns = ast.unparse(function.node.returns) if function.node.returns else "None"
    if returns not in ("None", "NoReturn"):
        in_section = _has(text, "Returns") or _has(text, "Yields")
        several = returns.startswith("tuple[") and not returns.endswith(", ...]")
        in_summary = re.match(r"(Return|Yield) [^\n]+\.(\n|$)", text) is not None
        if not in_section and (several or not in_summary):
            missing.append("Returns")
    raised = [n.exc for n in function.own_nodes() if isinstance(n, ast.Raise) and n.exc]
    if any("NotImplementedError" not in ast.unparse(e) for e in raised) and not _has(
        text, "Raises"
    ):
        missing.append("Raises")
    return missing


def _has(text: str, section: str) -> bool:
    return re.search(rf"^{section}\n-+$", text, re.MULTILINE) is not None
