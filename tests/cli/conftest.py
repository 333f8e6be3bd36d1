"""The command `dynident` in this process, with everything that it says."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from dynident.cli import main, studies, work
from dynident.diagnosis import Diagnosis
from study_files import STUDY, write_study


@dataclass(frozen=True)
class Done:
    """What a run of the command left behind."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one JSON object on standard output, and nothing beside it."""
        found = json.loads(self.out)
        assert isinstance(found, dict)
        assert self.out.count("\n") == 1 and self.out.endswith("\n")
        return found


Run = Callable[..., Done]


@pytest.fixture
def run(capfd, tmp_path, monkeypatch) -> Run:
    """Run the command as the shell would, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DYNIDENT_DATA", raising=False)
    # On a slow machine lines of progress would come in between.
    monkeypatch.setattr("dynident.progress.EVERY", 1e9)

    def call(*arguments: str | Path) -> Done:
        capfd.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([os.fspath(one) for one in arguments])
        said = capfd.readouterr()
        assert "error: unexpected" not in said.err, said.err
        return Done(int(stop.value.code or 0), said.out, said.err)

    return call


@pytest.fixture
def sought(monkeypatch) -> list[Diagnosis]:
    """The diagnoses that the commands of a test make, the latest last."""
    found: list[Diagnosis] = []

    def diagnosed(*asked: Any, **more: Any) -> Diagnosis:
        found.append(work.diagnosis_of(*asked, **more))
        return found[-1]

    monkeypatch.setattr(studies, "diagnosis_of", diagnosed)
    return found


@pytest.fixture
def study(tmp_path) -> Callable[..., Path]:
    """Write a study with its robot and recordings; return its path."""

    def make(text: str = STUDY) -> Path:
        return write_study(tmp_path, text)

    return make
