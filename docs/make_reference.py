"""Make the schemas and the pages of reference from the source: python docs/make_reference.py.

A test asks that they are as this script would write them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path

from effect_catalogue import effect_symbols, effect_table, effects, inertial_symbols
from key_tables import key_tables
from made_parts import renewed
from published_schemas import FILES, schema, schema_path, schema_text

HERE = Path(__file__).resolve().parent
Parts = Mapping[str, Callable[[], str]]


def main() -> None:
    """Write all of it anew."""
    for path, text in made().items():
        path.write_text(text)


@cache
def made() -> dict[Path, str]:
    """Return the text of every file that is made, whole or in parts, by its path."""
    files = {schema_path(name): schema_text(name) for name in FILES}
    pages = {HERE / page: parts for page, parts in PAGES.items()}
    return files | {
        path: renewed(path.read_text(), parts, path.name) for path, parts in pages.items()
    }


def _keys(name: str) -> str:
    top = "At the top" if FILES[name][0].endswith(".toml") else "The file"
    return key_tables(schema(name), top)


PAGES: Mapping[str, Parts] = {
    **{f"reference/{name}.md": {"keys": partial(_keys, name)} for name in FILES},
    "effects.md": {"table": effect_table, "effects": effects},
    "symbols.md": {"inertial": inertial_symbols, "effects": effect_symbols},
}
"""Pages by their paths in this folder, with their made parts."""


if __name__ == "__main__":
    main()
