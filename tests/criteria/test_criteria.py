"""Criteria say what they are and where they come from, and refuse what makes no sense."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from dynident import criteria
from dynident.criteria import DEFAULTS, Criteria, GateCriteria
from dynident.criteria.criterion import about
from dynident.errors import CriteriaError

EVERY = [
    (group.name, one) for group in fields(Criteria) for one in fields(getattr(DEFAULTS, group.name))
]


@pytest.mark.parametrize(("group", "one"), EVERY, ids=[f"{g}.{one.name}" for g, one in EVERY])
def test_each_says_what_it_is_its_unit_and_where_it_comes_from(group: str, one) -> None:
    known = about(one)
    assert known.what and known.unit
    kind, _, detail = known.source.partition(": ")
    assert kind in ("measured", "literature", "taste")
    assert detail or kind == "taste"
    assert not known.objection(known.default)


def test_each_is_read_somewhere() -> None:
    room = Path(criteria.__file__).parent
    files = [p for p in room.parent.rglob("*.py") if room not in p.parents]
    source = "\n".join(p.read_text() for p in files)
    unread = [one.name for _, one in EVERY if not re.search(rf"\.{one.name}\b", source)]
    assert unread == []


def test_the_table_lists_each_of_them() -> None:
    rows = DEFAULTS.table().rows
    assert [row[0] for row in rows] == [f"{group}.{one.name}" for group, one in EVERY]
    assert all(all(row) for row in rows)


def test_what_is_changed_is_named_with_its_default() -> None:
    other = Criteria.with_values({"gates": {"level": 0.005}, "contacts": {"tails": [0.9, 0.99]}})
    assert [str(one) for one in other.changed] == [
        "gates.level = 0.005 (default 0.01)",
        "contacts.tails = [0.9, 0.99] (default [0.95, 0.99, 0.997])",
    ]
    assert other == Criteria(gates=GateCriteria(level=0.005), contacts=other.contacts)
    assert DEFAULTS.changed == () and repr(DEFAULTS) == "Criteria()"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gate": {}}, "unknown group 'gate'. did you mean 'gates'?"),
        ({"gates": {"levl": 0.1}}, "unknown criterion 'gates.levl'. did you mean 'level'?"),
        ({"gates": 0.1}, "gates: a table is needed here"),
        ({"gates": {"level": 2}}, "gates.level: 2 is out of its range"),
        ({"gates": {"level": float("nan")}}, "gates.level: nan is out of its range"),
        ({"gates": {"level": "low"}}, "gates.level: needs a number"),
        ({"search": {"contenders": 2.5}}, "search.contenders: needs a whole number"),
        ({"search": {"contenders": True}}, "search.contenders: needs a whole number"),
        ({"contacts": {"tails": [0.9, 0.8]}}, "contacts.tails: its numbers must ascend"),
        ({"contacts": {"tails": 0.9}}, "contacts.tails: needs a list"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(values: dict[str, Any], message: str) -> None:
    with pytest.raises(CriteriaError) as refused:
        Criteria.with_values(values)
    assert message in str(refused.value) and "\n" not in str(refused.value)
