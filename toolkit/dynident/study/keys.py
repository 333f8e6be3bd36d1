"""The keys of a study file in words, from what its tables say of themselves."""

from __future__ import annotations

import inspect
import textwrap

from dynident.closed_loop import ControllerFile
from dynident.effects import LawEntry
from dynident.fitting.loads import LoadEntry
from dynident.settings import SettingsTable
from dynident.study.study_file import (
    ColumnEntry,
    FilterEntry,
    NoiseEntry,
    RecordingEntry,
    StudyFile,
)

TABLES: tuple[tuple[str, type[SettingsTable]], ...] = (
    ("At the top", StudyFile),
    ("[[recordings]]", RecordingEntry),
    ("[columns]", ColumnEntry),
    ("[filter]", FilterEntry),
    ("[noise]", NoiseEntry),
    ("[loads.NAME]", LoadEntry),
    ("[controller]", ControllerFile),
    ("[laws.NAME]", LawEntry),
)
"""Tables of a study file by their headings."""


def keys_in_words() -> str:
    """Return every table of a study file with its keys, as the classes have them."""
    return "\n\n".join(f"{heading}\n{_table(table)}" for heading, table in TABLES)


def _table(table: type[SettingsTable]) -> str:
    said = textwrap.indent(inspect.cleandoc(table.__doc__ or ""), _INDENT)
    keys = (
        textwrap.fill(
            f"{key} : {' '.join((field.description or '').split())}",
            width=96,
            initial_indent=_INDENT,
            subsequent_indent=2 * _INDENT,
        )
        for key, field in table.model_fields.items()
    )
    return "\n".join((said, "", *keys))


_INDENT = "    "
