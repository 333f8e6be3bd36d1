"""What is written of a case: what its study says, and the truth apart from it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import tomlkit

from blind_study.cases import Case
from blind_study.circumstances import MujocoCase
from dynident.effects import FRICTION_WIDTH


def state_study(study: Path, case: Case) -> None:
    """Let a study say the stated width of dry friction, and a period only where one is known."""
    document = tomlkit.parse(study.read_text())
    document.pop("friction_width", None)
    if isinstance(case, MujocoCase) and case.circumstances.repetition == "none":
        for entry in document["recordings"]:  # type: ignore[union-attr]
            entry.pop("period")  # type: ignore[union-attr]
    text = tomlkit.dumps(document)
    width = case.stated_width
    if width != FRICTION_WIDTH:
        text = text.replace("\ntorque =", f"\nfriction_width = {width!r}\ntorque =", 1)
    study.write_text(text)


def write_truth(truth: dict[str, Any], path: Path) -> None:
    """Write what was hidden, apart from the data."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(truth, indent=1) + "\n")
