"""Draw the rooms of the package into docs/architecture.md: python docs/make_architecture.py.

The page's prose is written by hand; what stands between `<!-- NAME -->` and `<!-- end -->` is made
here from the source, and a test asks that it is as this script would write it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

from package_map import FLOORS, PACKAGE, first_line, modules, reduced, room_imports

PAGE = Path(__file__).resolve().parent / "architecture.md"


def main() -> None:
    """Write the page anew."""
    PAGE.write_text(page(PAGE.read_text()))


def page(text: str) -> str:
    """Return the page with its made parts as the source has them now."""
    for name, make in PARTS.items():
        begin, end = f"<!-- {name} -->\n", "<!-- end -->"
        pattern = re.compile(f"(?<={re.escape(begin)}).*?(?={re.escape(end)})", re.DOTALL)
        text, count = pattern.subn(lambda _, make=make: make(), text)
        if count != 1:
            raise ValueError(f"{PAGE.name} needs one '{begin.strip()}' with its '{end}'")
    return text


def picture() -> str:
    """Draw the rooms, each above those that it imports, as a Mermaid diagram.

    An arrow that a longer way replaces is left out.
    """
    lines = ["```mermaid", "flowchart TD"]
    for room in _from_the_top():
        count = sum(module.room == room for module in modules().values())
        size = f"<br/><small>{count} files</small>" if count > 1 else ""
        lines.append(f'    {room}["{room}{size}"]')
    arrows = reduced(room_imports())
    for room in _from_the_top():
        lines += [f"    {room} --> {other}" for other in sorted(arrows[room], key=_floor)]
    return "\n".join([*lines, "```", ""])


def rooms() -> str:
    """List every room from the top floor down, with the first line of its docstring."""
    lines = ["| room | holds |", "| --- | --- |"]
    for room in _from_the_top():
        inside = {
            name: module
            for name, module in modules().items()
            if name == f"dynident.{room}" or (module.room == room and module.is_facade)
        }
        for name, module in sorted(inside.items()):
            folder = module.path.parent if module.is_facade else module.path
            where = folder.relative_to(PACKAGE).as_posix() + ("/" if module.is_facade else "")
            indent = "&emsp;" * (name.count(".") - 1)
            lines.append(f"| {indent}[`{where}`](../toolkit/dynident/{where}) | {_said(name)} |")
    return "\n".join([*lines, ""])


PARTS: Mapping[str, Callable[[], str]] = {"picture": picture, "rooms": rooms}


def _from_the_top() -> list[str]:
    return [room for floor in reversed(FLOORS) for room in floor]


def _floor(room: str) -> int:
    return -next(height for height, floor in enumerate(FLOORS) if room in floor)


def _said(name: str) -> str:
    """Return the first line of a docstring; a lazy facade's stands in its module, not its stub."""
    return first_line(modules()[name].tree)


if __name__ == "__main__":
    main()
