"""TOML files checked against a schema, with complaints that name the key and the remedy.

The check is pydantic's; ours is the one line in which its first complaint reaches a user, with
the key that was meant, which pydantic does not guess.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_origin

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from dynident import files
from dynident.errors import StudyError
from dynident.words import nearest


class SettingsTable(BaseModel):
    """A table of a settings file: unknown keys and numbers that are not finite are refused.

    What stands under a key in the class says what the key means: in the published schema and in the
    reference. Units are there as `unit`.
    """

    # Built when a file is read: most commands read one kind of many.
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, defer_build=True)


def in_unit(unit: str) -> dict[str, JsonValue]:
    """Return what a number's schema says of its unit, for `Field(json_schema_extra=...)`."""
    return {"unit": unit}


LONGEST_TIME = 1e9
"""s: no recording, period or session lasts longer, and none begins earlier before another."""
LONGEST_SESSION = 1e5
"""s: a clock that shows more at the first sample counts from something else, as from 1970."""
FASTEST = 1e7
"""Hz: nothing in a robot is sampled, filtered or controlled faster."""
SLOWEST = 1e-6
"""Hz: nothing is slower."""
Time = Annotated[float, Field(ge=-LONGEST_TIME, le=LONGEST_TIME, json_schema_extra=in_unit("s"))]
"""A time in s, of either sign."""
Duration = Annotated[float, Field(gt=0, le=LONGEST_TIME, json_schema_extra=in_unit("s"))]
"""A time in s, above zero."""
Rate = Annotated[float, Field(ge=SLOWEST, le=FASTEST, json_schema_extra=in_unit("Hz"))]
"""Samples or cycles a second."""
Gravity = Annotated[float, Field(ge=-100, le=100, json_schema_extra=in_unit("m/s^2"))]
"""m/s^2, of one axis."""
DEEPEST = 50
"""Levels of tables within tables that a file of settings has at most."""

T = TypeVar("T", bound=SettingsTable)
_LEVEL = r"(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')\s*+\.\s*+"
# From the beginnings of words only: of a long text every letter would be one.
_INVALID = re.compile(r"Invalid value \(at line (?P<line>\d+), column (?P<column>\d+)\)")
_DEEP = re.compile(rf"(?<![\w-])(?:{_LEVEL}){{{DEEPEST}}}")
"""A dotted key of very many levels, which takes a parser memory by their square."""
_TRIED = re.compile(
    r"str|float|int|bool|(list|tuple|dict|literal)\[.*\]|constrained-\w+|_\w+|[A-Z]\w*Entry"
)


def read_toml(path: str | Path, schema: type[T]) -> T:
    """Read a TOML file into its schema.

    Raises
    ------
    FileError
        If the file cannot be read.
    StudyError
        If it is not TOML, is nested beyond `DEEPEST`, or a key is unknown, missing or of the wrong
        kind; the first such key is named, with the nearest valid one.
    """
    path = Path(path)
    try:
        return schema.model_validate(parse_toml(path))
    except ValidationError as error:
        raise _complaint(error, path, schema) from None


def parse_toml(path: str | Path) -> dict[str, Any]:
    """Return what a TOML file says, whatever its keys.

    Raises
    ------
    FileError
        If the file cannot be read.
    StudyError
        If it is not TOML, or is nested beyond `DEEPEST`.
    """
    text = files.read_text(path)
    deep = StudyError("has tables nested too deeply", str(path), "is it the right file?")
    if _DEEP.search(text):
        raise deep
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise deep from None
    except ValueError as error:  # of TOML, and of whole numbers of thousands of digits
        raise StudyError(f"is not TOML: {error}", str(path), _unquoted(text, str(error))) from None


def _unquoted(text: str, complaint: str) -> str:
    """A remedy where a value is a word, which TOML has but for `true` and `false` in quotes."""
    place = _INVALID.match(complaint)
    if place is None:
        return ""
    rest = text.split("\n")[int(place["line"]) - 1][int(place["column"]) - 1 :]
    if rest.startswith(("True", "False")):
        return "write true or false, in small letters"
    return "texts stand between quotes" if rest[:1].isalpha() else ""


def _complaint(error: ValidationError, path: Path, schema: type[BaseModel]) -> StudyError:
    every = error.errors(include_url=False)
    # Of a key that takes several types there is a complaint for each: the one that lies deepest
    # is of the type that was meant.
    place = _place(every[0])
    inside = [one for one in every if _place(one)[: len(place)] == place]
    first = max(inside, key=lambda one: len(_place(one)))
    # Where a key takes several types, pydantic appends the one that it tried first.
    key = ".".join(map(str, _place(first)))
    if first["type"] == "extra_forbidden":
        *table, last = map(str, _place(first))
        names = _keys_at(schema, _place(first)[:-1])
        remedy = nearest(last, names, "keys")
        if table and last in schema.model_fields and last not in names:
            remedy = f"{last} is a key of the whole file: write it above the first table"
        return StudyError(f"unknown key '{key}'", str(path), remedy)
    if first["type"] == "missing" and isinstance(first["loc"][-1], int):
        return StudyError(f"{key.rpartition('.')[0]}: too few values", str(path), "add the rest")
    if first["type"] == "missing":
        return StudyError(f"key '{key}' is missing", str(path), "add it")
    if first["type"] == "model_type":
        return StudyError(
            f"{key}: a table is needed here", str(path), "write [name] or { key = 1 }"
        )
    remedy = ""
    if first["type"] == "list_type":
        tables = _keys_at(schema, _place(first))
        remedy = f"write [[{key}]] above each table" if tables else "write [ ... ]"
    return StudyError(f"{key}: {first['msg'][:1].lower()}{first['msg'][1:]}", str(path), remedy)


def _place(complaint: Any) -> tuple[str | int, ...]:
    """Where it is in the file, without the types that were tried."""
    return tuple(one for one in complaint["loc"] if not _TRIED.fullmatch(str(one)))


def _keys_at(schema: Any, where: tuple[Any, ...]) -> list[str]:
    """Return the valid keys of the table at a place in a file."""
    is_name = False  # of a table in a table of tables, which may be anything
    for part in where:
        if isinstance(part, int) or is_name:
            is_name = False
            continue
        field = schema.model_fields.get(part)
        annotation = None if field is None else field.annotation
        inner = [t for t in _types(annotation) if _is_table(t)]
        if not inner:
            return []
        schema, is_name = inner[0], get_origin(annotation) is dict
    return list(schema.model_fields)


def _is_table(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _types(annotation: Any) -> list[Any]:
    arguments = getattr(annotation, "__args__", ())
    return [annotation, *(one for a in arguments for one in _types(a))]
