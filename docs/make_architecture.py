"""Draw the rooms of the package into docs/architecture.md: python docs/make_architecture.py.

The page's prose is written by hand; what stands between `<!-- NAME -->` and `<!-- end -->` is made
here from the source, and a test asks that it is as this script would write it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from made_parts import renewed
from package_map import FLOORS, PACKAGE, first_line, modules, reduced, room_imports

PAGE = Path(__file__).resolve().parent / "architecture.md"
NOT_DRAWN = {
    *(
        "errors",
        "words",
        "files",
        "tables",
        "settings",
        "data_files",
        "places",
        "threads",
        "late_modules",
    ),
    "clusters",
}
"""Files of the ground floor, which serve every room."""


def main() -> None:
    """Write the page anew."""
    PAGE.write_text(page(PAGE.read_text()))


def page(text: str) -> str:
    """Return the page with its made parts as the source has them now."""
    return renewed(text, PARTS, PAGE.name)


def picture() -> str:
    """Draw the rooms, each above those that it imports, as a Mermaid diagram.

    An arrow that a longer way replaces is left out.
    """
    drawn = [room for room in _from_the_top() if room not in NOT_DRAWN]
    arrows = reduced({room: room_imports()[room] & set(drawn) for room in drawn})
    lines = ["```mermaid", "flowchart TD"]
    for room in drawn:
        count = sum(module.room == room for module in modules().values())
        size = f"<br/><small>{count} files</small>" if count > 1 else ".py"
        lines.append(f'    {room}["{room}{size}"]')
    for room in drawn:
        lines += [f"    {room} --> {other}" for other in sorted(arrows[room], key=drawn.index)]
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
            lines.append(
                f"| {indent}[`{where}`](../toolkit/dynident/{where}) | {first_line(module.tree)} |"
            )
    return "\n".join([*lines, ""])


PARTS: Mapping[str, Callable[[], str]] = {"picture": picture, "rooms": rooms}


def _from_the_top() -> list[str]:
    return [room for floor in reversed(FLOORS) for room in floor]


if __name__ == "__main__":
    main()
