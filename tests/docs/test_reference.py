"""Published schemas and pages of reference: current, complete, and true of files that there are."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pydantic import BaseModel

import dynident as di
from dynident.criteria import DEFAULTS
from make_reference import HERE
from published_schemas import FILES, schema, words_of_keys
from synthetic import arm, synthetic, true_values

ROOT = Path(__file__).parents[2]


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Tables that a key may hold, however deep in lists and unions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in getattr(annotation, "__args__", ()):
        yield from models_in(inner)


def tables_of(model: type[BaseModel]) -> set[type[BaseModel]]:
    """All tables of a file."""
    found = {model}
    for field in model.model_fields.values():
        found |= {inner for one in models_in(field.annotation) for inner in tables_of(one)}
    return found


@pytest.mark.parametrize("name", FILES)
def test_the_reference_lists_every_key_with_a_meaning(name: str) -> None:
    page = (HERE / "reference" / f"{name}.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (.{5,}?)<br>\*(.{4,}?)\* \|$", page, re.MULTILINE)
    listed = [key for key, _, _ in rows]
    wanted = [key for table in tables_of(FILES[name][1]) for key in table.model_fields]
    if name == "study":
        groups = vars(DEFAULTS)
        wanted += [*groups, *(one for group in groups.values() for one in vars(group))]
    assert sorted(listed) == sorted(wanted)


@pytest.mark.parametrize("name", FILES)
def test_every_key_says_what_it_means_in_its_class(name: str) -> None:
    mute = {
        (table.__name__, key)
        for table in tables_of(FILES[name][1])
        for key in table.model_fields
        if len(words_of_keys(table).get(key, "")) < 5
    }
    assert mute == set()


STUDIES = sorted(ROOT.glob("problems/*/study*.toml"))
EXPERIMENTS = sorted(ROOT.glob("problems/*/experiment*.toml"))


@pytest.mark.parametrize(
    "path", [*STUDIES, *EXPERIMENTS], ids=lambda p: f"{p.parent.name}.{p.stem}"
)
def test_files_that_there_are_pass(path: Path) -> None:
    name = "study" if path in STUDIES else "experiment"
    Draft202012Validator(schema(name)).validate(tomllib.loads(path.read_text()))


def test_a_saved_estimate_passes(tmp_path: Path) -> None:
    model = di.Model(arm()) + "stribeck_friction@elbow"
    made = synthetic(model, true_values(model), duration=8.0, rate_hz=100.0, torque_std=0.1)
    di.fit(model, made).save(tmp_path / "estimate.json")
    Draft202012Validator(schema("estimate")).validate(
        json.loads((tmp_path / "estimate.json").read_text())
    )


@pytest.mark.parametrize(
    "said",
    [
        {"usee": "train"},
        {"recordings": [{"file": "a.csv", "period": -1.0}]},
        {"recordings": [{"file": "a.csv", "rate_hz": "fast"}]},
        {"controller": {"kind": "pdd", "kp": 1.0}},
        {"criteria": {"gates": {"level": -1.0}}},
        {"criteria": {"gates": {"lvl": 0.1}}},
        {"laws": 3},
    ],
    ids=str,
)
def test_what_the_program_refuses_the_schema_refuses(said: dict[str, Any]) -> None:
    good = {"robot": "arm.urdf", "recordings": [{"file": "a.csv"}]}
    validator = Draft202012Validator(schema("study"))
    assert validator.is_valid(good)
    assert not validator.is_valid(good | said)


def test_laws_may_be_a_file_and_tables_and_both_pass() -> None:
    good = {"robot": "arm.urdf", "recordings": [{"file": "a.csv"}]}
    for laws in ("lab.toml", ["a.toml", "b.toml"], {"drum": {"torque": "c*v"}, "b": "b.toml"}):
        assert Draft202012Validator(schema("study")).is_valid(good | {"laws": laws})
