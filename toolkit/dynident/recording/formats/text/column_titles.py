"""Words above the columns of a text file: names, units, and comments that are neither."""

from __future__ import annotations

import re
from collections.abc import Sequence

from dynident.recording.formats.column_table import UNWANTED

_OURS = re.compile(r"|-|s|sec|(rad|m)(/s(\^?2|²)?)?|n|n[*·.]?m")
"""Units that need no word, without blanks and in small letters."""
_OTHERS = re.compile(
    r"[muµn]s(ec)?|(deg|°|grad|mm)(/s(\^?2|²)?)?|rpm|1/min|mn[*·.]?m|n[*·.]?mm|m?[av]|%|°?c|degc|w|hz"
    r"|kg|counts?|inc|ticks"
)
_BRACKETED = re.compile(r"\[.*\]|\(.*\)|<.*>")
_TELLING = re.compile(r"[^\W\d]\w*\d|_|\w[./\[({]\w|[a-z][A-Z]|^[^\W\d_aAiI]$")
"""In names of columns: a number, an underscore, a mark within, capitals within, one letter."""
_LETTER = re.compile(r"[^\W\d_]")
_WORDS = re.compile(
    r"time(stamp)?|stamp|clock|secs?|seconds|index|seq|pos(itions?)?|angles?|vel(ocity|ocities)?|speeds?"
    r"|acc(el|eleration)?s?|tau|torques?|efforts?|forces?|currents?|temp(erature)?s?|voltages?"
    r"|ref(erence)?|target|desired|actual|measured|command|cmd|dq|ddq|qd|qdd"
)
_MOST = 1 / 2
"""Share of words that look like names above which all are; those of joints may be plain words."""


def are_names(cells: Sequence[str]) -> bool:
    """Whether the words of a comment are the names of columns, and not those of a sentence.

    Names have digits, underscores, points or brackets in them, are single letters, or words for
    what is measured; more than half of them do.

    Parameters
    ----------
    cells : the words, or what stands between commas.
    """
    words = [cell for cell in cells if cell not in UNWANTED]
    telling = [word for word in words if _is_telling(word)]
    return len(telling) > _MOST * len(words)


def are_units(cells: Sequence[str]) -> bool:
    """Whether cells are units, one at least."""
    known = all(_BRACKETED.fullmatch(cell) or _is_unit(_bare(cell).lower()) for cell in cells)
    return known and any(cells)


def with_unit(name: str, unit: str) -> str:
    """Return a name with the unit that stands below it, if that is another one than ours."""
    unit = _bare(unit)
    return name if _OURS.fullmatch(unit.lower()) else f"{name} [{unit}]"


def _is_telling(word: str) -> bool:
    if not _LETTER.search(word):
        return False
    plain = re.findall(r"[^\W\d_]+", word.lower())
    return bool(_TELLING.search(word)) or any(map(_WORDS.fullmatch, plain))


def _is_unit(text: str) -> bool:
    return bool(_OURS.fullmatch(text) or _OTHERS.fullmatch(text))


def _bare(unit: str) -> str:
    return re.sub(r"[\[\]()<>\s]", "", unit)
