"""The keys of a study file in words, from the docstrings of its tables."""

from __future__ import annotations

import inspect
from typing import Any

from dynident.closed_loop import Controller
from dynident.fitting.loads import LoadEntry
from dynident.study.study_file import (
    ColumnEntry,
    FilterEntry,
    NoiseEntry,
    RecordingEntry,
    StudyFile,
)

TABLES: tuple[tuple[str, type[Any]], ...] = (
    ("At the top", StudyFile),
    ("[[recordings]]", RecordingEntry),
    ("[columns]", ColumnEntry),
    ("[filter]", FilterEntry),
    ("[noise]", NoiseEntry),
    ("[loads.NAME]", LoadEntry),
    ("[controller]", Controller),
)
"""Tables of a study file by their headings."""


def keys_in_words() -> str:
    """Return every table of a study file with its keys, as their docstrings have them."""
    return "\n\n".join(f"{heading}\n{_indented(table)}" for heading, table in TABLES)


def _indented(table: type[Any]) -> str:
    text = inspect.cleandoc(table.__doc__ or "").partition("\nRaises\n")[0].rstrip()
    # The underlined word "Attributes" is for programmers.
    lines = text.replace("\nAttributes\n----------\n", "\n").splitlines()
    return "\n".join(f"    {line}" if line else "" for line in lines)
