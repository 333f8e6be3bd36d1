"""Words that somebody typed: the one that was meant, and how much of a long one is shown."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

LONGEST_WORD = 200
"""Letters of a name that somebody may have meant; what is longer is not compared, which would take
time by its square, and is shown cut in its middle."""
_LONG = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")


def close_word(word: str, valid: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Return the valid word that a misspelt one resembles most, None if none does.

    Parameters
    ----------
    word : as it was written.
    valid : words in its place.
    cutoff : likeness that is needed, from 0 to 1.
    """
    if len(word) > LONGEST_WORD:
        return None
    return next(iter(difflib.get_close_matches(word, list(valid), 1, cutoff)), None)


def shortened(text: str) -> str:
    """Return a text whose words of more than `LONGEST_WORD` letters are cut in their middle."""
    return _LONG.sub(lambda word: f"{word[0][:100]}...{word[0][-50:]}", text)
