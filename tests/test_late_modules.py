"""A package that is loaded late is loaded once, and says itself why it cannot be."""

from __future__ import annotations

import importlib

import pytest

from dynident.late_modules import LateModule


def test_a_module_is_loaded_once_and_when_it_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    load = importlib.import_module

    def counted(name: str):
        asked.append(name)
        return load(name)

    monkeypatch.setattr(importlib, "import_module", counted)
    late = LateModule("math")
    assert not asked
    assert late.pi == late.tau / 2
    assert asked == ["math"]


def test_a_module_that_fails_with_an_attribute_error_says_so(tmp_path, monkeypatch) -> None:
    """As one does that was built for another NumPy; to look for its attribute must not recur."""
    (tmp_path / "built_for_another.py").write_text("import math\nmath.no_such_thing\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(AttributeError, match="no_such_thing"):
        _ = LateModule("built_for_another").anything
