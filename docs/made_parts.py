"""Pages whose prose is written by hand, with parts between `<!-- NAME -->` and `<!-- end -->` made.

The scripts beside this one make the parts from the source, and tests ask that they are current.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping


def renewed(text: str, parts: Mapping[str, Callable[[], str]], page: str) -> str:
    """Return a page with its made parts as the source has them now.

    Parameters
    ----------
    text : of the page.
    parts : what makes each part, by its name.
    page : its name, for complaints.

    Raises
    ------
    ValueError
        If the page has no place for a part, or several.
    """
    for name, make in parts.items():
        begin, end = f"<!-- {name} -->\n", "<!-- end -->"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        made = begin + make() + end
        text, count = pattern.subn(lambda _, made=made: made, text)
        if count != 1:
            raise ValueError(f"{page} needs one '{begin.strip()}' with its '{end}'")
    return text
