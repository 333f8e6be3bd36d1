"""Words that somebody typed: the one that was meant, and how much of a long one is shown."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence

LONGEST_WORD = 200
"""Letters of a name that somebody may have meant; what is longer is not compared, which would take
time by its square, and is shown cut in its middle."""
_LONG = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")


def did_you_mean(
    word: str, valid: Iterable[str], otherwise: str = "", *, cutoff: float = 0.6
) -> str:
    """Return the question whether the valid word was meant that a misspelt one resembles most.

    Parameters
    ----------
    word : as it was written; its case does not matter.
    valid : words in its place.
    otherwise : what is said where none of them resembles it.
    cutoff : likeness that is needed, from 0 to 1.
    """
    if len(word) > LONGEST_WORD:
        return otherwise
    written = {one.lower(): one for one in reversed(list(valid))}
    close = difflib.get_close_matches(word.lower(), list(written), 1, cutoff)
    return f"did you mean '{written[close[0]]}'?" if close else otherwise


def nearest(word: str, valid: Sequence[str], kind: str) -> str:
    """Return a remedy for a misspelt word: the valid word that it resembles, else all of them.

    Parameters
    ----------
    word : as it was written.
    valid : words in its place.
    kind : what they are, in the plural.
    """
    return did_you_mean(word, valid, _all(valid, kind))


def nearest_and_all(word: str, valid: Sequence[str], kind: str) -> str:
    """Return a remedy for a misspelt word: the valid word that it resembles, and all of them.

    Parameters
    ----------
    word, valid, kind : as for `nearest`.
    """
    return f"{did_you_mean(word, valid)} {_all(valid, kind)}".lstrip()


def _all(valid: Sequence[str], kind: str) -> str:
    return f"{kind}: {', '.join(valid) or 'none'}"


def shortened(text: str) -> str:
    """Return a text whose words of more than `LONGEST_WORD` letters are cut in their middle."""
    return _LONG.sub(lambda word: f"{word[0][:100]}...{word[0][-50:]}", text)
