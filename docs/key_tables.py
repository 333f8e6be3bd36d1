"""A JSON Schema as tables of keys for readers: what each means, its kind, unit, range, default."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]


def key_tables(schema: Schema, top: str) -> str:
    """Return a heading and a table in Markdown for each table of a file.

    Parameters
    ----------
    schema : of the file.
    top : heading of the keys that stand in no table.
    """
    return "\n".join(_section(*one, schema) for one in tables(schema, top))


def tables(schema: Schema, top: str) -> Iterator[tuple[str, Schema]]:
    """Yield each table of a file by its heading, in the order in which keys name them."""
    left, seen = [(top, "", schema)], set()
    while left:
        heading, path, table = left.pop(0)
        yield heading, table
        for key, said in table["properties"].items():
            for kind, inner in _tables_in(said, schema):
                inside = f"{path}.{key}".strip(".") + (".NAME" if kind == "named" else "")
                if id(inner) not in seen:
                    seen.add(id(inner))
                    left.append((_heading(inside, kind, schema), inside, inner))


def _heading(path: str, kind: str, schema: Schema) -> str:
    if _is_settings(schema):
        return f"`[[{path}]]`" if kind == "list" else f"`[{path}]`"
    return f"`{path}[]`" if kind == "list" else f"`{path}`"


def _is_settings(schema: Schema) -> bool:
    return schema["title"].endswith(".toml")


def _tables_in(said: Schema, schema: Schema) -> Iterator[tuple[str, Schema]]:
    """Yield the tables that a key may hold: one, a list of them, or one by each name."""
    if "$ref" in said:
        yield "one", _resolved(said, schema)
    elif "properties" in said:
        yield "one", said
    for one in (*said.get("anyOf", ()), *said.get("allOf", ())):
        yield from _tables_in(one, schema)
    if "items" in said:
        yield from (("list", table) for _, table in _tables_in(said["items"], schema))
    if isinstance(said.get("additionalProperties"), dict):
        inside = _tables_in(said["additionalProperties"], schema)
        yield from (("named", table) for _, table in inside)


def _resolved(said: Schema, schema: Schema) -> Schema:
    return schema["$defs"][said["$ref"].rpartition("/")[2]] if "$ref" in said else said


def _section(heading: str, table: Schema, schema: Schema) -> str:
    lines = [f"## {heading}", ""]
    if "description" in table:
        lines += [escaped(table["description"]), ""]
    lines += ["| key | meaning |", "| --- | --- |"]
    for key, said in table["properties"].items():
        words = said.get("description") or _resolved(said, schema).get("description", "")
        facts = _facts(said, key in table.get("required", ()), schema)
        lines.append(f"| `{key}` | {_cell(words)}<br>*{_cell(facts)}* |")
    return "\n".join([*lines, ""])


def _facts(said: Schema, is_required: bool, schema: Schema) -> str:
    parts = [_kind(said, schema)]
    unit = next(_values(said, "unit"), "")
    if unit not in ("", "1"):
        parts.append(f"in {unit}")
    if limits := _limits(said):
        parts.append(limits)
    default = said.get("default")
    if is_required:
        parts.append("has to be there")
    elif default not in (None, "", {}, []) and not isinstance(default, dict):
        parts.append(f"default `{json.dumps(default)}`")
    else:
        parts.append("may be left out")
    return "; ".join(parts)


def _kind(said: Schema, schema: Schema) -> str:
    if "enum" in said or "const" in said:
        return " or ".join(f"`{json.dumps(x)}`" for x in said.get("enum", [said.get("const")]))
    if "anyOf" in said:
        return " or ".join(dict.fromkeys(_kind(one, schema) for one in said["anyOf"]))
    if "$ref" in said or "properties" in said or said.get("type") == "object":
        inner = said.get("additionalProperties")
        if isinstance(inner, dict) and inner:
            return f"table of name = {_kind(inner, schema)}"
        return "table"
    if said.get("type") == "array":
        if "prefixItems" in said:
            return f"list of {len(said['prefixItems'])} numbers"
        one = _kind(said["items"], schema)
        plural = {"number": "numbers", "text": "texts", "table": "tables"}
        return f"list of {plural.get(one, one.replace('list', 'lists'))}"
    plain = {"string": "text", "integer": "whole number", "boolean": "true or false"}
    return plain.get(said["type"]) or str(said["type"])


def _limits(said: Schema) -> str:
    """The range of a key's numbers, in words."""
    found = {
        name: next(_values(said, name), None)
        for name in ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")
    }
    words = {
        "minimum": "at least",
        "exclusiveMinimum": "above",
        "maximum": "at most",
        "exclusiveMaximum": "below",
    }
    return ", ".join(f"{words[k]} {x:g}" for k, x in found.items() if x is not None)


def _values(said: Any, name: str) -> Iterator[Any]:
    """Yield what a key's schema, or one inside it that is no table, says under a name."""
    if isinstance(said, dict) and name in said:
        yield said[name]
    if isinstance(said, dict):
        for key in ("anyOf", "prefixItems", "items", "additionalProperties"):
            inside = said.get(key, ())
            for one in inside if isinstance(inside, list) else [inside]:
                yield from _values(one, name)


def escaped(text: str) -> str:
    """Return text in which what looks like a tag of HTML stays what it is."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(p if p.startswith("`") else p.replace("<", "&lt;") for p in parts)


def _cell(text: str) -> str:
    return " ".join(escaped(text).replace("|", "\\|").split())
