"""What is kept of columns, and for how long."""

from __future__ import annotations

from dynident.evidence.columns.column_cache import ColumnCache


def test_answers_belong_to_the_very_objects_that_were_asked() -> None:
    cache, fit, runs = ColumnCache(), [1.0], (1, 2)
    cache.answers_of(fit, runs)["shoulder"] = 3.0
    assert cache.answers_of(fit, runs) == {"shoulder": 3.0}
    assert cache.answers_of([1.0], runs) == {}  # equal, but another one
    assert cache.answers_of(fit, runs) == {}  # which took its place
