"""Files are counted where something with a name is called, and nowhere else."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from files_entered import entered

SOURCES = {
    "called": "def call():\n    return 1\n",
    "imported": "LOADED = [x for x in range(3)]\ndef call():\n    return 2\n",
    "built": "class Thing:\n    def __init__(self):\n        self.size = 3\n",
    "failing": "def call():\n    raise ValueError\n",
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "entered_package"
    folder.mkdir()
    for name, text in SOURCES.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    return folder


def test_only_files_that_are_called_into_count(package: Path) -> None:
    def work() -> None:
        from entered_package import built, called, imported  # pyright: ignore

        assert built.Thing().size == len(imported.LOADED) == 3
        assert called.call() == 1

    assert entered(work, package) == [Path("called.py")]
    assert sys.getprofile() is None


def test_the_profile_is_taken_off_when_the_work_fails(package: Path) -> None:
    def work() -> None:
        from entered_package import failing  # pyright: ignore

        failing.call()

    with pytest.raises(ValueError):
        entered(work, package)
    assert sys.getprofile() is None
