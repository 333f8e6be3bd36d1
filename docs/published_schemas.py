"""The schemas of the project's files, as editors and other programs read them.

Settings are TOML, which has no null: what may be left out is left out.
"""

from __future__ import annotations

import ast
import inspect
import json
import textwrap
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from dynident.closed_loop.experiments.experiment_file import ExperimentFile
from dynident.fitting.estimate_schema import EstimateFile
from dynident.study.study_file import StudyFile

FOLDER = Path(__file__).resolve().parent / "schemas"


@cache
def words_of_keys(model: type[BaseModel]) -> dict[str, str]:
    """Return what stands below each key in the source of a model and of those it derives from.

    Read here: pydantic would read all sources whenever a model is imported.
    """
    found = {}
    for kind in reversed(model.__mro__):
        if not issubclass(kind, BaseModel) or kind is BaseModel:
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
        for key, said in pairwise(body):
            if isinstance(key, ast.AnnAssign) and isinstance(said, ast.Expr):
                found[key.target.id] = inspect.cleandoc(said.value.value)  # type: ignore[attr-defined]
    return found


class UntitledSchema(GenerateJsonSchema):
    """Without a title that repeats each key, and with what stands under it in the source."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        found, words = super().model_schema(schema), words_of_keys(schema["cls"])
        for key, one in found.get("properties", {}).items():
            if key in words:
                one["description"] = words[key]
        return found


class SettingsSchema(UntitledSchema):
    """Of TOML, which has no null."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        found = super().default_schema(schema)
        return {k: v for k, v in found.items() if k != "default" or v is not None}


FILES: Mapping[str, tuple[str, type[BaseModel], type[GenerateJsonSchema]]] = {
    "study": ("study.toml", StudyFile, SettingsSchema),
    "experiment": ("experiment.toml", ExperimentFile, SettingsSchema),
    "estimate": ("estimate.json", EstimateFile, UntitledSchema),
}
"""Name -> the file's usual name, its model, and how its schema is made."""


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file."""
    file, model, generator = FILES[name]
    made = model.model_json_schema(schema_generator=generator)
    head = {"$schema": GenerateJsonSchema.schema_dialect, "title": f"dynident: {file}"}
    return {**head, **{key: value for key, value in made.items() if key != "title"}}


def schema_text(name: str) -> str:
    """Return the JSON Schema of a kind of file as it is published."""
    return json.dumps(schema(name), indent=1, ensure_ascii=False) + "\n"


def schema_path(name: str) -> Path:
    """Return where it is published."""
    return FOLDER / f"{name}.schema.json"
