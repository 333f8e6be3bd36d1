"""The documentation of the study file: every key that is read is explained."""

from __future__ import annotations

import pydoc
import re

import pytest

import dynident.study
from dynident.closed_loop import ControllerFile
from dynident.effects import LawEntry
from dynident.fitting.loads import LoadEntry
from dynident.study.study_file import (
    ColumnEntry,
    FilterEntry,
    NoiseEntry,
    RecordingEntry,
    StudyFile,
)

SECTIONS = {
    "At the top": StudyFile,
    "[[recordings]]": RecordingEntry,
    "[columns]": ColumnEntry,
    "[filter]": FilterEntry,
    "[noise]": NoiseEntry,
    "[loads.NAME]": LoadEntry,
    "[controller]": ControllerFile,
    "[laws.NAME]": LawEntry,
}


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_key_is_explained(heading: str) -> None:
    page = pydoc.plain(pydoc.render_doc(dynident.study))
    _, found, rest = page.partition(f"\n    {heading}\n")
    assert found
    section = re.split(r"\n    \S", rest)[0]
    said = set(re.findall(r"\w+", " ".join(re.findall(r"^ {8}([\w, ]+) : ", section, re.M))))
    assert set(SECTIONS[heading].model_fields) == said
